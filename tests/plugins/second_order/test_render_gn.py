"""render_gn on generated and on independently rendered recordings; bad input is refused in one sentence."""

from dataclasses import replace

import numpy as np
import pytest
from hecbench_datasets.suites import synthetic
from hecbench_plugins.solvers.render_gn import render_gn
from hecbench_plugins.views.pyramid import prepare

from hecbench import se3
from hecbench.errors import Refusal, SolverFailure
from hecbench.estimate import Termination
from hecbench.recording import CameraModel, Mounting, RobotDescription
from hecbench.storage.recording_io import load


def solve(recording):
    return render_gn()(recording.without_truth(), rng=np.random.default_rng(0))


def camera_T_parent_error_mm(estimate, recording):
    ends = [se3.inverse(pose) for pose in (estimate.parent_T_camera, recording.truth_parent_T_camera)]
    return 1e3 * se3.translation_error_m(*ends)


@pytest.fixture(scope="module")
def easy():
    return synthetic.make("LP", 0, 0)


@pytest.mark.parametrize("level", ["LP", "MP", "HP"])
@pytest.mark.parametrize("index", [1, 2, 3])
def test_converges_from_every_start_level(level, index):
    recording = synthetic.make(level, index, 0)
    estimate = solve(recording)
    truth = recording.truth_parent_T_camera
    assert camera_T_parent_error_mm(estimate, recording) < 0.1
    assert se3.rotation_error_rad(estimate.parent_T_camera, truth) < 3e-4
    assert estimate.termination is Termination.CONVERGED
    assert estimate.renders < 150
    assert 2 < len(estimate.diagnostics["path"]) <= 40


@pytest.mark.parametrize("level", ["gain", "gamma", "blur", "colours", "ragged_mask", "noise", "occlusion"])
def test_appearance_does_not_move_the_answer(level):
    recording = synthetic.make(level, 1, 0)
    assert camera_T_parent_error_mm(solve(recording), recording) < 0.3


def test_only_what_is_thick_beside_the_mask_counts_as_hiding():
    for level, hides in (("LP", False), ("ragged_mask", False), ("noise", False), ("occlusion", True)):
        for index in range(2):
            _, (view,) = prepare(synthetic.make(level, index, 3))
            assert (view.levels[1].hidden is not None) == hides, level


@pytest.mark.parametrize("index", [0, 9])
def test_a_fifth_hidden_is_found_by_masks_alone(index):
    recording = replace(synthetic.make("occlusion", index, 1), images=None)
    assert camera_T_parent_error_mm(solve(recording), recording) < 5


@pytest.mark.parametrize("index", [8, 37])
def test_an_end_that_the_contour_contradicts_is_a_failure(index):
    recording = replace(synthetic.make("occlusion", index, 1), images=None)
    with pytest.raises(SolverFailure, match="of the contour"):
        solve(recording)


def test_wrong_geometry_costs_no_more_than_it_must():
    for index in range(2):
        recording = synthetic.make("mismatch_3", index, 0)
        floor = synthetic.correspondence_floor_mm("mismatch_3", index, 0)
        assert camera_T_parent_error_mm(solve(recording), recording) < 1.3 * floor + 3


def test_views_are_stacked():
    recording = synthetic.make("views_3", 0, 0)
    assert camera_T_parent_error_mm(solve(recording), recording) < 0.05


def test_no_mask_and_calibrated_covariance(easy):
    rng = np.random.default_rng(5)
    picture = 0.25 + easy.image(0) / 510 + rng.normal(0, 0.05, (480, 640, 3))
    recording = replace(easy, images=(np.clip(picture, 0, 1).astype(np.float32),), masks=None)
    estimate = solve(recording)
    twist = se3.log(easy.truth_parent_T_camera @ se3.inverse(estimate.parent_T_camera))
    assert twist @ np.linalg.solve(estimate.covariance, twist) < 22.5  # 99.9 % of chi-squared with 6 degrees
    assert estimate.diagnostics["noise"] == pytest.approx(0.05, rel=0.03)
    assert estimate.diagnostics["overlap_from_the_other_side"] < estimate.diagnostics["overlap"]
    assert np.isfinite(estimate.diagnostics["condition"])


@pytest.mark.parametrize("item", [0, 3])
def test_pictures_of_another_renderer(shared, item):
    recording = load(shared / "data" / f"lit_ur5e_1_0{item}")
    one, all_views = recording.subset([0]), recording
    truth = recording.truth_parent_T_camera
    assert se3.translation_error_m(solve(one).parent_T_camera, truth) < 2e-3
    estimate = solve(all_views)
    assert se3.translation_error_m(estimate.parent_T_camera, truth) < 0.6e-3
    assert estimate.diagnostics["stage"] == "intervals"


