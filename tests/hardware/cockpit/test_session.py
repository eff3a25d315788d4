"""A cell recorded by suggestions: what is covered, taken back, judged and pointed at."""

from dataclasses import replace

import numpy as np
import pytest
from hecbench_hardware.cockpit import judging
from hecbench_hardware.cockpit.pointing import Pointer
from hecbench_hardware.cockpit.session import Session
from hecbench_hardware.recorder import poses
from hecbench_hardware.robots.typed import TypedRobot

from hecbench import se3
from hecbench.errors import InputError
from hecbench.estimate import Estimate


def test_six_suggested_samples_give_a_verdict_near_the_truth(recorded):
    recorded.recording()
    verdict = judging.judge(recorded.folder, 5.0)
    assert verdict.grade in ("good", "usable")
    off_m = np.linalg.norm((verdict.recommended.pose - recorded.camera.base_T_camera)[:3, 3])
    assert 1e3 * off_m < 3 * verdict.expected.high + 1


def test_suggestions_differ_and_turn_the_hand_about_two_axes(recorded):
    taken = recorded.flange_poses()
    for number in range(1, len(taken)):
        assert poses.apart(taken[:number], taken[number]).min() > 0.1
    covered = recorded.coverage()
    assert covered.turned_enough
    assert covered.with_target >= 4
    assert covered.parts.sum() >= 2
    assert covered.distances_m[0] < covered.distances_m[1]
    assert covered.lines()[0] == f"{len(taken)} samples, the target seen in {covered.with_target}"


def test_a_guess_comes_from_the_poses_before_any_verdict(recorded):
    assert recorded.verdict is None
    guess = recorded.parent_T_camera()
    assert se3.translation_error_m(guess, recorded.camera.base_T_camera) < 0.05


def test_a_second_session_goes_on_and_takes_the_last_sample_back(recorded, open_session, tmp_path):
    import shutil

    shutil.copytree(recorded.folder, tmp_path / "again")
    again = open_session(tmp_path / "again")
    assert len(again) == len(recorded)
    assert again.coverage().with_target == recorded.coverage().with_target
    last = sorted((tmp_path / "again/images").iterdir())[-1]
    assert "taken back" in again.undo()
    assert not last.exists()
    assert len(open_session(tmp_path / "again")) == len(recorded) - 1


def test_the_same_place_is_not_recorded_twice(recorded):
    with pytest.raises(InputError, match="stands where sample 00000"):
        recorded.take()


def test_the_automatic_waits_for_another_place_and_the_target(recorded):
    now = recorded.look()
    assert not recorded.worth_taking(now)
    away = replace(
        now.state, base_T_flange=se3.from_rotvec([0.5, 0, 0], [0.1, 0.1, 0]) @ now.state.base_T_flange
    )
    seen = now.seen or next(one for one in recorded._seen.values() if one)
    assert recorded.worth_taking(replace(now, state=away, seen=seen))
    assert not recorded.worth_taking(replace(now, state=away, seen=None))
    moving = replace(away, joint_speeds_rad_s=np.full(6, 0.1))
    assert not recorded.worth_taking(replace(now, state=moving, seen=seen))


def test_typed_poses_are_recorded_without_joints(recorded, open_session, tmp_path):
    robot = TypedRobot()
    session = open_session(tmp_path / "typed", robot)
    with pytest.raises(InputError, match="type or paste it"):
        session.take()
    assert session.look().state is None
    for line in recorded.recording().base_T_flange[:3]:
        robot.type(str(line.tolist()), "matrix")
        session.take()
    recording = session.recording()
    assert recording.joints_rad is None
    np.testing.assert_allclose(recording.base_T_flange, recorded.flange_poses()[:3], atol=1e-9)
    wanted = session.suggest()
    assert wanted.joints_rad is None
    assert "the target" in session.words(wanted, None)


def test_a_cell_without_a_target_is_shown_by_its_joints(recorded, open_session, tmp_path):
    cell = replace(recorded.cell, target=None)
    session = open_session(tmp_path / "markerless", cell=cell)
    for _ in range(2):
        wanted = session.suggest()
        assert session.words(wanted, None).startswith("turn ")
        session.robot.move_joints(wanted.joints_rad)
        assert session.take().endswith("taken")
    assert session.coverage().with_target is None
    blind = Session(
        replace(cell, initial_parent_T_camera=None), session.robot, session.camera, tmp_path / "blind"
    )
    session.robot.move_joints(blind.suggest().joints_rad)
    blind.take()
    assert np.abs(blind.suggest().joints_rad - blind.cell.joints_rad[0]).max() > 0.3


def test_without_a_target_the_robots_contour_is_in_the_picture(recorded, open_session, tmp_path):
    truth = recorded.camera.base_T_camera
    cell = replace(recorded.cell, target=None, initial_parent_T_camera=truth)
    session = open_session(tmp_path / "outlined", cell=cell)
    now = session.look()
    mask = session.camera.eye.mask(truth)
    contour = session.outline(now).round().astype(int)
    inside = contour[(contour >= 2).all(1) & (contour < np.array(mask.shape[::-1]) - 2).all(1)]
    shifts = np.mgrid[-2:3, -2:3].reshape(2, -1)
    near = mask[inside[:, 1] + shifts[0][:, None], inside[:, 0] + shifts[1][:, None]]
    assert len(inside) > 500
    assert (near.any(0) & ~near.all(0)).mean() > 0.9  # the tag hides a part of the hand
    assert recorded.outline(now) is None
    assert session.outline(replace(now, state=None)) is None


def test_pointing_finds_what_the_camera_sees(recorded):
    truth = recorded.camera.base_T_camera
    covariance = np.diag([1e-6] * 6)
    pointer = Pointer(Estimate(truth, covariance=covariance, solver="x"), recorded.cell.camera, len(recorded))
    point = np.array([-0.45, 0.1, 0.05])
    from hecbench import lens

    pixel = lens.project(pointer.camera, se3.transform_points(se3.inverse(truth), point))[0]
    found = pointer.at(pixel, np.eye(4), 0.05)
    np.testing.assert_allclose(found.base_m, point, atol=1e-9)
    assert found.expected.low < found.expected.value < found.expected.high
    with pytest.raises(InputError, match="does not meet the plane"):
        pointer.at(pixel, np.eye(4), 5.0)


@pytest.mark.parametrize("known", ["size", "nothing"])
def test_a_camera_whose_matrix_is_not_known_still_finds_the_target(recorded, open_session, tmp_path, known):
    size = replace(recorded.cell.camera, K=None) if known == "size" else None
    session = open_session(tmp_path / "unknown", cell=replace(recorded.cell, camera=size))
    if known == "nothing":  # the lab's camera knows its own
        session.cell = replace(session.cell, camera=None)
    session.robot.move_joints(session.suggest().joints_rad)
    assert session.take().endswith("the target seen")
    assert session.coverage().distances_m is None
    assert session.pointer() is None


def test_the_first_cell_of_the_docs_can_be_loaded(tmp_path):
    import re
    from pathlib import Path

    from hecbench.storage import recording_io

    page = Path(__file__).parents[3] / "docs/cockpit.md"
    (tmp_path / "recording.json").write_text(re.search(r"```json\n(.*?)```", page.read_text(), re.S).group(1))
    cell = recording_io.load(tmp_path)
    assert cell.target.kind == "charuco"
    assert len(cell) == 1
