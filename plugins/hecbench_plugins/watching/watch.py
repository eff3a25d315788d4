"""Whether a calibration is still true, from the robot's own contour in every frame.

Each frame gives the normal equations of the contour about the camera's known pose (`maskless.contour`), with a column
for every joint. The first frames give a reference: the camera's pose, the joints' constant offsets and the usual
misfit. Afterwards the frames of a short window are added up, the joints are eliminated within what the first frames
left open, and the camera's offset is standardised. The sum of its squares is a test for a jump with the shortest
delay (after Willsky and Jones 1976, "A generalized likelihood ratio approach to the detection and estimation of jumps
in linear systems"). A hidden robot confirms less of its contour: then nothing is concluded.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hecbench import se3
from hecbench.errors import InputError
from hecbench.estimate import Estimate
from hecbench.recording import Mounting, Recording
from hecbench.robots.posed import PosedRobot
from hecbench.se3 import Array
from hecbench.workspace import apart_m, points_in_parent
from hecbench_plugins.maskless.contour import ContourEquations, ContourMatcher
from hecbench_plugins.maskless.refinement import RefinementLevel, refine
from hecbench_plugins.views.canvas import Canvas, Rectification
from hecbench_plugins.views.pyramid import mesh_at, meshes_by_level
from hecbench_plugins.views.spool import Spool
from hecbench_plugins.watching.equations import Reference, concluded, offset
from hecbench_plugins.watching.settings import WatchSettings
from hecbench_plugins.watching.state import Verdict, WatchState

_SPACING_PX = 1.0
"""Between samples across the contour: at full size one pixel."""
_AROUND = tuple(RefinementLevel(level, 2.0, 6, False) for level in (8, 4, 2, 1))
"""Where the robot is looked for when it is not where it should be: some 100 px around, coarse to fine."""
_ELSEWHERE_MM = 2.0
"""From the reference: nearer, a contour that is not confirmed is hidden."""
_HIDDEN = (
    "too little of the robot's contour is seen: it is hidden, out of the picture, or its joints are not those"
)
_TRACKED = "+watch"


@dataclass(eq=False)
class Watch:
    """Tell it every frame: ``state = watch.update(image, joints_rad)``.

    Attributes:
        recording: names robot, camera and mounting; its samples do not matter.
        estimate: the calibration that is watched.
        settings: when it gives alarm.
        track: follow the camera after an alarm, with the pose found as the new reference.
    """

    recording: Recording
    estimate: Estimate
    settings: WatchSettings = field(default_factory=WatchSettings)
    track: bool = False

    def __post_init__(self) -> None:
        self._robot = PosedRobot.of(self.recording)
        camera = self.estimate.camera or self.recording.present.camera
        own = self.recording.camera
        if own is not None and (own.width, own.height) != (camera.width, camera.height):
            raise InputError(
                f"estimate of '{self.estimate.solver}': its camera has {camera.width}x{camera.height} px, the frames"
                f" have {own.width}x{own.height}: calibrate with pictures of this size"
            )
        if self.estimate.parent_link != self.recording.parent_link:
            raise InputError(
                f"estimate of '{self.estimate.solver}': is given in '{self.estimate.parent_link}', the robot's frame is"
                f" '{self.recording.parent_link}': is it of another robot or mounting?"
            )
        self._camera, self._lens = camera, Rectification.of(camera)
        self._meshes = meshes_by_level(self._robot.model)
        self._points_m = points_in_parent(
            self.recording.base_T_flange
            if self.recording.base_T_flange is not None
            else self._robot.base_T_flange,
            camera_moves=self.recording.mounting is Mounting.EYE_IN_HAND,
        )
        self._pose = se3.inverse(self.estimate.pose)
        self._offsets = _joint_offsets(self.estimate.extras, self._robot.joint_names)
        self._matcher: ContourMatcher | None = None
        self._frame = 0
        self._start_over()

    def _start_over(self) -> None:
        self._learned: list[ContourEquations] = []
        self._reference: Reference | None = None
        self._window: deque[ContourEquations] = deque(maxlen=self.settings.window_frames)
        self._in_a_row = 0

    def update(self, image: NDArray[np.uint8], joints_rad: Array) -> WatchState:
        """The next frame, (H, W, 3) RGB as the camera gave it, with the joints (J,) rad of the same moment.

        Raises:
            InputError: the frame is not of the camera's size, or the joints are not of the robot.
        """
        size = self._camera.height, self._camera.width
        if image.shape != (*size, 3):
            raise InputError(f"frame {self._frame}: shape {image.shape}, expected {(*size, 3)}, the camera's")
        joints = np.asarray(joints_rad, float)
        if joints.shape != (len(self._robot.joint_names),) or not np.isfinite(joints).all():
            raise InputError(
                f"frame {self._frame}: joints {joints.tolist()}, expected {len(self._robot.joint_names)} finite numbers"
            )
        shown = self._lens.image(image)
        matcher = self._showing(shown, joints)
        known = matcher.colours()
        twists = self._robot.twists(joints + self._offsets) @ se3.adjoint(self._pose).T
        found = matcher(self._pose, _SPACING_PX, twists=[twists])
        if self._reference is None:
            state = self._learn(found)
        elif self._is_seen(found, self._reference):
            state = self._test(found, self._reference)
        else:
            matcher.recall(known)
            state = self._look_around(shown, joints, found, self._reference)
        self._frame += 1
        return state

    def _canvas(self, shown: NDArray[np.uint8], joints: Array, parent_T_link: Array) -> Canvas:
        view = Spool.of(lambda _: shown, 1)
        return Canvas(
            self._lens.K, view, self._lens.valid, joints[None], parent_T_link[None], None, ("frame",)
        )

    def _showing(self, shown: NDArray[np.uint8], joints_rad: Array) -> ContourMatcher:
        """The matcher at full size, looking at this frame."""
        joints = joints_rad + self._offsets
        parent_T_link = self._robot.clipped_link_poses(joints)
        if self._matcher is None:
            canvas = self._canvas(shown, joints, parent_T_link)
            self._matcher = ContourMatcher(self._meshes[1], canvas, 1, None)
            self._matcher.learn(self._pose, _SPACING_PX)
        self._matcher.show(shown, parent_T_link)
        return self._matcher

    def _learn(self, found: ContourEquations) -> WatchState:
        if found.points >= self.settings.least_points:
            self._learned.append(found)
        if len(self._learned) < self.settings.learn_frames:
            reason = None if found.points >= self.settings.least_points else _HIDDEN
            verdict = Verdict.LEARNING if reason is None else Verdict.CANNOT_SEE
            return self._state(verdict, found, reason=reason)
        self._reference = reference = concluded(self._learned, self._pose, self._offsets, self.settings)
        self._pose, self._offsets = reference.camera_T_parent, reference.offsets_rad
        if self.estimate.solver.endswith(_TRACKED):
            self.estimate = self._tracked(reference.camera_T_parent, reference.covariance)
        off_mm = self._off_mm(reference.camera_T_parent)
        if off_mm > self.settings.limit_mm:
            reason = f"already in the first frames the workspace was {off_mm:.1f} mm from where the estimate has it"
            return self._moved(found, None, reference.camera_T_parent, reference.covariance, reason)
        return self._state(Verdict.TRUE, found, 0.0, off_mm, reference.camera_T_parent, reference.covariance)

    def _is_seen(self, found: ContourEquations, reference: Reference) -> bool:
        settings = self.settings
        enough = found.points >= settings.least_points
        return enough and found.confirmed_share >= settings.least_confirmed * reference.confirmed

    def _look_around(
        self, shown: NDArray[np.uint8], joints_rad: Array, found: ContourEquations, reference: Reference
    ) -> WatchState:
        """The robot is hidden, or the camera has moved far: is its contour elsewhere in the picture?"""
        joints, pose = joints_rad + self._offsets, reference.camera_T_parent
        canvas = self._canvas(shown, joints, self._robot.clipped_link_poses(joints))
        for level in _AROUND:
            matcher = ContourMatcher(mesh_at(self._meshes, level.level), canvas, level.level, None)
            there = refine(matcher, pose, level)
            pose = there.camera_T_parent
        self._window.clear()
        off_mm = self._off_mm(pose, reference.camera_T_parent)
        if not self._is_seen(there.last, reference) or off_mm < _ELSEWHERE_MM:
            self._in_a_row = 0
            return self._state(Verdict.CANNOT_SEE, found, reason=_HIDDEN)
        self._in_a_row += 1
        covariance = np.asarray(
            self.settings.correlated_points * np.linalg.inv(there.last.A + 1e-9 * np.eye(6)), float
        )
        if self._in_a_row < self.settings.alarm_frames:
            return self._state(
                Verdict.CANNOT_SEE, there.last, None, self._off_mm(pose), pose, covariance, _HIDDEN
            )
        return self._moved(there.last, None, pose, covariance, self._displaced(pose, reference))

    def _displaced(self, pose: Array, reference: Reference) -> str:
        return (
            f"the workspace is {self._off_mm(pose):.1f} mm from where the estimate has it and"
            f" {self._off_mm(pose, reference.camera_T_parent):.1f} mm from where the first frames had it:"
            " calibrate again"
        )

    def _test(self, found: ContourEquations, reference: Reference) -> WatchState:
        settings = self.settings
        self._window.append(found)
        moved, covariance = offset(self._window, reference, settings)
        still = np.r_[np.full(3, settings.still_turn_rad), np.full(3, settings.still_shift_m)] ** 2
        score = float(moved @ np.linalg.solve(covariance + reference.covariance + np.diag(still), moved)) / 6
        pose = se3.exp(moved) @ reference.camera_T_parent
        off_mm = self._off_mm(pose)
        full = len(self._window) == settings.window_frames
        sigma_mm = 1e3 * float(np.sqrt(np.trace(covariance[3:, 3:])))
        gone = full and off_mm > settings.limit_mm + sigma_mm
        self._in_a_row = self._in_a_row + 1 if gone or score > settings.alarm else 0
        if self._in_a_row >= settings.alarm_frames:
            return self._moved(found, score, pose, covariance, self._displaced(pose, reference))
        return self._state(Verdict.TRUE, found, score, off_mm, pose, covariance)

    def _moved(
        self, found: ContourEquations, score: float | None, pose: Array, covariance: Array, reason: str
    ) -> WatchState:
        state = self._state(Verdict.MOVED, found, score, self._off_mm(pose), pose, covariance, reason)
        if self.track:
            self._pose = pose
            self.estimate = self._tracked(pose, covariance)
            self._start_over()
        return state

    def _tracked(self, pose: Array, covariance: Array) -> Estimate:
        return replace(
            self.estimate,
            parent_T_camera=se3.inverse(pose),
            covariance=se3.inverse_covariance(pose, covariance),
            solver=f"{self.estimate.solver.removesuffix(_TRACKED)}{_TRACKED}",
        )

    def _off_mm(self, camera_T_parent: Array, other: Array | None = None) -> float:
        """Rms displacement of the workspace from another camera_T_parent, by default the estimate's."""
        against = self.estimate.pose if other is None else se3.inverse(other)
        return 1e3 * float(apart_m(se3.inverse(camera_T_parent), against, self._points_m))

    def _state(
        self,
        verdict: Verdict,
        found: ContourEquations,
        score: float | None = None,
        offset_mm: float | None = None,
        pose: Array | None = None,
        covariance: Array | None = None,
        reason: str | None = None,
    ) -> WatchState:
        here = self._pose if pose is None else pose
        carried = None if covariance is None else se3.inverse_covariance(here, covariance)
        return WatchState(
            verdict, self._frame, found.confirmed_share, score, offset_mm, se3.inverse(here), carried, reason
        )


def _joint_offsets(extras: Mapping[str, Any], names: tuple[str, ...]) -> Array:
    """The joints' offsets (J,) rad that an estimate was solved with; they belong to its pose."""
    found = [extras.get(name) for name in names]
    return np.array([one["value"] if isinstance(one, Mapping) and "value" in one else 0.0 for one in found])
