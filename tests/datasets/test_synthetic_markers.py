"""Generated marker recordings: reproducible, exact without noise, and as noisy as they say."""

from dataclasses import replace

import numpy as np
import pytest
from hecbench_datasets.suites.synthetic_markers import PRESETS, WORKSPACE_CENTRE_M, generate, make
from hecbench_plugins.markers.target_poses import target_poses

from hecbench import se3
from hecbench.recording import Mounting

LEVELS = sorted(PRESETS)


def quiet(level):
    return replace(PRESETS[level], pixel_noise_px=0.0, robot_noise_mm=0.0, robot_noise_deg=0.0)


@pytest.mark.parametrize("level", LEVELS)
def test_equal_arguments_give_equal_bytes(level):
    assert make(level, 3, 1).sha256 == make(level, 3, 1).sha256
    others = {make(level, 3, 1).sha256, make(level, 4, 1).sha256, make(level, 3, 2).sha256}
    assert len(others) == 3


@pytest.mark.parametrize("level", LEVELS)
def test_without_noise_the_loop_closes(level):
    recording = generate(quiet(level), np.random.default_rng(0))
    X, hand = recording.truth_parent_T_camera, recording.hand_poses()
    Y = se3.inverse(hand) @ X @ target_poses(recording)
    np.testing.assert_allclose(Y, np.broadcast_to(Y[0], Y.shape), atol=1e-5)


@pytest.mark.parametrize("level", LEVELS)
def test_noise_has_the_stated_size(level):
    setting = replace(PRESETS[level], samples=400)
    noisy, exact = (
        generate(s, np.random.default_rng(9)) for s in (setting, replace(quiet(level), samples=400))
    )
    pixels = noisy.corners_px - exact.corners_px
    assert np.nanstd(pixels) == pytest.approx(setting.pixel_noise_px, rel=0.1)
    robot = se3.log(se3.inverse(exact.base_T_flange) @ noisy.base_T_flange)
    assert np.rad2deg(robot[:, :3].std()) == pytest.approx(setting.robot_noise_deg, rel=0.1)
    assert 1e3 * robot[:, 3:].std() == pytest.approx(setting.robot_noise_mm, rel=0.1)


@pytest.mark.parametrize("level", LEVELS)
def test_camera_and_mounting(level):
    recording = make(level, 0, 0)
    assert (recording.mounting is Mounting.EYE_IN_HAND) == level.endswith("in_hand")
    assert (recording.camera.width, recording.camera.height) == (2448, 2048)
    assert np.isfinite(recording.corners_px).all()
    if recording.mounting is Mounting.EYE_TO_HAND:
        X = recording.truth_parent_T_camera
        assert np.linalg.norm(X[:3, 3] - WORKSPACE_CENTRE_M) == pytest.approx(2.0)
        np.testing.assert_allclose((se3.inverse(X) @ np.append(WORKSPACE_CENTRE_M, 1))[:2], 0, atol=1e-12)
