"""`depth_icp`: the rendered robot aligned with depth pictures, point to plane, all views in one camera.

Projective association after Blais and Levine 1995 and the point-to-plane error of Chen and Medioni 1992, as roboreg
uses them on a GPU (Huber et al. 2025, "Hydra: marker-free RGB-D hand-eye calibration"); derived anew: the drawn robot
gives point and plane of every pixel, so no neighbours are searched. Gauss-Newton with Tukey's weights, coarse to fine.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hecbench import se3
from hecbench.errors import Refusal, SolverFailure
from hecbench.estimate import Estimate, Termination
from hecbench.recording import Mounting, Recording
from hecbench.se3 import Array
from hecbench_plugins.depth.settings import DepthSettings, Stage
from hecbench_plugins.depth.starts import around, on_a_sphere
from hecbench_plugins.depth.views import FEWEST_VIEWS, Agreement, DepthViews
from hecbench_plugins.maskless.refinement import limited
from hecbench_plugins.second_order.descent import Trace
from hecbench_plugins.second_order.silhouette import distances_at, silhouette_step
from hecbench_plugins.views.pyramid import prepare

_CLIP_PX = 3.0
"""Of a mask's contour, from which on a crossing counts less."""


@dataclass(frozen=True, eq=False)
class _End:
    """Where a descent ended, with the noise of depth that it found."""

    camera_T_parent: Array
    noise_per_m: float
    agreement: Agreement = field(default_factory=lambda: Agreement(0.0, 1.0, 0))
    information: Array = field(default_factory=lambda: np.zeros((6, 6)))
    iterations: int = 0


