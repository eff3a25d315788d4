"""Nothing of a left-out sample reaches its own prediction: neither the solver's X nor the evaluator's target pose."""

from dataclasses import replace

import numpy as np
import pytest
from hecbench_plugins.evaluators import held_out as module

from hecbench import se3
from hecbench.estimate import Estimate


@pytest.mark.parametrize("pixels", [True, False])
def test_a_spoiled_sample_moves_no_target_pose_that_predicts_it(exact_rig, rng, monkeypatch, pixels):
    spoiled = exact_rig.camera_T_target.copy()
    spoiled[3] = se3.exp([0.3, -0.2, 0.1, 0.05, 0.05, 0.05]) @ spoiled[3]
    corners = exact_rig.corners_px.copy()
    corners[3] += rng.normal(0, 40, corners[3].shape)
    recording = replace(exact_rig, camera_T_target=spoiled, corners_px=corners if pixels else None)
    truth = exact_rig.truth_parent_T_camera
    true_Y = se3.inverse(exact_rig.hand_poses()[0]) @ truth @ exact_rig.camera_T_target[0]
    predicted = []

    def residuals(parent_T_camera, carrier_T_target, seen_by, i):
        predicted.append((i, carrier_T_target))
        return np.zeros(3)

    monkeypatch.setattr(module, "_residuals", residuals)
    module.held_out(
        Estimate(truth), recording, solve=lambda part: Estimate(truth), rng=np.random.default_rng(0)
    )
    assert sorted(i for i, _ in predicted) == list(range(len(recording)))
    (target_pose,) = [carrier_T_target for i, carrier_T_target in predicted if i == 3]
    np.testing.assert_allclose(target_pose, true_Y, atol=1e-6)
    others = [Y for i, Y in predicted if not np.allclose(Y, target_pose)]
    assert all(np.abs(Y - true_Y).max() > 1e-4 for Y in others)
    assert others
