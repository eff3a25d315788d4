"""The network that is shipped, on the pictures of the conformance checks."""

from dataclasses import replace

import numpy as np
import pytest
from hecbench_plugins.regression.settings import SHIPPED
from hecbench_plugins.solvers.regression import regression

from hecbench import se3
from hecbench.conformance.photographs import photographs
from hecbench.errors import SolverFailure


def solved(recording):
    return regression()(recording, rng=np.random.default_rng(0))


def test_it_says_roughly_where_the_camera_is():
    recording = photographs()
    estimate = solved(recording.without_truth())
    truth = recording.truth_parent_T_camera
    assert se3.translation_error_m(truth, estimate.pose) < 0.5
    assert np.rad2deg(se3.rotation_error_rad(truth, estimate.pose)) < 20
    assert estimate.diagnostics["views"] == 4
    assert (np.linalg.eigvalsh(estimate.covariance) > 0).all()


def test_an_empty_wall_is_no_answer():
    recording = photographs()
    wall = np.full((240, 320, 3), 128, np.uint8)
    with pytest.raises(SolverFailure, match="no robot is seen in any of the 4 images"):
        solved(replace(recording, images=(wall,) * 4))


def test_the_weights_are_small():
    assert (SHIPPED / "regression.onnx").stat().st_size < 3 * 2**20
