"""Random colours, textures, calibration boards and lamps."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cache
from importlib.util import find_spec
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from hecbench.errors import InputError

Floats = NDArray[np.float32]
Rng = np.random.Generator

_PICTURE_PACKAGES = (
    ("skimage", "data"),
    ("matplotlib", "mpl-data/sample_data"),
    ("sklearn", "datasets/images"),
    ("scipy", "datasets"),
)
"""Packages that bring photographs along, and where; those that are installed are used."""
_LONGEST_PX, _SMALLEST_PX = 512, 120
_GREYS = (0.05, 0.15, 0.3, 0.5, 0.8, 0.95)
"""Of laboratory furniture."""


@dataclass
class Appearance:
    """Draws from `rng`. `robot_colours` (C, 3) tempt the network: other things have them, too."""

    rng: Rng
    robot_colours: NDArray[np.float64]
    photographs: tuple[Floats, ...]
    muted: float | None = None
    """Share of coloured things among grey ones, in a laboratory; None elsewhere."""
    _board_px: int = field(default=256, init=False)

    def colour(self) -> NDArray[np.float64]:
        """RGB (3,) in [0, 1]."""
        rng = self.rng
        if self.muted is not None:
            grey = rng.choice(_GREYS) + rng.normal(0, 0.06)
            return np.asarray(
                np.clip(grey + rng.normal(0, 0.3 if rng.random() < self.muted else 0.02, 3), 0, 1)
            )
        kind = rng.random()
        if kind < 0.35:
            return np.asarray(np.clip(rng.uniform(0, 1) + rng.normal(0, 0.03, 3), 0, 1))
        if kind < 0.6:
            base = self.robot_colours[rng.integers(len(self.robot_colours))]
            return np.asarray(np.clip(base * rng.uniform(0.6, 1.3) + rng.normal(0, 0.04, 3), 0, 1))
        return rng.uniform(0, 1, 3)

    def texture(self, height: int, width: int) -> Floats:
        """RGB (H, W, 3) in [0, 1]: a piece of a photograph, noise, or a gradient."""
        kind = self.rng.random()
        if kind < 0.4 and self.photographs:
            return self._photograph(height, width)
        if kind < 0.6:
            return self._noise(height, width)
        down, across = self.rng.uniform(-1, 1, 2)
        ramp = np.linspace(0, down, height)[:, None, None] + np.linspace(0, across, width)[None, :, None]
        return np.clip(self.colour() + ramp * self.rng.normal(0, 0.3, 3), 0, 1).astype(np.float32)

    def _photograph(self, height: int, width: int) -> Floats:
        rng = self.rng
        source = self.photographs[rng.integers(len(self.photographs))]
        side = int(min(source.shape[:2]) * rng.uniform(0.35, 1))
        y, x = rng.integers(source.shape[0] - side + 1), rng.integers(source.shape[1] - side + 1)
        piece = np.ascontiguousarray(source[y : y + side, x : x + side])
        out = np.asarray(cv2.resize(piece, (width, height), interpolation=cv2.INTER_AREA), np.float32)
        if rng.random() < 0.5:
            out = out[:, ::-1]
        if rng.random() < 0.5:
            out = out @ np.clip(np.eye(3) + rng.normal(0, 0.25, (3, 3)), -0.5, 1.5).astype(np.float32)
        if self.muted is not None:
            grey = out.mean(2, keepdims=True)
            out = grey + np.float32(rng.uniform(0, 1)) * (out - grey)
        return np.clip(out, 0, 1).astype(np.float32)

    def _noise(self, height: int, width: int) -> Floats:
        rng = self.rng
        out, gain = np.zeros((height, width, 3), np.float32), np.float32(1)
        for cells in rng.permutation([2, 4, 8, 16, 32, 64])[: rng.integers(1, 4)]:
            small = rng.random((cells + 1, cells + 1, 3 if rng.random() < 0.7 else 1), np.float32)
            small = np.ascontiguousarray(np.broadcast_to(small, (cells + 1, cells + 1, 3)))
            smooth = cv2.INTER_CUBIC if rng.random() < 0.8 else cv2.INTER_NEAREST
            out += gain * cv2.resize(small, (width, height), interpolation=smooth)
            gain *= np.float32(0.6)
        out -= out.min()
        out /= max(float(out.max()), 1e-6)
        low, high = self.colour(), self.colour()
        return np.clip(low + out * (high - low), 0, 1).astype(np.float32)

    def board(self) -> Floats:
        """A chessboard, marker board, dot grid or plate, (256, 256, 3)."""
        rng, n = self.rng, self._board_px
        rows, columns = int(rng.integers(3, 11)), int(rng.integers(4, 14))
        kind = rng.random()
        if kind > 0.9:
            return np.asarray(cv2.resize(self.texture(64, 64), (n, n)), np.float32)
        if kind < 0.6:
            cells = np.add.outer(np.arange(rows), np.arange(columns)) % 2
            if rng.random() < 0.35:  # markers in the white fields
                cells = np.kron(cells, np.ones((6, 6), int))
                cells[(cells > 0) & (rng.random(cells.shape) < 0.3)] = 0
        else:
            bits = rng.random((rows, rows)) < 0.5
            cells = np.pad(np.pad(bits.astype(int), 1), 1, constant_values=1)
        tile = cv2.resize(cells.astype(np.float32), (n, n), interpolation=cv2.INTER_NEAREST)
        if kind > 0.8:
            tile = self._dots(columns, n)
        tile = np.pad(tile, int(n * rng.uniform(0, 0.15)), constant_values=1)
        tile = cv2.resize(tile, (n, n), interpolation=cv2.INTER_AREA)
        white, black = rng.uniform(0.7, 1), rng.uniform(0, 0.25)
        return np.repeat((black + tile * (white - black))[..., None], 3, 2).astype(np.float32)

    def _dots(self, columns: int, n: int) -> Floats:
        tile, pitch = np.ones((n, n), np.float32), n / columns
        for row in range(columns):
            for column in range(columns):
                place = (int((column + 0.5) * pitch), int((row + 0.5) * pitch))
                cv2.circle(tile, place, int(pitch * 0.3), 0.0, -1, cv2.LINE_AA)
        return tile

    def light(self, normals: Floats) -> tuple[Floats, Floats, Floats]:
        """Diffuse light, gloss, and reflections of a room, each (N,), on unit normals (N, 3), camera frame."""
        rng = self.rng
        diffuse = np.full(len(normals), rng.uniform(0.25, 0.8), np.float32)
        gloss = np.zeros(len(normals), np.float32)
        for _ in range(rng.integers(1, 4)):
            lamp = rng.normal(0, 1, 3) * [1, 1, 0.7] + [0, -0.6, -0.4]
            lamp = (lamp / np.linalg.norm(lamp)).astype(np.float32)
            between = lamp + np.array([0, 0, -1], np.float32)
            between /= np.linalg.norm(between)
            diffuse += np.float32(rng.uniform(0.1, 0.7)) * np.maximum(normals @ lamp, 0)
            sharpness = np.float32(rng.choice([4, 10, 30, 80]))
            gloss += np.float32(rng.uniform(0, 0.7)) * np.maximum(normals @ between, 0) ** sharpness
        axis = rng.normal(0, 1, 3).astype(np.float32) * np.float32(rng.uniform(1, 5))
        bands = np.sin(normals @ axis + np.float32(rng.uniform(0, 6))) * np.float32(rng.uniform(0, 0.35))
        return diffuse, gloss, bands


@cache
def photographs(folder: Path | None = None) -> tuple[Floats, ...]:
    """Pictures (H, W, 3) RGB in [0, 1] from a folder, without a robot in them, and from installed packages.

    Raises:
        InputError: the folder holds no readable picture.
    """
    folders = [] if folder is None else [folder]
    for package, inside in _PICTURE_PACKAGES:
        spec = find_spec(package)
        if spec is not None and spec.origin is not None:
            folders.append(Path(spec.origin).parent / inside)
    found: list[Floats] = []
    for place in folders:
        for path in sorted(place.glob("*")):
            if path.suffix.lower() in (".jpg", ".jpeg", ".png"):
                found += _readable(path)
        if place == folder and not found:
            raise InputError(f"{folder}: holds no readable JPEG or PNG picture; give a folder of photographs")
    return tuple(found)


def _readable(path: Path) -> list[Floats]:
    image = cv2.imread(str(path))
    if image is None or min(image.shape[:2]) < _SMALLEST_PX:
        return []
    scale = min(1.0, _LONGEST_PX / max(image.shape[:2]))
    small = cv2.resize(image, None, fx=scale, fy=scale, interpolation=cv2.INTER_AREA)
    return [np.asarray(small[..., ::-1] / 255, np.float32)]
