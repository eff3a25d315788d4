"""Things that are not a robot, drawn flat: boxes, tubes with a sheen, discs, blobs, shelves, lines, letters."""

from __future__ import annotations

import cv2
import numpy as np
from numpy.typing import NDArray

from hecbench.se3 import Array
from hecbench_plugins.perception.appearance import Appearance

Floats = NDArray[np.float32]

_SUBPIXEL_BITS = 3
_TUBE_STRIPS = 9


class Clutter:
    """Draws on `image` (H, W, 3) and marks where in `covered` (H, W), 255."""

    def __init__(self, image: Floats, appearance: Appearance) -> None:
        self.image, self.appearance, self.rng = image, appearance, appearance.rng
        self.covered = np.zeros(image.shape[:2], np.uint8)

    def scatter(self, count: int, sizes: tuple[float, float]) -> None:
        """Draw things of random kinds with lengths between two shares of the width, on a logarithmic scale."""
        kinds = (self._box, self._tube, self._disc, self._blob, self._shelf, self._line, self._letters)
        chosen = self.rng.choice(len(kinds), count, p=(0.33, 0.24, 0.1, 0.08, 0.03, 0.15, 0.07))
        height, width = self.image.shape[:2]
        for kind in chosen:
            centre = self.rng.uniform((0, 0), (width, height))
            length = width * np.exp(self.rng.uniform(*np.log(sizes)))
            upright = self.rng.choice([0, np.pi / 2]) + self.rng.normal(0, 0.1)
            angle = upright if self.rng.random() < 0.6 else self.rng.uniform(0, np.pi)
            along = length * np.array([np.cos(angle), np.sin(angle)])
            across = self.rng.uniform(0.1, 1) * np.array([-along[1], along[0]])
            kinds[kind](centre, along, across)

    def _fill(self, corners: Array, colour: Array) -> None:
        fixed = np.rint(corners * 2**_SUBPIXEL_BITS).astype(np.int32)
        cv2.fillPoly(self.image, [fixed], np.clip(colour, 0, 1).tolist(), cv2.LINE_AA, _SUBPIXEL_BITS)
        cv2.fillPoly(self.covered, [fixed], 255, cv2.LINE_8, _SUBPIXEL_BITS)

    def _box(self, centre: Array, along: Array, across: Array) -> None:
        quad = centre + np.array([-along - across, along - across, along + across, across - along]) / 2
        depth = self.rng.normal(0, 0.25, 2) * np.linalg.norm(across)
        colour = self.appearance.colour()
        self._fill(np.vstack([quad[[0, 1]], quad[[1, 0]] + depth]), 0.7 * colour)
        self._fill(np.vstack([quad[[1, 2]], quad[[2, 1]] + depth]), 0.5 * colour)
        self._fill(quad + depth, colour)

    def _tube(self, centre: Array, along: Array, across: Array) -> None:
        angles = np.linspace(0.2, 2.9, _TUBE_STRIPS) + self.rng.uniform(-0.6, 0.6)
        colour = self.appearance.colour()
        for strip, sheen in enumerate(0.55 + 0.6 * np.abs(np.sin(angles))):
            low, high = (((strip + end) / _TUBE_STRIPS - 0.5) * across for end in (0, 1.3))
            quad = np.array([low - along / 2, low + along / 2, high + along / 2, high - along / 2])
            self._fill(centre + quad, colour * sheen)

    def _disc(self, centre: Array, along: Array, across: Array) -> None:
        turn = np.linspace(0, 2 * np.pi, 24, endpoint=False)[:, None]
        self._fill(centre + (np.cos(turn) * along + np.sin(turn) * across) / 3, self.appearance.colour())

    def _blob(self, centre: Array, along: Array, across: Array) -> None:
        """A rounded thing with a shaded rim: a chair, a bag, a coat."""
        turn = np.linspace(0, 2 * np.pi, 32, endpoint=False)
        waves = self.rng.normal(0, [[0.15], [0.1], [0.07]], (3, 2))
        radius = 1 + sum(w[0] * np.cos(k * turn) + w[1] * np.sin(k * turn) for k, w in enumerate(waves, 1))
        rim = radius[:, None] * (np.cos(turn)[:, None] * along + np.sin(turn)[:, None] * across) / 2
        colour, shift = self.appearance.colour(), self.rng.normal(0, 0.05, 2) * np.linalg.norm(along)
        for share, shade in ((1, 0.7), (0.85, 0.85), (0.65, 1.0)):
            self._fill(centre + share * rim + (1 - share) * shift, shade * colour)

    def _shelf(self, centre: Array, along: Array, across: Array) -> None:
        boards, colour = int(self.rng.integers(3, 8)), self.appearance.colour()
        for place in np.linspace(-1, 1, boards):
            middle = centre + place * across * 2
            thick = across * self.rng.uniform(0.03, 0.12)
            self._fill(
                middle + np.array([-along - thick, along - thick, along + thick, thick - along]), colour
            )
            for _ in range(self.rng.integers(0, 5)):
                item = middle + self.rng.uniform(-1, 1) * along
                self._box(item, along * self.rng.uniform(0.05, 0.3), across * self.rng.uniform(0.2, 0.8))

    def _line(self, centre: Array, along: Array, across: Array) -> None:
        start, end = ((int(v[0]), int(v[1])) for v in (centre - along, centre + along))
        thickness = int(self.rng.integers(1, 6))
        cv2.line(self.image, start, end, self.appearance.colour().tolist(), thickness, cv2.LINE_AA)
        cv2.line(self.covered, start, end, 255, thickness)

    def _letters(self, centre: Array, along: Array, across: Array) -> None:
        text = "".join(chr(self.rng.integers(33, 126)) for _ in range(6))
        place, font = (int(centre[0]), int(centre[1])), int(self.rng.integers(0, 8))
        style = font, self.rng.uniform(0.3, 2)
        thickness = int(self.rng.integers(1, 4))
        cv2.putText(
            self.image, text, place, *style, self.appearance.colour().tolist(), thickness, cv2.LINE_AA
        )
        cv2.putText(self.covered, text, place, *style, 255, thickness)
