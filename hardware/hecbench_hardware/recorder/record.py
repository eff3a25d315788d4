"""Drive a plan, or follow the operator's hand, and write what was seen as a native recording."""

from __future__ import annotations

import hashlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from hecbench import se3
from hecbench.errors import InputError
from hecbench.recording import Recording, RobotDescription
from hecbench.se3 import Array
from hecbench.storage.recording_io import save
from hecbench_hardware.devices import Camera, DeviceFault, Fault, Robot, RobotState
from hecbench_hardware.kinematics import JOINT_NAMES
from hecbench_hardware.recorder.plan import planned_joints
from hecbench_hardware.recorder.session import SampleLine, Session

_STILL_RAD = 1e-4
_ATTEMPTS = 2
"""How often one pose is tried; a fault at the second time ends the run."""


@dataclass
class Recorder:
    """Records samples into a folder. A second run with the same plan goes on where the first one ended.

    Attributes:
        robot: Enabled, unless its poses are only guided by hand.
        camera: None for a recording without images.
        cell: Describes camera, target and mounting; its samples may be the plan.
        folder: Of the recording.
        frames: Averaged per sample; more of them lower the noise.
        acknowledge: Asked with the fault's line before the robot is made ready again.
        report: Told one line per sample.
    """

    robot: Robot
    camera: Camera | None
    cell: Recording
    folder: Path
    frames: int = 1
    acknowledge: Callable[[str], bool] = lambda line: False
    report: Callable[[str], object] = lambda line: None

    def __post_init__(self) -> None:
        """Open the folder."""
        if self.frames < 1:
            raise InputError(f"at least one frame per sample is needed, not {self.frames}")
        self._session = Session(self.folder, _digest(self.cell), self.robot.describe())

    def drive(self) -> Recording:
        """Visit every pose of the plan that is not recorded yet, then write the recording.

        Raises:
            InputError: A pose or path leaves the limits; what was recorded stays.
            DeviceFault: A device failed and the operator did not acknowledge; what was recorded stays.
        """
        joints = planned_joints(self.cell)
        for number, sample_id in enumerate(self.cell.sample_ids):
            if sample_id not in self._session.done:
                self._visit(sample_id, joints[number])
                self.report(f"{number + 1}/{len(joints)} sample {sample_id}")
        return self.finish(list(self.cell.sample_ids))

    def follow_hand(self, more: Callable[[int], bool]) -> Recording:
        """Record wherever the operator holds the arm still, as long as `more(number of samples)` says so."""
        with self.robot.freedrive():
            while more(len(self._session.samples)):
                try:
                    self.take(f"{len(self._session.samples):06d}")
                except DeviceFault as error:
                    if error.fault is not Fault.LATE:
                        raise
                    self.report(f"{error}; hold the arm still")
        return self.finish([line.id for line in self._session.samples])

    def _visit(self, sample_id: str, joints_rad: Array) -> None:
        for attempt in range(_ATTEMPTS):
            try:
                self.robot.move_joints(joints_rad)
                self.take(sample_id)
                return
            except DeviceFault as error:
                again = attempt + 1 < _ATTEMPTS and error.fault is not Fault.CAMERA
                if not (again and self.robot.recover(self.acknowledge)):
                    raise

    def take(self, sample_id: str) -> SampleLine:
        """One sample where the arm stands.

        Raises:
            DeviceFault: The arm moves, or a device failed; nothing was recorded.
        """
        before = self.robot.settle()
        if self.camera is None:
            return self._session.append(_line(sample_id, before))
        frames, states = [], []
        for _ in range(self.frames):
            frames.append(self.camera.grab())
            states.append(self.robot.state())
        joints = np.array([state.joints_rad for state in states])
        joint_change = float(np.abs(joints - before.joints_rad).max())
        if joint_change > _STILL_RAD:
            raise DeviceFault(
                Fault.LATE, self.robot.name, f"moved {joint_change:.5f} rad during the exposure"
            )
        images = [frame.image for frame in frames]
        average = _average(images, self.camera.name, self.cell)
        line = _line(sample_id, states[-1])
        line.joints_rad = _known(joints.mean(axis=0))
        line.joint_change_rad = joint_change
        line.robot_stamp_s = float(np.mean([state.host_stamp_s for state in states]))
        line.camera_stamp_s = float(np.mean([frame.host_stamp_s for frame in frames]))
        line.camera_clock_s = frames[-1].camera_stamp_s
        line.frames = [frame.source for frame in frames]
        line.image_change = float(np.abs(images[-1].astype(float) - images[0]).mean())
        line.image = self._session.save_image(sample_id, average)
        return self._session.append(line)

    @property
    def samples(self) -> Sequence[SampleLine]:
        """What is recorded so far."""
        return self._session.samples

    def undo(self) -> SampleLine:
        """Take the last sample back."""
        return self._session.drop_last()

    def finish(self, ids: list[str]) -> Recording:
        """Write the recording of these samples."""
        recorded = {line.id: line for line in self._session.samples}
        if not ids:
            raise InputError(f"{self.folder}: no sample was recorded; hold the arm still and try again")
        lines = [recorded[name] for name in ids]
        with_images = all(line.image for line in lines)
        with_joints = all(line.joints_rad for line in lines)
        recording = replace(
            self.cell,
            name=self.folder.resolve().name,
            sample_ids=tuple(ids),
            camera=self.cell.camera or (None if self.camera is None else self.camera.intrinsics()),
            robot=self._described() if with_joints else self.cell.robot,
            joints_rad=np.array([line.joints_rad for line in lines]) if with_joints else None,
            base_T_flange=np.array([line.base_T_flange for line in lines]),
            robot_stamp_s=np.array([line.robot_stamp_s for line in lines]),
            camera_stamp_s=np.array([line.camera_stamp_s for line in lines]) if with_images else None,
            images=tuple(self.folder / str(line.image) for line in lines) if with_images else None,
            masks=None,
            depths=None,
            camera_T_target=None,
            corners_px=None,
            truth_parent_T_camera=None,
            folder=self.folder,
        )
        save(recording, self.folder)
        return recording

    def _described(self) -> RobotDescription:
        description = self.cell.robot or RobotDescription(model=self.robot.arm.name)
        return replace(description, joint_names=description.joint_names or JOINT_NAMES)


