"""Calibration from photographs alone: right where the images allow it, a failure or refusal elsewhere."""

from dataclasses import replace

import numpy as np
import pytest
from hecbench_datasets.suites import maskless as suites
from hecbench_plugins.solvers.render_gn import render_gn
from hecbench_plugins.solvers.render_gn_free import render_gn_free

from hecbench import se3
from hecbench.errors import InputError, Refusal, SolverFailure


def solve(recording, *unknown):
    return render_gn(unknown=unknown)(recording.without_truth(), rng=np.random.default_rng(0))


def error_mm(estimate, recording):
    return 1e3 * se3.translation_error_m(estimate.parent_T_camera, recording.truth_parent_T_camera)


def test_a_fixed_camera_is_found_and_the_evidence_told(fixed_camera):
    estimate = solve(fixed_camera)
    assert error_mm(estimate, fixed_camera) < 2
    told = estimate.diagnostics
    assert told["stage"] == "maskless"
    assert told["background_known"]
    assert told["confirmed"] > 0.5
    assert set(told["confirmed_by_sample"]) == set(fixed_camera.sample_ids)
    assert [step[0] for step in told["path"]] == ["start", "search", "refined", "last"]
    assert estimate.renders > 1000
    assert (np.linalg.eigvalsh(estimate.covariance) > 0).all()


def test_a_camera_in_the_hand_sees_its_own_arm(camera_in_hand):
    estimate = solve(camera_in_hand)
    assert error_mm(estimate, camera_in_hand) < 5
    assert not estimate.diagnostics["background_known"]


def test_a_fixed_camera_is_found_without_a_start(fixed_camera):
    blind = replace(fixed_camera.without_truth(), initial_parent_T_camera=None)
    estimate = render_gn_free()(blind, rng=np.random.default_rng(0))
    assert error_mm(estimate, fixed_camera) < 2
    assert estimate.diagnostics["stage"] == "maskless"


def test_without_a_start_one_photograph_is_refused(fixed_camera):
    blind = replace(fixed_camera.subset([0]).without_truth(), initial_parent_T_camera=None)
    with pytest.raises(Refusal, match="3 photographs or more"):
        render_gn_free()(blind, rng=np.random.default_rng(0))


def test_the_same_photographs_give_the_same_answer(fixed_camera):
    first, second = (solve(fixed_camera).parent_T_camera for _ in range(2))
    np.testing.assert_array_equal(first, second)


def test_joint_offsets_stay_within_their_prior_where_there_are_none(fixed_camera):
    estimate = solve(fixed_camera, "joints")
    assert error_mm(estimate, fixed_camera) < 3
    assert set(estimate.extras) == set(fixed_camera.robot.joint_names or estimate.extras)
    assert all(abs(offset["value"]) < np.deg2rad(0.2) for offset in estimate.extras.values())


def test_joints_of_other_photographs_are_a_failure_with_its_score(fixed_camera):
    with pytest.raises(SolverFailure, match=r"photographs confirm \d+ % of the contour"):
        solve(replace(fixed_camera, joints_rad=fixed_camera.joints_rad[::-1].copy()))


def test_a_sample_that_disagrees_is_named(fixed_camera):
    joints = fixed_camera.joints_rad.copy()
    joints[2] += 0.3
    told = solve(replace(fixed_camera, joints_rad=joints)).diagnostics
    assert told["doubtful_samples"] == [fixed_camera.sample_ids[2]]


def test_other_unknowns_are_refused(fixed_camera):
    with pytest.raises(Refusal, match="only joint offsets"):
        solve(fixed_camera, "focal")


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"initial_parent_T_camera": None}, "start"),
        ({"robot": None}, "robot model"),
        ({"joints_rad": np.full((4, 6), 9.0)}, "limits"),
    ],
)
def test_bad_input_is_refused_with_the_reason(fixed_camera, change, said):
    with pytest.raises(Refusal, match=said):
        solve(replace(fixed_camera, base_T_flange=np.tile(np.eye(4), (4, 1, 1)), **change))


def test_an_image_that_is_not_finite_is_refused(fixed_camera):
    images = [image.astype(np.float32) / 255 for image in fixed_camera.images]
    images[0][0, 0] = np.nan
    with pytest.raises(Refusal, match="not finite"):
        solve(replace(fixed_camera, images=tuple(images)))


@pytest.mark.parametrize(("suite", "most_mm"), [("maskless_lit", 4.0), ("maskless_real", 20.0)])
def test_independent_photographs(shared, monkeypatch, suite, most_mm):
    monkeypatch.setenv(suites.VARIABLE, str(shared / "data"))
    recording = suites.make(suite, "5_views_0.1m_10deg", 0, 0)
    assert recording.masks is None
    assert error_mm(solve(recording), recording) < most_mm


def test_the_wrong_robot_is_a_failure(shared, monkeypatch):
    monkeypatch.setenv(suites.VARIABLE, str(shared / "data"))
    with pytest.raises(SolverFailure, match="confirm"):
        solve(suites.make("maskless_lit", "wrong_robot", 0, 0))


def test_starts_of_the_suites_are_as_far_off_as_they_say(shared, monkeypatch):
    monkeypatch.setenv(suites.VARIABLE, str(shared / "data"))
    recording = suites.make("maskless_real", "3_views_0.2m_20deg", 5, 1)
    assert len(recording) == 3
    start, truth = recording.initial_parent_T_camera, recording.truth_parent_T_camera
    assert se3.translation_error_m(start, truth) == pytest.approx(0.2)
    assert np.rad2deg(se3.rotation_error_rad(start, truth)) == pytest.approx(20)


def test_suites_without_their_recordings_say_where_to_put_them(tmp_path, monkeypatch):
    monkeypatch.setenv(suites.VARIABLE, str(tmp_path))
    with pytest.raises(InputError, match=suites.VARIABLE):
        suites.make("maskless_lit", "1_views_0.1m_10deg", 0, 0)


def test_large_photographs_are_shrunk(fixed_camera):
    from hecbench_plugins.views.canvas import undistorted_canvas
    from hecbench_plugins.views.pyramid import photographed_robot

    robot = photographed_robot(fixed_camera)
    K = fixed_camera.camera.K.copy()
    K[:2] *= 4
    K[:2, 2] += 1.5
    camera = replace(fixed_camera.camera, width=1920, height=1440, K=K)
    large = tuple(np.repeat(np.repeat(image, 4, 0), 4, 1) for image in fixed_camera.images)
    canvas = undistorted_canvas(replace(fixed_camera, camera=camera, images=large), robot)
    assert canvas.images.shape == (4, 720, 960, 3)
    np.testing.assert_allclose(canvas.K[:2, :2], fixed_camera.camera.K[:2, :2] * 2)
    np.testing.assert_allclose(canvas.K[:2, 2], fixed_camera.camera.K[:2, 2] * 2 + 0.5)
