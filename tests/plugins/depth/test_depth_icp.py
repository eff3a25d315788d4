"""`depth_icp` on drawn depth: right from near and far starts and from none, and never wrong in silence."""

from dataclasses import replace

import numpy as np
import pytest
from hecbench_plugins.solvers.depth_icp import depth_icp
from PIL import Image

from hecbench import se3
from hecbench.diagnose import Severity, check
from hecbench.errors import InputError, Refusal, SolverFailure
from hecbench.lens import CameraModel
from hecbench.recording import Mounting, Recording, RobotDescription
from hecbench.rendering import Renderer, RenderMesh
from hecbench.robots.model import load_robot
from hecbench.storage import recording_io
from hecbench.workspace import apart_m, points_in_parent

WIDTH, HEIGHT, VIEWS, WALL_M = 320, 240, 6, 2.5
K = np.array([[300.0, 0, 159.5], [0, 300.0, 119.5], [0, 0, 1]])
BASE_T_CAMERA = se3.looking([1.0, 0.4, 0.6], [0.05, 0.0, 0.3])
NOISE = 0.002
"""m, at 1 m."""


@pytest.fixture(scope="module")
def recording():
    """Six views of a UR3e before a wall, by a fixed camera with depth noise that grows with the square."""
    model = load_robot("ur3e")
    rng = np.random.default_rng(3)
    joints = np.array([0.0, -1.6, 1.4, -1.2, -1.5, 0.0]) + rng.uniform(-0.6, 0.6, (VIEWS, 6))
    renderer = Renderer(RenderMesh.of(model, cell_m=0.001), K, WIDTH, HEIGHT)
    depths, masks = [], []
    for base_T_link in model.link_poses(joints, frame="base"):
        renderer.rasterise(se3.inverse(BASE_T_CAMERA) @ base_T_link)
        exact = np.minimum(renderer.depth, WALL_M)
        noisy = exact + NOISE * exact**2 * rng.normal(size=exact.shape)
        known = rng.random(exact.shape) > 0.03
        depths.append(np.where(known, np.rint(1e3 * noisy), 0).astype(np.uint16))
        masks.append(255 * (renderer.face >= 0).astype(np.uint8))
    return Recording(
        name="cell",
        mounting=Mounting.EYE_TO_HAND,
        sample_ids=tuple(f"{i:03d}" for i in range(VIEWS)),
        robot=RobotDescription(model="ur3e"),
        camera=CameraModel(WIDTH, HEIGHT, K),
        initial_parent_T_camera=se3.exp([0.05, -0.05, 0.05, 0.03, -0.03, 0.02]) @ BASE_T_CAMERA,
        base_T_flange=model.forward(joints, base="base", tip="tool0"),
        joints_rad=joints,
        depths=tuple(depths),
        masks=tuple(masks),
    )


def solved(recording, **options):
    return depth_icp(**options)(recording, rng=np.random.default_rng(0))


def tre_mm(found, truth=BASE_T_CAMERA, recording=None):
    return 1e3 * apart_m(found.pose, truth, points_in_parent(recording.base_T_flange, camera_moves=False))


def test_right_from_a_near_start_and_as_sure_as_it_says(recording):
    found = solved(recording)
    assert tre_mm(found, recording=recording) < 1.0
    twist = se3.log(BASE_T_CAMERA @ se3.inverse(found.pose))
    assert twist @ np.linalg.solve(found.covariance, twist) < 40
    assert found.diagnostics["starts"] == 1


def test_right_from_a_start_that_is_far_off(recording):
    far = se3.exp([0.0, 0.0, 0.0, 0.1, 0.12, -0.1]) @ BASE_T_CAMERA @ se3.exp([0.1, -0.12, 0.1, 0, 0, 0])
    assert tre_mm(solved(replace(recording, initial_parent_T_camera=far)), recording=recording) < 1.0


def test_right_without_a_start(recording):
    assert tre_mm(solved(replace(recording, initial_parent_T_camera=None)), recording=recording) < 1.0


def test_masks_help_and_are_asked_for(recording):
    assert tre_mm(solved(recording, silhouette=True), recording=recording) < 1.0
    with pytest.raises(Refusal, match="needs masks"):
        solved(replace(recording, masks=None), silhouette=True)


