"""DRHeC: colours, and while the robot's centroid is off, its centroid and area, by Adam on the pose.

Of the drawn picture I and the translated one I_ref, G being the robot's mask:

    c = sum_p softmax_p(G) x_p        L_cen  = |c(I) - c(I_ref)|       px
    a = sum_p sigmoid(G[p])           L_area = |a(I) - a(I_ref)|
                                      L_rgb  = mean over pixels and channels of (I - I_ref)^2
    coarse (L_cen > threshold): L = L_rgb + lambda_cen L_cen + lambda_area L_area, the rotation is not changed
    fine   (otherwise):         L = L_rgb

Adam, rate 2e-3, 2000 steps. The variants `literal` and `resolved` differ where the publication leaves a choice or
where Adam does not do what it says; see docs/first-order.md.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

import numpy as np
import torch
from torch import Tensor

from hecbench import registry, se3
from hecbench.errors import Refusal
from hecbench.estimate import Estimate
from hecbench.recording import Recording
from hecbench.se3 import Array
from hecbench.specs import Kind, Translator, TranslatorSpec
from hecbench_plugins.first_order.backend import Backend, drawer
from hecbench_plugins.first_order.descent import AdamSettings, DescentHistory, Verdict, descend, to_estimate
from hecbench_plugins.first_order.drawing import Drawer
from hecbench_plugins.first_order.losses import SquaredError, geometry, geometry_of
from hecbench_plugins.first_order.masks import mask_of
from hecbench_plugins.first_order.poses import EulerAngles, Increment, PoseNumbers
from hecbench_plugins.first_order.simlike import cut_out, why_not_simulated
from hecbench_plugins.views.pyramid import Picture, View, prepare

_COVERAGE = 3
"""The channel of a drawn picture that holds the robot's mask."""


class Losses(StrEnum):
    """Which losses take part: colours alone, with the centroid, with centroid and area."""

    RGB = "rgb"
    RGBC = "rgbc"
    FULL = "full"


class Variant(StrEnum):
    """Algorithm 1 as printed, or with its ambiguities resolved."""

    LITERAL = "literal"
    RESOLVED = "resolved"


@dataclass(frozen=True)
class DRHeC:
    """The options of the method.

    Attributes:
        losses: which take part.
        variant: `literal` has absolute Euler angles, one Adam with the rotation's slope set to zero in the coarse
            stage, and answers with the last iterate. `resolved` has an increment of the start, leaves the rotation's
            step out and starts its moments anew, keeps fine until twice the threshold, scales centroid and area to
            pictures of 640 px, and answers with the best iterate of the fine stage.
        lambda_cen, lambda_area: weights of the centroid's and the area's loss.
        threshold: px of L_cen. 0: the coarse stage never ends (literal); all losses and numbers always take part
            (resolved).
        iterations: of Adam.
        translator: name of the plugin that makes the recording's pictures look simulated.
        backend: which renderer draws.
        rate: of Adam, advanced.
        leave_fine: times the threshold; beyond it a resolved run goes back to the coarse stage. Advanced.
        reference_width_px: the width for which the weights were published, advanced.
        translate_every: iterations after which a translator that follows the pose is asked again, advanced.
    """

    losses: Losses = Losses.FULL
    variant: Variant = Variant.RESOLVED
    lambda_cen: float = 0.01
    lambda_area: float = 1e-4
    threshold: float = 0.25
    iterations: int = 2000
    translator: str = "identity"
    backend: Backend = "cpu"
    rate: float = 2e-3
    leave_fine: float = 2.0
    reference_width_px: int = 640
    translate_every: int = 100

    def __call__(self, recording: Recording, *, rng: np.random.Generator) -> Estimate:
        """Calibrate from the recording's start."""
        if recording.initial_parent_T_camera is None:
            raise Refusal("drhec needs a start: initial_parent_T_camera, or --init FILE")
        robot, views = prepare(recording)
        robot.check_start(recording)
        if not all(view.has_image for view in views):
            raise Refusal("drhec compares colours: every sample with joints needs an image")
        translator = registry.load().get(Kind.TRANSLATOR, self.translator, TranslatorSpec)
        start = se3.inverse(recording.initial_parent_T_camera)
        literal = self.variant is Variant.LITERAL
        numbers: PoseNumbers = EulerAngles(start) if literal else Increment(start)
        mesh = views[0].levels[1].renderer.mesh
        colours = np.zeros((len(mesh.colours) + 1, 4), np.float32)
        colours[:-1] = np.c_[mesh.colours, np.ones(len(mesh.colours))]
        drawers = [drawer(self.backend, (mesh,), colours, view) for view in views]
        objective = _Objective(self, translator, views, drawers)
        settings = AdamSettings(self.iterations, self.rate, freeze_by_zero=literal)
        run = descend(drawers, numbers, objective, settings)
        pose = run.last if literal or run.best is None else run.best
        return to_estimate(run, views, drawers, pose, self._details(run, views, pose, objective))

    def _details(
        self, run: DescentHistory, views: Sequence[View], pose: Array, objective: _Objective
    ) -> dict[str, Any]:
        details: dict[str, Any] = {
            "variant": str(self.variant),
            "translator": self.translator,
            "centroid_px": objective.centroid_px,
        }
        if self.translator == "identity" and (why := why_not_simulated(views, pose)):
            details["not_as_published"] = f"{why}, and no translator made the pictures look simulated"
        return details


