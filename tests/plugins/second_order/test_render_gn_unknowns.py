"""Joint offsets, focal length and scale beside the camera: found where they can be seen, and said where not."""

from dataclasses import replace

import numpy as np
import pytest
from hecbench_datasets.suites import synthetic
from hecbench_plugins.second_order.unknowns import PRIOR, Unknown
from hecbench_plugins.solvers.render_gn import render_gn

from hecbench import registry, se3
from hecbench.recording import CameraModel
from hecbench.specs import Kind, SolverSpec


def solve(recording, *unknown):
    solver = render_gn(unknown=unknown)
    return solver(recording.without_truth(), rng=np.random.default_rng(0))


def test_joint_offsets_are_found():
    recording, exact = synthetic.make("joint_noise", 0, 0), synthetic.make("LP", 0, 0)
    offsets = solve(recording, Unknown.JOINTS).extras
    for column, name in enumerate(recording.robot.joint_names[1:5], start=1):
        true = exact.joints_rad[0, column] - recording.joints_rad[0, column]
        assert offsets[name]["observable"]
        assert offsets[name]["value"] == pytest.approx(true, abs=5e-4)


def test_wrong_focal_length_is_found():
    recording = synthetic.make("LP", 0, 0)
    wrong = recording.camera.K.copy()
    wrong[[0, 1], [0, 1]] *= 1.01
    mistaken = replace(recording, camera=CameraModel(640, 480, wrong))
    estimate = solve(mistaken, "focal")
    assert estimate.extras["focal"]["value"] == pytest.approx(-np.log(1.01), abs=2e-4)
    np.testing.assert_allclose(estimate.camera.K, recording.camera.K, rtol=3e-4)
    assert se3.translation_error_m(estimate.parent_T_camera, recording.truth_parent_T_camera) < 5e-4


def test_scale_of_the_robot_is_said_to_be_unobservable():
    estimate = solve(synthetic.make("LP", 0, 0), "scale")
    scale = estimate.extras["scale"]
    assert not scale["observable"]
    assert scale["sigma"] == pytest.approx(PRIOR[Unknown.SCALE], rel=0.01)
    distance = np.linalg.norm(estimate.parent_T_camera[:3, 3])
    sigma_m = np.sqrt(np.diag(estimate.covariance)[3:].max())
    assert sigma_m == pytest.approx(PRIOR[Unknown.SCALE] * distance, rel=0.2)


@pytest.mark.parametrize("unknown", list(Unknown))
def test_every_unknown_can_be_asked_for_by_name(unknown):
    solver = registry.load().get(Kind.SOLVER, f"render_gn[unknown={unknown}]", SolverSpec).factory()
    assert solver.by_masks.unknown == solver.by_photographs.unknown == (unknown,)
