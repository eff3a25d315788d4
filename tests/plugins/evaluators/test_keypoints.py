"""PCK and ADD against second computations, on a robot with one keypoint on its flange."""

from dataclasses import replace

import numpy as np
import pytest
from hecbench_datasets.suites import synthetic
from hecbench_plugins.evaluators import keypoints

from hecbench import diagnose, registry, se3
from hecbench.estimate import Estimate, Status
from hecbench.recording import CameraModel, Mounting, Recording
from hecbench.report.tables import Group, table
from hecbench.running import solving
from hecbench.specs import Kind, SolverSpec
from hecbench.targets import PointsTarget

OFFSET = (0.01, -0.02, 0.1)


@pytest.fixture(params=list(Mounting))
def labelled(request, rng):
    """Twelve samples of four robot poses, a keypoint carried by the other link, exact labels, and the truth."""
    mounting = request.param
    X = se3.from_rotvec([0.1, 3.0, 0.2], [0.2, 0.1, 1.5])
    hand = X @ se3.from_rotvec(rng.normal(0, 0.4, (4, 3)), rng.normal([0, 0, 1.5], 0.2, (4, 3)))
    hand = np.repeat(hand, 3, axis=0)
    camera = CameraModel(1280, 960, np.array([[900.0, 0, 640], [0, 900, 480], [0, 0, 1]]))
    points = se3.transform_points(se3.inverse(X) @ hand, np.array([OFFSET]))[:, 0]
    pixels = (points @ camera.K.T)[:, :2] / points[:, 2:]
    return Recording(
        name="baxter",
        mounting=mounting,
        sample_ids=tuple(map(str, range(12))),
        camera=camera,
        target=PointsTarget((OFFSET,)),
        base_T_flange=hand if mounting is Mounting.EYE_TO_HAND else se3.inverse(hand),
        corners_px=pixels[:, None],
        truth_parent_T_camera=X,
    )


def measure(ruler, recording, X):
    return ruler(Estimate(X), recording, solve=None, rng=None)


def test_the_truth_misses_nothing(labelled):
    found = measure(keypoints.pck, labelled, labelled.truth_parent_T_camera)
    assert (found["keypoints"], found["keypoint_poses"]) == (12, 4)
    assert found["keypoint_mean_px"] < 1e-6
    assert found["pck_20_px"] == 1.0
    assert found["keypoint_auc"] == pytest.approx(199 / 200)
    assert measure(keypoints.add, labelled, labelled.truth_parent_T_camera)["add_mm"] < 1e-9


def test_a_known_miss(labelled):
    """A label off by 25.5 px is outside 20 px, inside 30; and one that is not there counts nowhere."""
    corners = labelled.corners_px.copy()
    corners[:3, 0] += [15.3, 20.4]
    corners[3] = np.nan
    found = measure(keypoints.pck, replace(labelled, corners_px=corners), labelled.truth_parent_T_camera)
    assert found["keypoints"] == 11
    assert found["pck_20_px"] == pytest.approx(8 / 11)
    assert found["pck_30_px"] == 1.0
    assert found["keypoint_mean_px"] == pytest.approx(76.5 / 11)
    expected = (8 * 199 + 3 * 174) / 11 / 200
    assert found["keypoint_auc"] == pytest.approx(expected)


def test_behind_the_camera_is_a_miss(labelled):
    turned = labelled.truth_parent_T_camera @ se3.from_rotvec([0, np.pi, 0], np.zeros(3))
    found = measure(keypoints.pck, labelled, turned)
    assert found["pck_200_px"] == 0.0
    assert found["keypoint_mean_px"] == np.inf


def test_add_of_a_moved_camera_is_its_shift(labelled):
    moved = labelled.truth_parent_T_camera @ se3.make(np.eye(3), [0.03, 0, 0.04])
    found = measure(keypoints.add, labelled, moved)
    assert found["add_mm"] == pytest.approx(50.0)
    assert found["add_auc_400_mm"] == pytest.approx(349 / 400, abs=1 / 400)


def test_add_of_links_of_a_rendered_robot():
    recording = synthetic.make("LP", 0, 0)
    assert measure(keypoints.links_add, recording, recording.truth_parent_T_camera)["links_add_mm"] < 1e-9
    moved = recording.truth_parent_T_camera @ se3.make(np.eye(3), [0.03, 0, 0.04])
    found = measure(keypoints.links_add, recording, moved)
    assert found["links_add_mm"] == pytest.approx(50.0)
    assert found["links_add_auc_100_mm"] == pytest.approx(0.5)


def test_a_calibration_target_is_no_keypoint(exact_rig, labelled):
    assert keypoints.has_keypoints(labelled)
    assert not keypoints.has_keypoints(exact_rig)
    assert not keypoints.has_keypoints(replace(labelled, corners_px=None))


def test_marker_methods_refuse_a_keypoint(labelled):
    """One point has no pose: every method that lives on a target says so, and the check does not trip over it."""
    names = ("park", "shah", "bundle", "single3d_iterative", "tsai")
    specs = [registry.load().get(Kind.SOLVER, name, SolverSpec) for name in names]
    for estimate in solving.solve(labelled, specs):
        assert estimate.status is Status.REFUSED, estimate.reason
    assert not [f for f in diagnose.check(labelled) if f.severity == "critical"]


def test_the_runner_applies_them(labelled):
    class Told:
        def __call__(self, recording, *, rng):
            return Estimate(labelled.truth_parent_T_camera)

    spec = SolverSpec(name="told", summary="s", factory=Told, needs=frozenset(), reference="r")
    (estimate,) = solving.solve(labelled, [spec])
    assert estimate.diagnostics["pck_20_px"] == 1.0
    assert estimate.errors["add_mm"] < 1e-9
    assert "links_add_mm" not in estimate.errors
    shown = table(Group("baxter", (estimate,), is_level=False))
    assert shown.rows[0][shown.header.index("PCK @50 px")] == "1"
