"""A cell being recorded: what is seen now, samples taken and taken back, what is still missing, the verdict so far."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path
from threading import RLock

import numpy as np
from numpy.typing import NDArray

from hecbench import se3
from hecbench.diagnose.calibrate import calibrate, enclosing_points
from hecbench.errors import InputError
from hecbench.next_view import RobotView
from hecbench.recording import Mounting, Recording
from hecbench.se3 import Array
from hecbench.verdict import Verdict
from hecbench_hardware.cockpit import coverage, suggestion
from hecbench_hardware.cockpit.coverage import Coverage
from hecbench_hardware.cockpit.outline import Outline
from hecbench_hardware.cockpit.pointing import Pointer
from hecbench_hardware.cockpit.seeing import Seen, look_for
from hecbench_hardware.cockpit.suggestion import Reach, Suggestion
from hecbench_hardware.devices import Camera, Robot, RobotState
from hecbench_hardware.motions import six_joints
from hecbench_hardware.recorder import poses
from hecbench_hardware.recorder.record import Recorder
from hecbench_hardware.recorder.session import SampleLine

FEWEST = 6
"""Samples from which on a verdict says something."""
_STILL_RAD_S = 1e-3
_SAME_RAD, _SAME_M = 1e-3, 5e-4
"""A robot that has moved less stands where it stood."""
_ANOTHER_RAD = np.deg2rad(8.0)
"""How far, rotation and shift taken together, the automatic wants to be from every sample."""


@dataclass(frozen=True, eq=False)
class Now:
    """One look at the cell.

    Attributes:
        image: (H, W, 3) of the camera.
        state: of the robot; None while its pose is not known.
        seen: the target; None where it is not seen, or the cell has none.
    """

    image: NDArray[np.uint8]
    state: RobotState | None
    seen: Seen | None

    @property
    def still(self) -> bool:
        """Whether the robot's pose is known and its joints do not turn."""
        return self.state is not None and float(np.abs(self.state.joint_speeds_rad_s).max()) < _STILL_RAD_S


