"""One trial as explicit states: locate, approach, act, retreat; every way it can end becomes a record."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from enum import StrEnum

import numpy as np

from hecbench import se3
from hecbench.errors import InputError
from hecbench.se3 import Array
from hecbench.storage.trial_record import Outcome, TrialRecord
from hecbench_hardware.devices import DeviceFault, Fault
from hecbench_hardware.kinematics import Arm
from hecbench_hardware.trials import solids, tasks
from hecbench_hardware.trials.cell import Calibration, NotSeen, Stroke, TrialCell, believed_workpiece
from hecbench_hardware.trials.tasks import Task

_COLLISIONS = {Fault.PROTECTIVE_STOP, Fault.FORCE}
_ARRIVED_M = 1e-3
_LOOKS, _LOOK_S = 20, 0.01
_MOTIONS = {"approach", "act", "retreat"}


class State(StrEnum):
    """Where a trial is."""

    LOCATE = "locate"
    APPROACH = "approach"
    ACT = "act"
    RETREAT = "retreat"
    DONE = "done"


class OutOfReach(InputError):
    """The arm cannot go where the calibration says that the workpiece is."""


@dataclass
class Trial:
    """One try of one task with one calibration.

    Attributes:
        cell: Where.
        task: What.
        calibration: With which.
        place: Of the workpiece.
        clearance_m: Of the hole.
        seed: For the record.
        acknowledge: Asked with the fault's line before the arm is made ready again.
    """

    cell: TrialCell
    task: Task
    calibration: Calibration
    place: int
    clearance_m: float
    seed: int = 0
    acknowledge: Callable[[str], bool] = lambda line: False
    state: State = State.LOCATE
    seconds: dict[str, float] = field(default_factory=dict)

    def run(self, attempt: int = 1) -> tuple[TrialRecord, DeviceFault | None]:
        """Carry it out.

        Returns:
            The record, and the fault after which the arm was not made ready again.
        """
        record = TrialRecord(
            task=self.task,
            robot=self.cell.name,
            method=self.calibration.method,
            calibration=self.calibration.name,
            place=self.place,
            clearance_mm=1e3 * self.clearance_m,
            seed=self.seed,
            outcome=Outcome.ABORTED,
            reason="",
            state=State.LOCATE,
            attempt=attempt,
            calibration_errors=self.calibration.errors,
        )
        fault = None
        try:
            self._carry_out(record)
        except NotSeen as error:
            record.reason = str(error)
        except OutOfReach as error:
            record.outcome, record.reason = Outcome.FAILURE, str(error)
        except DeviceFault as error:
            collided = error.fault in _COLLISIONS and self.state in _MOTIONS
            record.outcome = Outcome.FAILURE if collided else Outcome.ABORTED
            record.reason = str(error)
            fault = self._made_ready(error)
        record.state, record.seconds = self.state, self.seconds
        return record, fault

    def _carry_out(self, record: TrialRecord) -> None:
        cell, robot = self.cell, self.cell.robot
        with self._in(State.LOCATE):
            cell.prepare(self.calibration, self.place)
            self._go(lambda: robot.move_joints(cell.home_rad))
            camera_T_tag = cell.locate()
            workpiece = believed_workpiece(self.calibration, camera_T_tag)
            end = workpiece @ tasks.workpiece_T_tool(self.task)
            self._compare_with_truth(record, end, camera_T_tag)
        with self._in(State.APPROACH):
            joints, end = reach(robot.arm, cell.home_rad, cell.shape, self.task, end)
            start = tasks.above(end, tasks.stroke_m(self.task))
            if self.task is Task.GRASP:
                cell.gripper.open_fingers()
            self._go(lambda: robot.move_joints(joints))
        with self._in(State.ACT):
            before = self._arrived(self._flange(start))
            self._go(lambda: robot.move_linear(self._flange(end)))
            reached = self._arrived(self._flange(end))
            if self.task is Task.GRASP:
                cell.gripper.close_fingers()
            closed = cell.gripper.status()
        with self._in(State.RETREAT):
            self._go(lambda: robot.move_linear(self._flange(start)))
            path = np.array([before, reached]) @ cell.shape.flange_T_tool
            stroke = Stroke(path, closed, cell.gripper.status())
        self.state = State.DONE
        verdict = cell.judge(self.task, stroke, self.clearance_m)
        record.outcome = Outcome.SUCCESS if verdict.success else Outcome.FAILURE
        record.reason = verdict.reason
        record.margin_mm = None if np.isnan(verdict.margin_mm) else verdict.margin_mm
        if (truth := cell.truth()) is not None:
            formula = tasks.closed_form(
                self.task, se3.inverse(truth[0]) @ path[-1], cell.shape, self.clearance_m
            )
            record.closed_form_success = formula.success

    @contextmanager
    def _in(self, state: State) -> Iterator[None]:
        self.state, begun = state, time.perf_counter()
        try:
            yield
        finally:
            self.seconds[state] = time.perf_counter() - begun

    def _go(self, motion: Callable[[], None]) -> None:
        """A refusal of the limits is the calibration's fault: it points to where the arm may not go."""
        try:
            motion()
        except InputError as error:
            raise OutOfReach(str(error)) from None

    def _arrived(self, base_T_flange: Array) -> Array:
        """The flange pose (4, 4) at rest, once it is the commanded one; a state may be older than the motion."""
        for attempt in range(_LOOKS):
            try:
                here = self.cell.robot.settle().base_T_flange
            except DeviceFault as error:
                if error.fault is not Fault.OFF_TARGET or attempt + 1 == _LOOKS:
                    raise
                continue
            gap_m = float(se3.translation_error_m(here, base_T_flange))
            if gap_m < _ARRIVED_M:
                return here
            time.sleep(_LOOK_S)
        raise DeviceFault(Fault.OFF_TARGET, self.cell.robot.name, f"the flange is {1e3 * gap_m:.1f} mm off")

    def _flange(self, base_T_tool: Array) -> Array:
        return np.asarray(base_T_tool @ se3.inverse(self.cell.shape.flange_T_tool))

    def _compare_with_truth(self, record: TrialRecord, end: Array, camera_T_tag: Array) -> None:
        if (truth := self.cell.truth()) is not None:
            true_end = truth[0] @ tasks.workpiece_T_tool(self.task)
            record.object_error_mm = 1e3 * float(se3.translation_error_m(end, true_end))
            record.tag_error_mm = 1e3 * float(se3.translation_error_m(camera_T_tag, truth[1]))

    def _made_ready(self, fault: DeviceFault) -> DeviceFault | None:
        """None when the arm is ready again and drawn back; else the fault that remains."""
        if fault.fault in (Fault.CAMERA, Fault.GRIPPER):
            return fault
        try:
            if not self.cell.robot.recover(self.acknowledge):
                return fault
            if self.state in (State.ACT, State.RETREAT):
                here = self.cell.robot.state().base_T_flange
                self.cell.robot.move_linear(tasks.above(here, tasks.stroke_m(self.task)))
        except (DeviceFault, InputError) as error:
            return error if isinstance(error, DeviceFault) else fault
        return None


def reach(arm: Arm, home_rad: Array, shape: solids.Gripper, task: Task, end: Array) -> tuple[Array, Array]:
    """Joints (6,) rad at the start of the stroke to `end`, and the end pose turned the way that is nearest to home.

    Raises:
        OutOfReach: The arm cannot go there.
    """
    found = []
    for turned in (end, end @ tasks.HALF_TURN):
        start = tasks.above(turned, tasks.stroke_m(task)) @ se3.inverse(shape.flange_T_tool)
        for joints in arm.inverse(start, home_rad)[:1]:
            found.append((float(np.abs(joints - home_rad).max()), joints, turned))
    if not found:
        x, y, z = end[:3, 3]
        raise OutOfReach(
            f"the {task} at {x:.3f}, {y:.3f}, {z:.3f} m of the base is out of reach:"
            " check the calibration, or put the workpiece nearer"
        )
    _, joints, turned = min(found, key=lambda item: item[0])
    return joints, turned