@dataclass(frozen=True)
class DepthIcp:
    """The options of the method.

    Attributes:
        silhouette: use the recording's masks too, in the last steps.
        settings: the numbers.
    """

    silhouette: bool = False
    settings: DepthSettings = field(default_factory=DepthSettings)

    def __call__(self, recording: Recording, *, rng: np.random.Generator) -> Estimate:
        """Calibrate from the recording's start, or from all over a view sphere when there is none."""
        settings = self.settings
        views = DepthViews.of(recording, settings)
        views.robot.check_start(recording)
        fixed = recording.mounting is Mounting.EYE_TO_HAND and len(views) >= FEWEST_VIEWS
        moved = views.moved(settings.moved_level) if fixed else None
        ends: list[_End] = []
        for end in self._ends(views, self._starts(recording, views, rng)):
            ends.append(end)
            if self._is_right(end, views, moved):
                if self.silhouette:
                    end = self._with_masks(recording, views, end)
                return self._answer(views, end, len(ends))
        if not ends:
            raise Refusal(
                "no start: give initial_parent_T_camera, --init FILE, or three views of a fixed camera"
            )
        best = max((end.agreement for end in ends), key=lambda agreement: agreement.fit)
        raise SolverFailure(_why_not(best, len(ends), settings))

    def _starts(self, recording: Recording, views: DepthViews, rng: np.random.Generator) -> Iterator[Array]:
        start = recording.initial_parent_T_camera
        if start is not None:
            yield se3.inverse(start)
            yield from around(views, start, rng)
        elif recording.mounting is Mounting.EYE_TO_HAND:
            yield from on_a_sphere(views)

    def _ends(self, views: DepthViews, starts: Iterable[Array]) -> Iterator[_End]:
        """Descents that agree at a coarse size as they come, the others after them, the best first."""
        settings = self.settings
        rough, fine = settings.stages[: settings.rough], settings.stages[settings.rough :]
        later = []
        for start in starts:
            end = self._descended(views, _End(start, settings.noise_per_m), rough)
            if end.agreement.agreeing >= settings.least_agreeing:
                yield self._descended(views, end, fine)
            else:
                later.append(end)
        later.sort(key=lambda end: end.agreement.fit, reverse=True)
        for end in later[: settings.followed]:
            yield self._descended(views, end, fine)

    def _descended(self, views: DepthViews, start: _End, stages: Sequence[Stage]) -> _End:
        settings, pose, noise = self.settings, start.camera_T_parent, start.noise_per_m
        information, iterations = start.information, start.iterations
        for stage in stages:
            for _ in range(stage.iterations):
                iterations += 1
                information, gradient, count = views.normal_equations(pose, stage, noise)
                if count < settings.least_pixels / stage.level**2:
                    break
                move = _step(information, gradient)
                pose = se3.exp(move) @ pose
                if move @ information @ move < settings.settled**2:
                    break
            if stage.level == 2 and np.isfinite(found := views.noise(pose, 4 * stage.limit_m)):
                noise = float(np.clip(found, 0.1 * settings.noise_per_m, 4 * settings.noise_per_m))
        fit = views.agreement(pose, max(2, stages[-1].level), noise)
        return _End(pose, noise, fit, information, iterations)

    def _is_right(self, end: _End, views: DepthViews, moved: NDArray[np.float32] | None) -> bool:
        settings, fit = self.settings, end.agreement
        if fit.pixels < settings.least_pixels / 4:
            return False
        if fit.agreeing < settings.least_agreeing or fit.beyond > settings.most_beyond:
            return False
        if moved is None:
            return True
        return views.explained(end.camera_T_parent, moved, settings.moved_level) >= settings.least_explained

    def _with_masks(self, recording: Recording, views: DepthViews, end: _End) -> _End:
        """Further steps on depth and the masks' contours together."""
        if recording.masks is None:
            raise Refusal("silhouette=true needs masks: samples[].mask, or --segmenter")
        _, masked = prepare(recording)
        contour = silhouette_step(masked, 1, distances_at(masked, 1), _CLIP_PX, Trace())
        settings, last = self.settings, self.settings.stages[-1]
        pose, information, iterations = end.camera_T_parent, end.information, end.iterations
        for _ in range(2 * last.iterations):
            iterations += 1
            information, gradient, _ = views.normal_equations(pose, last, end.noise_per_m)
            _, contour_A, contour_b = contour(pose)
            information += contour_A / settings.mask_sigma_px**2
            move = _step(information, gradient + contour_b / settings.mask_sigma_px**2)
            pose = se3.exp(move) @ pose
            if move @ information @ move < settings.settled**2:
                break
        return replace(end, camera_T_parent=pose, information=information, iterations=iterations)

    def _answer(self, views: DepthViews, end: _End, followed: int) -> Estimate:
        covariance = np.linalg.inv(end.information + 1e-9 * np.eye(6))
        details: dict[str, Any] = {
            "stage": "depth",
            "agreeing": end.agreement.agreeing,
            "beyond": end.agreement.beyond,
            "starts": followed,
            "views": len(views),
        }
        if views.notes:
            details["left_out"] = list(views.notes)
        return Estimate(
            se3.inverse(end.camera_T_parent),
            covariance=se3.inverse_covariance(end.camera_T_parent, covariance),
            termination=Termination.CONVERGED,
            iterations=end.iterations,
            renders=views.renders,
            diagnostics=details,
        )


def _step(information: Array, gradient: Array) -> Array:
    """Gauss-Newton's, damped a little, of believable length."""
    damping = 1e-6 * np.diag(np.diag(information)) + 1e-9 * np.eye(6)
    return limited(np.linalg.solve(information + damping, gradient))


def _why_not(fit: Agreement, followed: int, settings: DepthSettings) -> str:
    if fit.pixels < settings.least_pixels / 4:
        return "the robot is not in the depth pictures where the start puts it: check the start, the units and the size"
    return (
        f"depth agrees with {100 * fit.agreeing:.0f} % of the drawn robot ({100 * settings.least_agreeing:.0f} % are"
        f" needed) and passes through {100 * fit.beyond:.0f} % of it at the best of {followed} ends: the camera is"
        " farther off than the start says, depth is in other units or not aligned with the camera of K, or the robot or"
        " its joints are not those of the pictures"
    )
