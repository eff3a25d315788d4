"""The contact sweep and the formula agree, and both follow the laws of the tasks."""

import numpy as np
import pytest
from hecbench_hardware.trials import solids, tasks
from hecbench_hardware.trials.tasks import Task

from hecbench import se3

pytest.importorskip("mujoco", reason="the contact sweep needs mujoco: pip install 'hecbench[lab]'")
from hecbench_hardware.trials import sweep

GRIPPER = solids.GRIPPERS["robotiq_2f_85"]
BAND_MM = {Task.GRASP: 1.5, Task.INSERTION: 0.15}
"""Where the two may differ: corners rounded by the formula, the flat pieces of the hole's wall."""
SPREAD = {Task.GRASP: (0.02, [0, 0, 0.05]), Task.INSERTION: (0.0012, [0.012] * 3)}


def path(task, error):
    """The stroke, with `error` (4, 4) in the workpiece's frame at the end point."""
    end = tasks.workpiece_T_tool(task)
    end[:3, :3], end[:3, 3] = error[:3, :3] @ end[:3, :3], error[:3, 3] + end[:3, 3]
    return np.array([tasks.above(end, tasks.stroke_m(task)), end])


@pytest.mark.parametrize("gripper", solids.GRIPPERS.values(), ids=lambda gripper: gripper.name)
@pytest.mark.parametrize("task", Task)
def test_exact_calibration_succeeds_with_the_whole_margin(task, gripper):
    found = sweep.judge(task, path(task, np.eye(4)), gripper)
    formula = tasks.closed_form(task, tasks.workpiece_T_tool(task), gripper)
    assert found.success
    assert found.margin_mm == pytest.approx(formula.margin_mm, abs=0.01)


@pytest.mark.parametrize("task", Task)
def test_sweep_agrees_with_the_formula(task, rng):
    shift, turn = SPREAD[task]
    outcomes = []
    for _ in range(60):
        error = se3.from_rotvec(rng.normal(0, turn), rng.normal(0, shift, 3))
        whole = path(task, error)
        found, formula = sweep.judge(task, whole, GRIPPER), tasks.closed_form(task, whole[-1], GRIPPER)
        if abs(formula.margin_mm) > BAND_MM[task]:
            assert found.success == formula.success, (found, formula)
        outcomes.append(found.success)
    assert 10 < sum(outcomes) < 50


@pytest.mark.parametrize("clearance_mm", [0.5, 1.0, 2.0, 5.0])
def test_peg_enters_within_the_clearance_and_not_beyond(clearance_mm):
    for share, success in ((0.9, True), (1.1, False)):
        error = se3.make(np.eye(3), [0.0, share * clearance_mm / 1e3, 0.0])
        found = sweep.judge(Task.INSERTION, path(Task.INSERTION, error), GRIPPER, clearance_mm / 1e3)
        assert found.success == success
        assert found.margin_mm == pytest.approx(clearance_mm * (1 - share), abs=0.03)


@pytest.mark.parametrize(
    ("task", "shift_mm", "reason"),
    [
        (Task.GRASP, [30, 0, 0], "finger touches block"),
        (Task.GRASP, [0, 24, 0], "overlap across"),
        (Task.GRASP, [0, 0, 32], "overlap along"),
        (Task.GRASP, [0, 0, -22], "palm touches block"),
        (Task.GRASP, [95, 0, 40], "between the fingers"),
        (Task.INSERTION, [3, 0, 0], "peg touches hole wall"),
        (Task.INSERTION, [0, 0, 25], "depth of the peg"),
        (Task.INSERTION, [0, 0, -11], "peg touches hole bottom"),
    ],
)
def test_failure_names_what_was_in_the_way(task, shift_mm, reason):
    found = sweep.judge(task, path(task, se3.make(np.eye(3), np.array(shift_mm) / 1e3)), GRIPPER)
    assert not found.success
    assert found.margin_mm < 0
    assert reason in found.reason


def test_contact_on_the_way_fails_although_the_end_is_free():
    whole = path(Task.GRASP, np.eye(4))
    detour = se3.make(np.eye(3), [0.0, 0.15, 0.0]) @ whole[-1]
    assert not sweep.judge(Task.GRASP, np.array([whole[0], detour, whole[-1]]), GRIPPER).success


def test_dynamics_lift_the_block_and_lose_it_where_geometry_is_clear():
    from hecbench_hardware.trials import physics

    for shift_mm, lifted in (([0, 0, 0], True), ([10, 5, 0], True), ([0, 50, 0], False), ([0, 0, 60], False)):
        whole = path(Task.GRASP, se3.make(np.eye(3), np.array(shift_mm) / 1e3))
        assert (
            physics.lift(whole, GRIPPER).success == lifted == sweep.judge(Task.GRASP, whole, GRIPPER).success
        )


def test_turned_gripper_is_no_grasp():
    error = se3.from_rotvec([0, 0, np.deg2rad(25)], np.zeros(3))
    assert "turn from the faces" in sweep.judge(Task.GRASP, path(Task.GRASP, error), GRIPPER).reason
