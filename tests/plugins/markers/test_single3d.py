"""Single3D: exactness, the same minimum as a general optimiser, and coplanar positions."""

from dataclasses import replace

import numpy as np
import pytest
from hecbench_plugins.markers import single3d
from hecbench_plugins.markers.settings import SINGLE3D
from hecbench_plugins.solvers.single3d_closed import Single3DClosed
from hecbench_plugins.solvers.single3d_iterative import single3d_iterative
from scipy.optimize import least_squares

from hecbench import se3
from hecbench.conformance import rig
from hecbench.errors import Refusal, SolverFailure
from hecbench.recording import Mounting, Recording

SOLVERS = {"closed": Single3DClosed(), "iterative": single3d_iterative}


@pytest.fixture(params=SOLVERS)
def solver(request):
    return SOLVERS[request.param]


def test_exact_on_any_rig(solver, rng):
    for i in range(40):
        recording = rig(np.random.default_rng(i), list(Mounting)[i % 2], rotations=rng.uniform(-3, 3, (8, 3)))
        found = solver(recording.without_truth(), rng=rng)
        np.testing.assert_allclose(found.parent_T_camera, recording.truth_parent_T_camera, atol=1e-7)
        assert found.diagnostics["position_rms_mm"] < 1e-6


@pytest.mark.parametrize("mounting", list(Mounting))
def test_iteration_reaches_the_minimum_of_a_general_optimiser(mounting):
    """Levenberg-Marquardt over R, t and the marker together: the same answer to 1e-9."""
    for seed in range(10):
        positions = single3d.marker_positions(rig(np.random.default_rng(seed), mounting, noise=1e-3))
        X, marker = positions.rest_given(single3d.iterate(positions)[0])

        def residuals(unknowns, X=X, marker=marker, positions=positions):
            return positions.residuals_m(se3.exp(unknowns[:6]) @ X, marker + unknowns[6:]).ravel()

        def jacobian(unknowns, X=X, positions=positions):
            moved = se3.transform_points(se3.exp(unknowns[:6]) @ X, positions.points_c)
            ones = np.tile(np.eye(3), (len(moved), 1, 1))
            return np.concatenate([-se3.hat(moved), ones, -positions.hand[:, :3, :3]], 2).reshape(-1, 9)

        start = np.concatenate([[0.02, -0.01, 0.03, 0.01, 0.0, -0.02], [0.01, 0.0, -0.01]])
        exact = {"xtol": 1e-15, "ftol": 1e-15, "gtol": 1e-15}
        best = least_squares(residuals, start, jacobian, method="lm", **exact).x
        best -= np.linalg.lstsq(jacobian(best), residuals(best), rcond=None)[
            0
        ]  # its stop feels only the cost
        assert np.abs(best).max() < 1e-9


def coplanar(rng):
    """Markers at one height to 3 mm, seen from 1.5 m with 6 mm of depth noise, 10 samples."""
    X = se3.from_rotvec([2.0, 0.3, -0.2], [0.8, 0.1, 1.4])
    points = np.column_stack([rng.uniform(-0.3, 0.3, (10, 2)), rng.normal(0.3, 0.003, 10)])
    hand = se3.from_rotvec(rng.uniform(-0.5, 0.5, (10, 3)), np.zeros((10, 3)))
    marker = np.array([0.02, -0.01, 0.1])
    hand[:, :3, 3] = points - hand[:, :3, :3] @ marker
    seen = se3.transform_points(se3.inverse(X), points)
    seen += seen / np.linalg.norm(seen, axis=1)[:, None] * rng.normal(0, 0.006, (10, 1))
    recording = Recording(
        name="coplanar",
        mounting=Mounting.EYE_TO_HAND,
        sample_ids=tuple(map(str, range(10))),
        truth_parent_T_camera=X,
        base_T_flange=hand,
        camera_T_target=se3.make(np.eye(3), seen),
    )
    return recording


def test_coplanar_positions_ruin_the_closed_form_only():
    errors = {name: [] for name in SOLVERS}
    for seed in range(20):
        recording = coplanar(np.random.default_rng(seed))
        for name, solver in SOLVERS.items():
            try:
                found = solver(recording.without_truth(), rng=np.random.default_rng(0))
            except SolverFailure:
                errors[name].append(np.inf)
                continue
            assert found.diagnostics["nearly_coplanar"]
            errors[name].append(
                se3.translation_error_m(found.parent_T_camera, recording.truth_parent_T_camera)
            )
    assert np.median(errors["closed"]) > 0.1
    assert np.median(errors["iterative"]) < 0.04


def test_spread_positions_are_well_conditioned(rng):
    found = single3d_iterative(rig(rng, Mounting.EYE_TO_HAND), rng=rng)
    assert found.diagnostics["coplanarity_condition"] < SINGLE3D.coplanar_condition
    assert not found.diagnostics["nearly_coplanar"]


def test_orientation_of_the_target_does_not_matter(rng):
    """Without a target description the marker is the origin of the target frame."""
    recording = replace(rig(rng, Mounting.EYE_IN_HAND), target=None, corners_px=None)
    poses = recording.camera_T_target.copy()
    poses[:, :3, :3] = se3.so3_exp(rng.uniform(-3, 3, (len(poses), 3)))
    found = single3d_iterative(replace(recording, camera_T_target=poses), rng=rng)
    np.testing.assert_allclose(found.parent_T_camera, recording.truth_parent_T_camera, atol=1e-7)


def test_reference_projection_equals_the_nearest_rotation_on_exact_data(exact_rig, rng):
    found = Single3DClosed(reference_projection=True)(exact_rig, rng=rng)
    np.testing.assert_allclose(found.parent_T_camera, exact_rig.truth_parent_T_camera, atol=1e-7)


def test_closed_form_refuses_four_samples(exact_rig, rng):
    with pytest.raises(Refusal, match="4 samples"):
        Single3DClosed()(exact_rig.subset(range(4)), rng=rng)


def test_inverted_poses_fail(exact_rig, rng):
    turned = replace(exact_rig, base_T_flange=se3.inverse(exact_rig.base_T_flange))
    with pytest.raises(SolverFailure, match="inverted"):
        single3d_iterative(turned, rng=rng)
