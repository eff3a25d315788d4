"""Run a trained network by OpenCV alone: the whole picture first, then the part around the robot, larger."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from hecbench.errors import InputError
from hecbench.se3 import Array
from hecbench_plugins.perception.card import ModelCard, read_card
from hecbench_plugins.perception.graph import runnable
from hecbench_plugins.perception.plan import STRIDE
from hecbench_plugins.perception.settings import READING
from hecbench_plugins.perception.shrinking import softened
from hecbench_plugins.perception.skeleton import keypoint_positions

Floats = NDArray[np.float32]


@dataclass(frozen=True, eq=False)
class Sighting:
    """The network's answer for one picture.

    Attributes:
        image: (H, W, 3) RGB that was seen.
        logits: (channels, h, w) for cells of the part that was looked at.
        pixel_T_cell: (2, 3), affine.
        keypoints: (K, 2) px.
        trust: (K,) share of each heatmap within a few cells of its top, in [0, 1].
        confidence: that there is a robot, in [0, 1]; too little of it empties the masks.
    """

    card: ModelCard
    image: NDArray[np.uint8]
    logits: Floats
    pixel_T_cell: Array
    keypoints: Array
    trust: Array
    confidence: float

    def visible(self) -> Floats:
        """(H, W) in [0, 1]: the robot where nothing hides it. All 0 when there is none."""
        logits = self._spread(self.logits[len(self.card.palette)], READING.beyond)
        return self._sharpened(np.asarray(1 / (1 + np.exp(-logits)), np.float32))

    def whole(self) -> Floats:
        """(H, W) in [0, 1]: the robot as if nothing hid it."""
        return self._sharpened(1 - self._shares()[..., 0])

    def colours(self) -> Floats:
        """(H, W, 3) RGB in [0, 1]: the colours of the model that the robot has, if it is there."""
        shares = self._shares()[..., 1:]
        return np.asarray(shares @ self.card.colours()[1:] / shares.sum(2, keepdims=True), np.float32)

    def _sharpened(self, share: Floats) -> Floats:
        """A soft mask whose edges follow those of the image, without small pieces.

        The guided filter (He, Sun and Tang 2013) fits the mask as a linear function of the colours nearby.
        """
        radius = max(2, round(READING.guide_cells * float(self.pixel_T_cell[0, 0])))
        guide = self.image.astype(np.float32) / 255
        sharp = cv2.ximgproc.guidedFilter(guide, share, radius, READING.guide_softening)
        sharp = np.clip(np.asarray(sharp, np.float32), 0, 1)
        found = self.confidence > READING.least_confidence
        return np.asarray(found * sharp * _largest(sharp > READING.robot), np.float32)

    def _shares(self) -> Floats:
        """(H, W, 1 + C) of the background and the colours."""
        count = len(self.card.palette)
        top = self.logits[:count].max(0)
        spread = [
            self._spread(channel - top, 0.0 if place == 0 else READING.beyond)
            for place, channel in enumerate(self.logits[:count])
        ]
        return _softmax(np.stack(spread, -1), -1)

    def _spread(self, channel: Floats, beyond: float) -> Floats:
        """A channel of cells as (H, W) pixels."""
        spread = cv2.warpAffine(
            channel,
            self.pixel_T_cell,
            self.image.shape[1::-1],
            flags=cv2.INTER_LINEAR,
            borderMode=cv2.BORDER_CONSTANT,
            borderValue=beyond,
        )
        return np.asarray(spread, np.float32)


class PerceptionModel:
    """A network from its folder.

    Raises:
        InputError: the folder's files are missing or damaged, or the graph does not fit its card.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.card, weights = read_card(folder)
        path = folder / self.card.weights
        with runnable(path):
            self._net = cv2.dnn.readNetFromONNX(np.frombuffer(weights, np.uint8))
            answer = self._answer(np.zeros((2 * STRIDE, STRIDE, 3), np.uint8))
        expected = (self.card.outputs, STRIDE, STRIDE // 2)
        if answer.shape != expected:
            raise InputError(
                f"{path}: the graph answers {answer.shape} to a picture of {2 * STRIDE} x {STRIDE} px, and"
                f" its card wants {expected}: fetch or train the model again"
            )

    def see(self, image: NDArray[np.uint8]) -> Sighting:
        """What is in a picture (H, W, 3) RGB, undistorted.

        Raises:
            InputError: the picture has another shape, or less than 32 px on a side.
        """
        if image.ndim != 3 or image.shape[2] != 3 or min(image.shape[:2]) < STRIDE:
            raise InputError(
                f"a picture of {STRIDE} x {STRIDE} px RGB or larger is needed, not {image.shape}"
            )
        height, width = image.shape[:2]
        logits, pixel_T_cell = self._look(image, np.array([0.0, 0.0, width, height]), READING.coarse_px)
        box = self._around(logits, pixel_T_cell, width, height)
        if box is not None:
            logits, pixel_T_cell = self._look(image, box, READING.fine_px)
        keypoints, trust = _tops(logits[len(self.card.palette) + 1 :])
        confidence = _confidence(logits[len(self.card.palette)], trust)
        keypoints = keypoints @ pixel_T_cell[:, :2].T + pixel_T_cell[:, 2]
        return Sighting(self.card, image, logits, pixel_T_cell, keypoints, trust, confidence)

    def keypoint_positions(self, robot: str, links: Sequence[str], frame_T_link: Array) -> Array:
        """(..., K, 3) m of a robot's keypoints, in the frame of frame_T_link (..., L, 4, 4).

        Raises:
            Refusal: the network does not know the robot.
        """
        self.card.require(robot, "keypoints")
        return keypoint_positions(links, self.card.keypoints[robot], frame_T_link)

    def _look(self, image: NDArray[np.uint8], box: Array, sizes: tuple[int, ...]) -> tuple[Floats, Array]:
        """Logits of the part in `box` (left, top, right, bottom px), the mean over `sizes`, and pixel_T_cell."""
        total, pixel_T_cell = self._look_once(image, box, sizes[-1])
        for size in sizes[:-1]:
            other, pixel_T_other = self._look_once(image, box, size)
            other_T_cell = (pixel_T_cell - np.c_[np.zeros((2, 2)), pixel_T_other[:, 2]]) / pixel_T_other[0, 0]
            total = total + np.stack(
                [_resampled(channel, other_T_cell, total.shape[1:]) for channel in other]
            )
        return total / np.float32(len(sizes)), pixel_T_cell

    def _look_once(self, image: NDArray[np.uint8], box: Array, longest: int) -> tuple[Floats, Array]:
        side = box[2:] - box[:2]
        scale = longest / side.max()
        size = np.maximum(np.ceil(side * scale / STRIDE - 1e-6), 1).astype(int) * STRIDE
        corner = (box[:2] + box[2:]) / 2 - size / scale / 2
        pixel_T_small = np.c_[np.eye(2) / scale, 0.5 / scale + corner - 0.5]
        small = cv2.warpAffine(
            softened(image, scale),
            pixel_T_small,
            (int(size[0]), int(size[1])),
            flags=cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP,
            borderMode=cv2.BORDER_REPLICATE,
        )
        pixel_T_cell = pixel_T_small.copy()
        pixel_T_cell[:, 2] += pixel_T_small[:, :2] @ [0.5, 0.5]
        pixel_T_cell[:, :2] *= 2
        return self._answer(np.asarray(small, np.uint8)), pixel_T_cell

    def _answer(self, small: NDArray[np.uint8]) -> Floats:
        """Logits (channels, h / 2, w / 2) of a picture (h, w, 3)."""
        self._net.setInput(np.ascontiguousarray(small.transpose(2, 0, 1)[None], np.float32) / 255)
        return np.asarray(self._net.forward()[0], np.float32)

    def _around(self, logits: Floats, pixel_T_cell: Array, width: int, height: int) -> Array | None:
        """The box around the robot, widened; None when there is none."""
        share = 1 - _softmax(logits[: len(self.card.palette)], 0)[0]
        y, x = np.nonzero(_largest(share > READING.robot) * (share > READING.robot))
        if len(x) == 0:
            return None
        ends = np.array([[x.min(), y.min()], [x.max(), y.max()]]) @ pixel_T_cell[:, :2].T + pixel_T_cell[:, 2]
        low, high = np.clip(ends, 0, [width, height])
        half = np.maximum(max((high - low).max() / READING.fill, STRIDE), high - low) / 2
        return np.concatenate([(low + high) / 2 - half, (low + high) / 2 + half])


def _resampled(channel: Floats, source_T_target: Array, shape: tuple[int, ...]) -> Floats:
    flags = cv2.INTER_LINEAR | cv2.WARP_INVERSE_MAP
    size = (shape[1], shape[0])
    return np.asarray(
        cv2.warpAffine(channel, source_T_target, size, flags=flags, borderMode=cv2.BORDER_REPLICATE),
        np.float32,
    )


def _softmax(logits: Floats, axis: int) -> Floats:
    raised = np.exp(logits - logits.max(axis, keepdims=True))
    return np.asarray(raised / raised.sum(axis, keepdims=True), np.float32)


def _largest(mask: NDArray[np.bool_]) -> NDArray[np.float32]:
    """1 on the largest piece of a mask and on pieces near its size, and where there is no piece; 0 on small pieces."""
    _, label, about, _ = cv2.connectedComponentsWithStats(mask.astype(np.uint8))
    area = about[:, cv2.CC_STAT_AREA].astype(float)
    keep = area >= READING.piece * area[1:].max(initial=0.0)
    keep[0] = True
    return np.asarray(keep[label], np.float32)


def _confidence(visible: Floats, trust: Array) -> float:
    """The median share of the cells (h, w) that are robot times the mean of the highest trusts.

    A thing that only has a robot's colours has an unsure mask or no keypoints.
    """
    robot = visible[visible > 0]
    if robot.size == 0:
        return 0.0
    return float(1 / (1 + np.exp(-np.median(robot))) * np.sort(trust)[-READING.best_keypoints :].mean())


def _tops(heat: Floats) -> tuple[Array, Array]:
    """Where each heatmap (K, h, w) of logits is highest, (K, 2) cells, and how much of it is there."""
    places, trust = np.empty((len(heat), 2)), np.empty(len(heat))
    for k, share in enumerate(_softmax(heat.reshape(len(heat), -1), 1).reshape(heat.shape)):
        y, x = np.unravel_index(share.argmax(), share.shape)
        top, left = max(0, int(y) - READING.heat_cells), max(0, int(x) - READING.heat_cells)
        near = share[top : y + READING.heat_cells + 1, left : x + READING.heat_cells + 1]
        trust[k] = near.sum()
        down, across = near.sum(1), near.sum(0)
        places[k] = (across @ (left + np.arange(len(across))), down @ (top + np.arange(len(down)))) / trust[k]
    return places, trust