def _line(sample_id: str, state: RobotState) -> SampleLine:
    return SampleLine(
        id=sample_id,
        joints_rad=_known(state.joints_rad),
        base_T_flange=state.base_T_flange.tolist(),
        nominal_base_T_flange=state.nominal_base_T_flange.tolist(),
        kinematics_gap_mm=1e3
        * float(se3.translation_error_m(state.base_T_flange, state.nominal_base_T_flange)),
        base_T_tcp=state.base_T_tcp.tolist(),
        robot_stamp_s=state.host_stamp_s,
        robot_clock_s=state.robot_stamp_s,
    )


def _known(joints_rad: Array) -> list[float] | None:
    return joints_rad.tolist() if np.isfinite(joints_rad).all() else None


def _average(images: list[NDArray[np.uint8]], camera: str, cell: Recording) -> NDArray[np.uint8]:
    sizes = {image.shape[1::-1] for image in images}
    if len(sizes) > 1:
        raise DeviceFault(Fault.CAMERA, camera, f"the frames have different sizes {sorted(sizes)}")
    if cell.camera and sizes != {(cell.camera.width, cell.camera.height)}:
        raise InputError(
            f"{camera} gives {sizes.pop()} px, the cell says {cell.camera.width}x{cell.camera.height}: correct one"
        )
    return np.asarray(np.rint(np.mean(images, axis=0)), np.uint8)


def _digest(cell: Recording) -> str:
    """What must be equal for a run to go on with another one's folder."""
    digest = hashlib.sha256(repr((cell.mounting, cell.sample_ids, cell.camera, cell.target)).encode())
    if cell.joints_rad is not None:
        digest.update(cell.joints_rad.tobytes())
    return digest.hexdigest()