class _Objective:
    """Losses and stages; `centroid_px` is the unscaled L_cen of the last pictures."""

    def __init__(
        self, method: DRHeC, translator: TranslatorSpec, views: Sequence[View], drawers: Sequence[Drawer]
    ) -> None:
        self.centroid_px: float | None = None
        self._method, self._views, self._drawers = method, views, drawers
        self._translate, self._follows = translator.factory(), translator.follows_pose
        self._aims = [geometry_of(mask_of(view)) for view in views]
        self._colour: list[SquaredError] = []
        self._calls, self._fine = 0, False
        width = drawers[0].width
        self._per_value = 1 / (3 * width * drawers[0].height)
        self._scale = method.reference_width_px / width if method.variant is Variant.RESOLVED else 1.0

    def __call__(self, pictures: Sequence[Tensor], camera_T_parent: Array) -> Verdict:
        if self._calls == 0 or (self._follows and self._calls % self._method.translate_every == 0):
            self._colour = [
                SquaredError(_translated(self._translate, view, camera_T_parent), at)
                for view, at in zip(self._views, self._drawers, strict=True)
            ]
        turn = self._calls // self._method.translate_every if self._follows else 0
        self._calls += 1
        rgb = self._per_value * _mean(
            [colour(picture) for colour, picture in zip(self._colour, pictures, strict=True)]
        )
        if self._method.losses is Losses.RGB:
            return Verdict(rgb, "rgb", rank=float(rgb.detach()), round=turn)
        off = [
            geometry(picture, _COVERAGE, at) - aim
            for picture, at, aim in zip(pictures, self._drawers, self._aims, strict=True)
        ]
        centroid = _mean([torch.linalg.vector_norm(one[:2]) for one in off])
        self.centroid_px = float(centroid.detach())
        stage, turns = self._stage(self._scale * self.centroid_px)
        if stage == "fine":
            return Verdict(rgb, stage, turns, float(rgb.detach()), turn)
        loss = rgb + self._method.lambda_cen * self._scale * centroid
        if self._method.losses is Losses.FULL:
            area = _mean([one[2].abs() for one in off])
            loss = loss + self._method.lambda_area * self._scale**2 * area
        return Verdict(loss, stage, turns, float(loss.detach()) if stage == "one stage" else None, turn)

    def _stage(self, centroid: float) -> tuple[str, bool]:
        """The stage and whether the rotation takes part in it."""
        limit = self._method.threshold
        if self._method.variant is Variant.LITERAL:
            self._fine = centroid <= limit
        elif limit == 0:
            return "one stage", True
        else:
            self._fine = centroid <= (self._method.leave_fine * limit if self._fine else limit)
        return ("fine", True) if self._fine else ("coarse", False)


def _mean(values: Sequence[Tensor]) -> Tensor:
    return sum(values[1:], start=values[0]) / len(values)


def _translated(translate: Translator, view: View, camera_T_parent: Array) -> Picture:
    """The reference (3, H, W) of a view."""
    image, mask = cut_out(view)
    renderer = view.levels[1].renderer
    renderer.draw(camera_T_parent @ view.parent_T_link)
    translated = translate(image, mask, part=renderer.part, colours=renderer.mesh.colours)
    return np.moveaxis(translated, -1, 0)
