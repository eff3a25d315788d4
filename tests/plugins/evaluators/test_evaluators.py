"""The rulers, against second computations of the same numbers."""

from dataclasses import replace

import numpy as np
import pytest
from hecbench_plugins.evaluators.held_out import held_out, refit_target
from hecbench_plugins.evaluators.truth import errors

from hecbench import preparation, se3
from hecbench.estimate import Estimate, Status
from hecbench.storage import recording_io
from hecbench.workspace import points_in_parent


def truth(recording):
    return recording.truth_parent_T_camera


def measure(recording, parent_T_camera):
    return errors(Estimate(parent_T_camera), recording, solve=None, rng=None)


def test_no_error_for_the_truth(exact_rig):
    assert max(measure(exact_rig, truth(exact_rig)).values()) < 1e-9


def test_errors_of_a_known_offset(exact_rig):
    """A turn about the camera centre leaves the centre, and moves the parent's origin seen from the camera."""
    turn = truth(exact_rig) @ se3.from_rotvec([0, 0, 0.01], np.zeros(3))
    found = measure(exact_rig, turn)
    assert found["translation_error_mm"] == pytest.approx(0, abs=1e-9)
    assert found["rotation_error_deg"] == pytest.approx(np.rad2deg(0.01))
    inverse = se3.inverse(truth(exact_rig))[:3, 3]
    expected = 1e3 * 2 * np.sin(0.005) * np.linalg.norm(inverse[:2])
    assert found["camera_T_parent_translation_error_mm"] == pytest.approx(expected)


def test_tre_is_the_rms_over_cube_corners_and_samples(exact_rig, rng):
    estimated = se3.exp(rng.normal(0, 0.01, 6)) @ truth(exact_rig)
    centre = exact_rig.base_T_flange[:, :3, 3].mean(0)
    squares = []
    for base_T_flange in exact_rig.base_T_flange:
        before, after = truth(exact_rig), estimated
        if exact_rig.mounting == "eye_in_hand":
            before, after = base_T_flange @ before, base_T_flange @ after
        for corner in np.ndindex(2, 2, 2):
            w = np.append(centre + 0.4 * (np.array(corner) - 0.5), 1.0)
            squares.append(((after @ np.linalg.inv(before) @ w - w)[:3] ** 2).sum())
    assert measure(exact_rig, estimated)["tre_mm"] == pytest.approx(1e3 * np.sqrt(np.mean(squares)))


def test_translation_offset_is_the_tre_when_rotation_is_right(exact_rig):
    if exact_rig.mounting == "eye_to_hand":
        moved = truth(exact_rig).copy()
        moved[0, 3] += 0.003
        assert measure(exact_rig, moved)["tre_mm"] == pytest.approx(3.0)


def predict(recording, X, seed=0):
    return held_out(Estimate(X), recording, solve=lambda _: Estimate(X), rng=np.random.default_rng(seed))


def test_held_out_is_zero_for_the_truth_on_exact_data(exact_rig):
    found = predict(exact_rig.without_truth(), truth(exact_rig))
    assert found["reprojection_px"] < 1e-6
    assert found["target_mm"] < 1e-6
    assert (found["folds"], found["failed_folds"], found["samples"]) == (5, 0, len(exact_rig))


def test_held_out_measures_the_pixel_noise(exact_rig, rng):
    """With the true X the only residual is the noise: rms over (u, v) of sigma per axis is sqrt(2) sigma."""
    noisy = replace(
        exact_rig, corners_px=exact_rig.corners_px + rng.normal(0, 0.5, exact_rig.corners_px.shape)
    )
    found = predict(noisy, truth(exact_rig))
    assert found["reprojection_px"] == pytest.approx(np.sqrt(2) * 0.5, rel=0.1)
    low, high = found["reprojection_px_interval"]
    assert low < found["reprojection_px"] < high


def test_held_out_grows_with_the_error(exact_rig):
    worse = [truth(exact_rig) @ se3.from_rotvec([angle, 0, 0], np.zeros(3)) for angle in (0.0, 0.01, 0.03)]
    pixels = [predict(exact_rig, X)["reprojection_px"] for X in worse]
    assert pixels[0] < pixels[1] < pixels[2]