def test_the_parent_may_be_the_flange(recording):
    """A camera on the flange that looks back at the arm."""
    one = recording.subset([0])
    flange_T_camera = se3.inverse(one.base_T_flange[0]) @ BASE_T_CAMERA
    start = flange_T_camera @ se3.exp([0.03, 0, 0, 0.01, 0.01, 0])
    in_hand = replace(one, mounting=Mounting.EYE_IN_HAND, initial_parent_T_camera=start)
    assert 1e3 * se3.translation_error_m(solved(in_hand).pose, flange_T_camera) < 5.0


def test_something_before_the_robot_does_no_harm(recording):
    depths = [depth.copy() for depth in recording.depths]
    for depth in depths:
        depth[100:150, 120:170] = 500
    assert tre_mm(solved(replace(recording, depths=tuple(depths))), recording=recording) < 2.0


@pytest.mark.parametrize(
    "spoil",
    [
        lambda r: replace(r, depths=tuple(np.full((HEIGHT, WIDTH), 2500, np.uint16) for _ in r.depths)),
        lambda r: replace(r, depths=r.depths[::-1]),
        lambda r: replace(r, robot=RobotDescription(model="ur5e")),
        lambda r: replace(r, depths=tuple((depth * 0.8).astype(np.uint16) for depth in r.depths)),
    ],
    ids=["no robot", "other poses", "another robot", "another scale"],
)
def test_no_wrong_answer(recording, spoil):
    with pytest.raises(SolverFailure):
        solved(spoil(recording))


def test_one_unreadable_picture_costs_its_sample(recording, tmp_path):
    recording_io.save(recording, tmp_path / "cell")
    (tmp_path / "cell" / "depths" / "002.png").write_bytes(b"\x89PNG")
    read = recording_io.load(tmp_path / "cell")
    found = solved(read)
    assert tre_mm(found, recording=recording) < 1.0
    assert "002.png" in found.diagnostics["left_out"][0]


def test_depth_survives_the_folder(recording, tmp_path):
    recording_io.save(recording, tmp_path / "cell")
    read = recording_io.load(tmp_path / "cell")
    np.testing.assert_allclose(read.depth(0), 1e-3 * recording.depths[0], atol=1e-6)
    assert read.subset([3]).depth(0).shape == (HEIGHT, WIDTH)
    assert "depth" in read.offers()


def test_without_depth_it_refuses(recording):
    with pytest.raises(Refusal, match="no sample with joints has depth"):
        solved(replace(recording, depths=None))


@pytest.mark.parametrize(
    ("picture", "message"),
    [
        (np.zeros((HEIGHT, WIDTH), np.uint8), "8 bits"),
        (np.zeros((HEIGHT, WIDTH, 3), np.uint8), "3 channels"),
        (np.full((HEIGHT, WIDTH), 1.5, np.float32), "multiply metres by 1000"),
        (np.zeros((10, 10), np.uint16), "10x10"),
    ],
)
def test_other_pictures_are_refused(recording, picture, message, tmp_path):
    with pytest.raises(InputError, match=message):
        replace(recording, depths=(picture,) * VIEWS).depth(0)
    if picture.dtype != np.uint16:
        Image.fromarray(picture).save(tmp_path / "depth.tiff")
        with pytest.raises(InputError, match=message):
            replace(recording, depths=(tmp_path / "depth.tiff",) * VIEWS).depth(0)


@pytest.mark.parametrize(
    ("factor", "message"),
    [(1e-3, "metres"), (0.01, "decimetres"), (10.0, "tenths of a millimetre"), (0.0, "no depth")],
)
def test_check_names_other_units(recording, factor, message):
    depths = tuple((factor * depth.astype(float)).astype(np.uint16) for depth in recording.depths)
    finding = next(f for f in check(replace(recording, depths=depths, masks=None)) if f.id == "depth")
    assert finding.severity is Severity.CRITICAL
    assert message in finding.summary


def test_check_is_content_with_millimetres(recording):
    finding = next(f for f in check(replace(recording, masks=None)) if f.id == "depth")
    assert finding.severity is Severity.OK
