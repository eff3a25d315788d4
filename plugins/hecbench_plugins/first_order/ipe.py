"""Image-based pose estimation with the renderer: mask, distance and appearance losses by Adam.

Lu, Liu, Girerd and Yip 2023, "Image-based pose estimation and shape reconstruction for robot manipulators and soft,
continuum robots via differentiable rendering", ICRA. With S the drawn and R the given mask, and D the distance of a
pixel to R:

    L = w1 sum (S - R)^2 + w2 sum S D / gamma + w3 |sum S - sum R|

Weights, rate and steps are not published. Here w1 = 1 and the others make the three derivatives by the pose equally
long at the start, w3 within [1e-3, 1]; rate and steps are those of the comparison that DRHeC's authors made.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
from torch import Tensor

from hecbench import se3
from hecbench.errors import Refusal
from hecbench.estimate import Estimate
from hecbench.recording import Recording
from hecbench.se3 import Array
from hecbench_plugins.first_order.backend import Backend
from hecbench_plugins.first_order.descent import AdamSettings, Verdict, descend, to_estimate
from hecbench_plugins.first_order.drawing import Drawer
from hecbench_plugins.first_order.losses import SquaredError
from hecbench_plugins.first_order.masks import mask_drawers, mask_of
from hecbench_plugins.first_order.poses import Increment, PoseNumbers
from hecbench_plugins.views.pyramid import Picture, prepare


@dataclass(frozen=True)
class IPE:
    """The options of the method.

    Attributes:
        gamma: px that the distances are divided by; None: half the picture's diagonal.
        iterations: of Adam.
        backend: which renderer draws.
        rate: of Adam, advanced.
        appearance_weights: the range of w3, advanced.
    """

    gamma: float | None = None
    iterations: int = 2000
    backend: Backend = "cpu"
    rate: float = 2e-3
    appearance_weights: tuple[float, float] = (1e-3, 1.0)

    def __call__(self, recording: Recording, *, rng: np.random.Generator) -> Estimate:
        """Calibrate from the recording's start."""
        if recording.initial_parent_T_camera is None:
            raise Refusal("ipe needs a start: initial_parent_T_camera, or --init FILE")
        robot, views = prepare(recording)
        robot.check_start(recording)
        drawers = mask_drawers(robot.model, views, "zbuffered", self.backend)
        numbers = Increment(se3.inverse(recording.initial_parent_T_camera))
        losses = _Losses([mask_of(view) for view in views], drawers, numbers, self)
        run = descend(drawers, numbers, losses, AdamSettings(self.iterations, self.rate))
        weights = None if losses.weights is None else losses.weights.tolist()
        return to_estimate(run, views, drawers, run.last, {"weights": weights})


class _Losses:
    """The objective; the distance maps are computed once, the weights from the first pictures."""

    def __init__(
        self,
        masks: Sequence[Picture],
        drawers: Sequence[Drawer],
        numbers: PoseNumbers,
        method: IPE,
    ) -> None:
        self.weights: Array | None = None
        self._drawers, self._numbers = drawers, numbers
        self._appearance_weights = method.appearance_weights
        self._errors = [SquaredError(mask[None], at) for mask, at in zip(masks, drawers, strict=True)]
        self._pixels = [float(mask.sum(dtype=float)) for mask in masks]
        self._distances = [_distance(mask, method.gamma) for mask in masks]

    def __call__(self, pictures: Sequence[Tensor], camera_T_parent: Array) -> Verdict:
        views = zip(pictures, self._errors, self._pixels, self._drawers, self._distances, strict=True)
        per_view = [self._of_view(*view) for view in views]
        losses = [sum(column[1:], start=column[0]) / len(per_view) for column in zip(*per_view, strict=True)]
        if self.weights is None:
            self.weights = self._balanced(losses, pictures)
        first, second, third = self.weights.tolist()
        return Verdict(first * losses[0] + second * losses[1] + third * losses[2], "masks")

    def _of_view(
        self, picture: Tensor, error: SquaredError, pixels: float, drawer: Drawer, distance: Tensor
    ) -> tuple[Tensor, Tensor, Tensor]:
        """Mask, distance and appearance."""
        far = distance[drawer.box.slices] if drawer.box else distance[:0, :0]
        return error(picture), (picture[0] * far).sum(), (picture.sum() - pixels).abs()

    def _balanced(self, losses: Sequence[Tensor], pictures: Sequence[Tensor]) -> Array:
        mask, distance, appearance = (self._steepness(loss, pictures) for loss in losses)
        typical = float(np.mean([float(one[one > 0].mean()) for one in self._distances]))
        low, high = self._appearance_weights
        return np.array(
            [
                1.0,
                mask / distance if mask > 0 and distance > 0 else 1 / typical,
                float(np.clip(mask / appearance, low, high)) if appearance > 0 else low,
            ]
        )

    def _steepness(self, loss: Tensor, pictures: Sequence[Tensor]) -> float:
        """Length of a loss's derivative by the numbers of the start."""
        slopes = torch.autograd.grad(loss, list(pictures), retain_graph=True)
        left = sum(
            drawer.pull(slope.contiguous().numpy())
            for drawer, slope in zip(self._drawers, slopes, strict=True)
        )
        translation, rotation = self._numbers.start
        by_numbers = self._numbers.pull(translation, rotation, np.asarray(left))
        return float(np.linalg.norm(np.concatenate(by_numbers)))


def _distance(mask: Picture, gamma: float | None) -> Tensor:
    """Distance (H, W) of every pixel to the mask, over gamma."""
    import cv2

    outside = (mask <= 0.5).astype(np.uint8)
    unit = gamma if gamma is not None else float(np.hypot(*outside.shape)) / 2
    return torch.from_numpy(
        cv2.distanceTransform(outside, cv2.DIST_L2, cv2.DIST_MASK_PRECISE) / np.float32(unit)
    )