def test_folds_without_an_answer_are_counted(exact_rig):
    answers = iter([Estimate(truth(exact_rig))] * 3 + [Estimate(status=Status.REFUSED, reason="no")] * 2)
    found = held_out(
        Estimate(np.eye(4)), exact_rig, solve=lambda _: next(answers), rng=np.random.default_rng(0)
    )
    assert found["failed_folds"] == 2
    assert found["samples"] < len(exact_rig)


def test_training_folds_do_not_hold_the_left_out_samples(exact_rig):
    seen = []

    def solve(recording):
        seen.append(set(recording.sample_ids))
        return Estimate(truth(exact_rig))

    held_out(Estimate(np.eye(4)), exact_rig, solve=solve, rng=np.random.default_rng(0))
    left_out = [set(exact_rig.sample_ids) - training for training in seen]
    assert sorted(i for part in left_out for i in part) == sorted(exact_rig.sample_ids)


def test_refit_uses_pixels_where_there_are_pixels(exact_rig, rng):
    noise = se3.exp(rng.normal(0, 0.02, (len(exact_rig), 6)))
    spoiled = replace(exact_rig, camera_T_target=noise @ exact_rig.camera_T_target)
    true_Y = se3.inverse(exact_rig.hand_poses()[0]) @ truth(exact_rig) @ exact_rig.camera_T_target[0]
    np.testing.assert_allclose(refit_target(truth(exact_rig), spoiled), true_Y, atol=1e-6)
    without = replace(spoiled, corners_px=None)
    assert np.abs(refit_target(truth(exact_rig), without) - true_Y).max() > 1e-4


def test_real_recording(shared):
    recording = recording_io.load(shared / "data" / "ur3e_cam1")
    found = predict(preparation.prepare(recording).without_truth(), truth(recording))
    assert found["reprojection_px"] == pytest.approx(0.65, abs=0.1)


def with_focal(camera, factor):
    K = camera.K.copy()
    K[[0, 1], [0, 1]] *= factor
    return replace(camera, K=K)


def test_the_pair_error_is_the_tre_where_the_camera_is_the_recordings(exact_rig, rng):
    estimated = se3.exp(rng.normal(0, 0.01, 6)) @ truth(exact_rig)
    found = measure(exact_rig, estimated)
    assert found["pair_tre_mm"] == pytest.approx(found["tre_mm"])


def test_the_pair_error_of_a_moved_camera(exact_rig):
    """A longer focal length at the true pose draws every point towards the optical axis, at its own depth."""
    camera = with_focal(exact_rig.camera, 1.05)
    found = errors(Estimate(truth(exact_rig), camera=camera), exact_rig, solve=None, rng=None)
    assert found["tre_mm"] < 1e-9
    points_m = points_in_parent(exact_rig.base_T_flange, exact_rig.mounting == "eye_in_hand")
    seen = se3.transform_points(se3.inverse(truth(exact_rig)), points_m)
    pixels = seen @ exact_rig.camera.K.T
    pixels = pixels[:, :2] / pixels[:, 2:]
    size = exact_rig.camera.width - 1, exact_rig.camera.height - 1
    inside = (seen[:, 2] > 0) & ((pixels >= 0) & (pixels <= size)).all(1)
    lateral = (1 - 1 / 1.05) * np.linalg.norm(seen[inside, :2], axis=1)
    assert found["pair_tre_mm"] == pytest.approx(1e3 * np.sqrt((lateral**2).mean()), rel=1e-6)


def test_a_camera_that_came_with_the_answer_sees_the_target_again(exact_rig):
    """A recording with a wrong focal length: millimetres are measured with the camera that made the answer."""
    wrong = replace(
        exact_rig.without_truth(), camera=with_focal(exact_rig.camera, 1.03), camera_T_target=None
    )
    wrong = preparation.prepare(wrong)
    X = truth(exact_rig)
    own = held_out(
        Estimate(X),
        wrong,
        solve=lambda _: Estimate(X, camera=exact_rig.camera),
        rng=np.random.default_rng(0),
    )
    theirs = held_out(Estimate(X), wrong, solve=lambda _: Estimate(X), rng=np.random.default_rng(0))
    assert own["target_mm"] < 0.01
    assert own["reprojection_px"] < 0.01
    assert theirs["target_mm"] > 1


def test_no_interval_of_few_samples(exact_rig):
    few = exact_rig.subset(range(4))
    assert "target_mm_interval" not in predict(few, truth(exact_rig))