def test_eye_in_hand_sees_part_of_its_own_robot(shared):
    """A camera beside the tool, looking back along the arm: the same pictures, told from the flange."""
    truth_recording = synthetic.make("views_3", 4, 0)
    model, _ = synthetic.robot_and_mesh()
    base_T_flange = model.forward(truth_recording.joints_rad[:1], base="base_link", tip="tool0")[0]
    recording = replace(
        truth_recording.subset([0]),
        mounting=Mounting.EYE_IN_HAND,
        initial_parent_T_camera=se3.inverse(base_T_flange) @ truth_recording.initial_parent_T_camera,
        truth_parent_T_camera=se3.inverse(base_T_flange) @ truth_recording.truth_parent_T_camera,
    )
    estimate = solve(recording)
    assert se3.translation_error_m(estimate.parent_T_camera, recording.truth_parent_T_camera) < 5e-4


def test_a_distorted_camera_is_undistorted_once(easy):
    from hecbench.rendering.undistort import Undistortion

    inverse = np.array(
        [0.08, -0.02, 0.0005, -0.0005]
    )  # stands for a lens whose undistorted picture is `easy`
    warped = Undistortion.of(CameraModel(640, 480, easy.camera.K, inverse))
    images = (np.round(255 * warped.image(easy.image(0))).astype(np.uint8),)
    masks = (np.where(warped.image(easy.mask(0).astype(np.float32)) > 0.5, 255, 0).astype(np.uint8),)
    lens = CameraModel(640, 480, easy.camera.K, -inverse)
    recording = replace(easy, camera=lens, images=images, masks=masks)
    assert camera_T_parent_error_mm(solve(recording), recording) < 5


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"initial_parent_T_camera": None}, "needs a start"),
        ({"robot": None}, "no robot model"),
        ({"camera": CameraModel(640, 480)}, "intrinsics are unknown"),
        ({"masks": (np.zeros((480, 640), np.uint8),)}, "mask covers 0.0 %"),
        ({"masks": (np.full((480, 640), 255, np.uint8),)}, "mask covers 100.0 %"),
        ({"masks": (np.zeros((48, 64), np.uint8),)}, "is 64x48 px"),
        ({"images": (np.full((480, 640, 3), np.nan, np.float32),)}, "not finite"),
        ({"joints_rad": np.full((1, 6), 9.0)}, "outside its limits"),
        ({"joints_rad": np.zeros((1, 7)), "robot": RobotDescription(model="ur5e")}, "7"),
        ({"robot": RobotDescription(model="ur6e")}, "no such URDF"),
        ({"robot": RobotDescription(model="ur5e", base_link="floor")}, "no link 'floor'"),
        ({"images": None, "masks": None}, "has an image or a mask"),
    ],
)
def test_bad_input_is_refused_with_its_reason(easy, change, reason):
    with pytest.raises(Refusal, match=reason):
        solve(replace(easy, **change))


def test_camera_inside_the_robot_is_refused(easy):
    inside = se3.make(np.eye(3), [0.0, 0.0, 0.1])
    with pytest.raises((Refusal, SolverFailure)):
        solve(replace(easy, initial_parent_T_camera=inside))


def test_a_picture_of_something_else_is_a_failure(easy):
    mask = np.zeros((480, 640), np.uint8)
    mask[10:40, :] = 255
    with pytest.raises(SolverFailure, match="overlap"):
        solve(replace(easy, images=None, masks=(mask,)))


def test_same_bytes_from_the_same_input(easy):
    np.testing.assert_array_equal(solve(easy).parent_T_camera, solve(easy).parent_T_camera)


def test_a_furnished_scene_is_not_taken_for_hiding():
    """A bar before a plain wall may hide the robot; more furniture than robot only surrounds it."""
    from hecbench_plugins.views.pyramid import hidden_by_others

    image, mask = np.zeros((120, 160, 3), np.float32), np.zeros((120, 160), np.float32)
    mask[40:80, 60:100] = 1
    image[mask > 0] = 0.8
    image[20:60, 100:120] = 0.5
    assert hidden_by_others(image, np.zeros(3, np.float32), mask)[40, 110]
    image[80:] = 0.5
    assert hidden_by_others(image, np.zeros(3, np.float32), mask) is None


@pytest.mark.parametrize(("width", "height"), [(1000, 3), (3, 1000), (31, 31)])
def test_pictures_of_a_few_rows_are_refused(easy, width, height):
    recording = replace(
        easy, camera=replace(easy.camera, width=width, height=height), images=None, masks=None
    )
    with pytest.raises(Refusal, match=f"{width}x{height} px are too small"):
        prepare(recording)