@dataclass
class Session:
    """The samples of one cell, in a folder that a later session goes on with. Its methods may be called by any thread.

    Attributes:
        cell: what is known of camera, target, mounting and robot; a start of the camera when there is one.
        robot: perhaps not enabled.
        camera: gives the pictures.
        folder: of the recording.
        frames: averaged for one sample.
        driven: whether the arm may be driven from here.
        verdict: on the samples, as of `judged`.
    """

    cell: Recording
    robot: Robot
    camera: Camera
    folder: Path
    frames: int = 1
    driven: bool = False
    verdict: Verdict | None = field(default=None, init=False)
    _seen: dict[str, Seen | None] = field(default_factory=dict, init=False)
    _view: RobotView | None = field(default=None, init=False)
    _outline: Outline | None = field(default=None, init=False)
    _lock: RLock = field(default_factory=RLock, init=False)

    def __post_init__(self) -> None:
        if self.cell.camera is None:
            self.cell = replace(self.cell, camera=self.camera.intrinsics())
        self._recorder = Recorder(self.robot, self.camera, self.cell, self.folder, self.frames)
        self._rng = np.random.default_rng(0)
        for line in self._recorder.samples:
            self._seen[line.id] = self._target_in(line)

    def __len__(self) -> int:
        return len(self._recorder.samples)

    def look(self) -> Now:
        """A picture with the robot's state and the target in it.

        Raises:
            DeviceFault: A device does not answer.
        """
        with self._lock:
            image = self.camera.grab().image
            try:
                state: RobotState | None = self.robot.state()
            except InputError:  # nobody has typed a pose yet
                state = None
            return Now(image, state, look_for(self.cell, image))

    def take(self) -> str:
        """Record a sample; returns what was recorded, in words.

        Raises:
            InputError: The robot stands where a sample was taken already.
            DeviceFault: It moves, or a device failed.
        """
        with self._lock:
            if (same := self._at(self.robot.state().base_T_flange)) is not None:
                raise InputError(f"the robot stands where sample {same} was taken: move it first")
            number = int(self._recorder.samples[-1].id) + 1 if len(self) else 0
            line = self._recorder.take(f"{number:06d}")
            self._seen[line.id] = self._target_in(line)
            if self.cell.target is None:
                return f"sample {line.id} taken"
            return f"sample {line.id} taken, the target {'seen' if self._seen[line.id] else 'NOT seen'}"

    def undo(self) -> str:
        """Take the last sample back; returns which, in words.

        Raises:
            InputError: There is none.
        """
        with self._lock:
            line = self._recorder.undo()
            self._seen.pop(line.id, None)
            self.verdict = None
            return f"sample {line.id} taken back"

    def worth_taking(self, now: Now) -> bool:
        """Whether the automatic should take a sample: the robot is still, at another place, and the target is seen."""
        if not now.still or now.state is None or (self.cell.target is not None and now.seen is None):
            return False
        with self._lock:
            taken = self.flange_poses()
        if not len(taken):
            return True
        return bool(poses.apart(taken, now.state.base_T_flange).min() > _ANOTHER_RAD)

    def flange_poses(self) -> Array:
        """(N, 4, 4) m of the samples so far."""
        return np.array([line.base_T_flange for line in self._recorder.samples]).reshape(-1, 4, 4)

    def coverage(self) -> Coverage:
        """Of the samples so far."""
        with self._lock:
            return coverage.of(
                self.flange_poses(),
                list(self._seen.values()),
                self.cell.camera,
                self.cell.target is not None,
            )

    def recording(self) -> Recording:
        """The recording of the samples so far, written to the folder.

        Raises:
            InputError: There is none.
        """
        with self._lock:
            return self._recorder.finish([line.id for line in self._recorder.samples])

    def parent_T_camera(self) -> Array | None:
        """The best guess of the calibration: the verdict's, one from the poses so far, or the cell's start."""
        with self._lock:
            if self.verdict is not None and self.verdict.recommended is not None:
                return self.verdict.recommended.pose
            hands, targets = self._pairs()
        if self.cell.target is not None and len(hands) >= 3 and self.coverage().turned_enough:
            camera = self.cell.present.camera
            points = enclosing_points(self.cell.target.points_m)
            fit = calibrate(self.cell.mounting, hands, targets, points, float(camera.intrinsics[0, 0]))
            if fit is not None:
                return fit.state.parent_T_camera
        return self.cell.initial_parent_T_camera

    def outline(self, now: Now) -> Array | None:
        """Pixels (P, 2) of the robot's contour by the best guess; None in a cell with a target, or without a guess."""
        if self.cell.target is not None or now.state is None or not np.isfinite(now.state.joints_rad).all():
            return None
        with self._lock:
            guess = self.parent_T_camera()
            if guess is None or self.cell.present.camera.K is None:
                return None
            if self._outline is None:
                self._outline = Outline(self.cell)
            return self._outline.pixels(now.state.joints_rad, guess)

    def suggest(self) -> Suggestion | None:
        """Where to go next, at first the cell's first sample; None where nothing is known that would say."""
        if not len(self):
            planned = self.cell.joints_rad
            return None if planned is None else Suggestion(six_joints(planned[0]), None)
        guess, (hands, targets) = self.parent_T_camera(), self._pairs()
        camera, reach = self.cell.camera, self._reach()
        if camera is not None and camera.K is not None and guess is not None and len(hands):
            seen, here = (hands[0], targets[0]), self.robot.state().base_T_flange
            rough = guess is self.cell.initial_parent_T_camera
            return suggestion.of_target(
                self.cell, guess, seen, self.flange_poses(), here, reach, self._rng, rough
            )
        joints = [line.joints_rad for line in self._recorder.samples if line.joints_rad]
        if reach is None or not joints:
            return None
        if guess is None or self.cell.target is not None or self.cell.robot is None:
            return suggestion.unlike(np.array(joints), reach, self._rng)
        if self._view is None:
            self._view = RobotView(self.cell)
        return suggestion.of_robot(self._view, guess, np.array(joints), reach, self._rng)

    def words(self, wanted: Suggestion, now: Now | None) -> str:
        """A suggestion as an instruction from where the cell is now."""
        if wanted.camera_T_target is not None:
            seen = now.seen if now else None
            return suggestion.target_words(seen.camera_T_target if seen else None, wanted.camera_T_target)
        assert wanted.joints_rad is not None
        state = now.state if now and now.state else self.robot.state()
        return suggestion.joint_words(state.joints_rad, wanted.joints_rad)

    def pointer(self) -> Pointer | None:
        """Points with the recommended answer; None while there is none, or its camera's K is not known."""
        best = None if self.verdict is None else self.verdict.recommended
        camera = (best and best.camera) or self.cell.camera
        if best is None or camera is None or camera.K is None:
            return None
        return Pointer(best, camera, len(self))

    def base_T_parent(self, state: RobotState) -> Array:
        """(4, 4) m: the flange where the camera moves, else the base itself."""
        return state.base_T_flange if self.cell.mounting is Mounting.EYE_IN_HAND else np.eye(4)

    def _target_in(self, line: SampleLine) -> Seen | None:
        return look_for(self.cell, self.folder / str(line.image))

    def _reach(self) -> Reach | None:
        try:
            here = six_joints(self.robot.state().joints_rad)
            return Reach(self.robot.arm, self.robot.limits, here)
        except InputError:  # typed poses have no joints
            return None

    def _at(self, base_T_flange: Array) -> str | None:
        """The sample that was taken at this pose."""
        taken = self.flange_poses()
        same = (se3.rotation_error_rad(taken, base_T_flange) < _SAME_RAD) & (
            se3.translation_error_m(taken, base_T_flange) < _SAME_M
        )
        return self._recorder.samples[int(np.flatnonzero(same)[0])].id if same.any() else None

    def _pairs(self) -> tuple[Array, Array]:
        """Flange and target poses (N, 4, 4) of the samples that have both."""
        found = [
            (line.base_T_flange, seen.camera_T_target)
            for line in self._recorder.samples
            if (seen := self._seen.get(line.id)) is not None and seen.camera_T_target is not None
        ]
        hands, targets = zip(*found, strict=True) if found else ((), ())
        return np.array(hands).reshape(-1, 4, 4), np.array(targets).reshape(-1, 4, 4)
