"""The watch on drawn footage: a camera at rest, one that moved, a hidden arm, and what is refused."""

import json
from dataclasses import replace

import numpy as np
import pytest
from click.testing import CliRunner
from hecbench_plugins.watching.command import watch as verb
from hecbench_plugins.watching.settings import WatchSettings
from hecbench_plugins.watching.state import Verdict
from hecbench_plugins.watching.watch import Watch
from scipy import ndimage

from hecbench import se3
from hecbench.errors import InputError
from hecbench.estimate import Estimate
from hecbench.lens import CameraModel
from hecbench.recording import Mounting, Recording, RobotDescription
from hecbench.rendering import Renderer, RenderMesh
from hecbench.robots.model import load_robot
from hecbench.storage import recording_io
from hecbench.workspace import apart_m, cube_corners

WIDTH, HEIGHT = 640, 480
K = np.array([[600.0, 0, 319.5], [0, 600.0, 239.5], [0, 0, 1]])
CAMERA = CameraModel(WIDTH, HEIGHT, K)
BASE_T_CAMERA = se3.looking([1.1, 0.35, 0.6], [0.05, 0.0, 0.3])
SETTINGS = WatchSettings(learn_frames=6)
LEARNED, AFTER = 9, 8


@pytest.fixture(scope="module")
def cell():
    """Draws frames: a number gives the arm's pose, another camera pose the camera's."""
    model = load_robot("ur3e")
    renderer = Renderer(RenderMesh.of(model, cell_m=0.002), K, WIDTH, HEIGHT)
    colours = np.clip(renderer.mesh.colours, 0.1, 0.9)
    rng = np.random.default_rng(4)
    room = ndimage.gaussian_filter(rng.uniform(0, 1, (HEIGHT, WIDTH, 3)), (25, 25, 0))
    room = 0.2 + 0.6 * (room - room.min()) / np.ptp(room)

    def joints(number):
        swing = np.sin(0.25 * number + np.arange(6))
        return np.array([0.0, -1.4, 1.2, -1.2, -1.5, 0.0]) + 0.3 * swing

    def frame(number, base_T_camera=BASE_T_CAMERA):
        renderer.draw(se3.inverse(base_T_camera) @ model.link_poses(joints(number), frame="base"))
        shown = np.where((renderer.face >= 0)[..., None], colours[np.maximum(renderer.part, 0)], room)
        shown = ndimage.gaussian_filter(shown, (0.7, 0.7, 0)) + rng.normal(0, 0.012, (HEIGHT, WIDTH, 1))
        return np.round(255 * np.clip(shown, 0, 1)).astype(np.uint8)

    count = LEARNED + AFTER
    recording = Recording(
        name="cell",
        mounting=Mounting.EYE_TO_HAND,
        sample_ids=tuple(f"{i:03d}" for i in range(count)),
        robot=RobotDescription(model="ur3e"),
        camera=CAMERA,
        joints_rad=np.array([joints(i) for i in range(count)]),
    )
    return recording, frame


@pytest.fixture
def estimate():
    """A calibration as they are: a millimetre off."""
    near = se3.exp([5e-4, -4e-4, 3e-4, 5e-4, 5e-4, -5e-4]) @ BASE_T_CAMERA
    return Estimate(near, solver="bundle", camera=CAMERA)


def states(watch, cell, cameras):
    recording, frame = cell
    return [
        watch.update(frame(number, camera), recording.joints_rad[number])
        for number, camera in enumerate(cameras)
    ]


def off_mm(base_T_camera, truth):
    """Rms displacement of points around the arm."""
    return 1e3 * apart_m(base_T_camera, truth, cube_corners(se3.make(np.eye(3), [0.1, 0.0, 0.3])[None]))


def at_rest(count=LEARNED):
    return [BASE_T_CAMERA] * count


def test_a_camera_at_rest_gives_no_alarm(cell, estimate):
    found = states(Watch(cell[0], estimate, SETTINGS), cell, at_rest(LEARNED + AFTER))
    assert [state.verdict for state in found[: SETTINGS.learn_frames - 1]] == [Verdict.LEARNING] * 5
    assert {state.verdict for state in found[SETTINGS.learn_frames - 1 :]} == {Verdict.TRUE}
    assert max(state.score for state in found if state.score is not None) < SETTINGS.alarm / 3
    assert found[-1].offset_mm < SETTINGS.limit_mm


@pytest.mark.parametrize(
    ("axis", "size"),
    [(0, np.deg2rad(0.3)), (1, np.deg2rad(0.3)), (2, np.deg2rad(0.6)), (3, 0.005), (4, 0.005), (5, 0.01)],
)
def test_small_moves_give_alarm(cell, estimate, axis, size):
    """A turn about the view and a shift along it show least, the more so in pictures of this size."""
    twist = np.zeros(6)
    twist[axis] = size
    moved = BASE_T_CAMERA @ se3.exp(twist)
    found = states(Watch(cell[0], estimate, SETTINGS), cell, at_rest() + [moved] * AFTER)
    assert all(state.verdict is not Verdict.MOVED for state in found[:LEARNED])
    alarm = next(state for state in found if state.verdict is Verdict.MOVED)
    assert "calibrate again" in alarm.reason
    assert off_mm(found[-1].parent_T_camera, moved) < 4.0


def test_a_bump_of_centimetres_is_found_too(cell, estimate):
    moved = BASE_T_CAMERA @ se3.exp([0.0, 0.02, 0.0, 0.01, 0.02, 0.0])
    found = states(Watch(cell[0], estimate, SETTINGS), cell, at_rest() + [moved] * 4)
    assert found[-1].verdict is Verdict.MOVED
    assert found[-1].offset_mm > 10


def test_a_camera_that_was_bumped_before_is_found_by_the_first_frames(cell, estimate):
    bumped = replace(estimate, parent_T_camera=se3.exp([0, 0, 0, 0.0, 0.008, 0.0]) @ BASE_T_CAMERA)
    found = states(Watch(cell[0], bumped, SETTINGS), cell, at_rest())
    assert found[SETTINGS.learn_frames - 1].verdict is Verdict.MOVED
    assert "already in the first frames" in found[SETTINGS.learn_frames - 1].reason


def test_a_hidden_arm_is_no_alarm(cell, estimate):
    recording, frame = cell
    watch = Watch(recording, estimate, SETTINGS)
    states(watch, cell, at_rest())
    wall = np.full((HEIGHT, WIDTH, 3), 90, np.uint8)
    for number in range(LEARNED, LEARNED + 3):
        state = watch.update(wall, recording.joints_rad[number])
        assert state.verdict is Verdict.CANNOT_SEE
        assert state.score is None
    back = watch.update(frame(LEARNED + 3), recording.joints_rad[LEARNED + 3])
    assert back.verdict is Verdict.TRUE


def test_tracking_follows_the_camera_and_says_how_surely(cell, estimate):
    moved = BASE_T_CAMERA @ se3.exp([0, 0, 0, 0.006, 0, 0])
    watch = Watch(cell[0], estimate, SETTINGS, track=True)
    found = states(watch, cell, at_rest() + [moved] * AFTER)
    assert any(state.verdict is Verdict.MOVED for state in found)
    assert watch.estimate.solver == "bundle+watch"
    assert off_mm(watch.estimate.parent_T_camera, moved) < 2.0
    assert np.linalg.eigvalsh(watch.estimate.covariance).min() > 0


def test_joint_offsets_of_the_estimate_belong_to_its_pose(cell, estimate):
    recording, frame = cell
    offset = 0.02
    with_offset = replace(estimate, extras={"shoulder_pan_joint": {"value": offset, "sigma": 1e-4}})
    watch = Watch(recording, with_offset, SETTINGS)
    shifted = recording.joints_rad - [offset, 0, 0, 0, 0, 0]
    found = [watch.update(frame(number), shifted[number]) for number in range(LEARNED)]
    assert found[-1].verdict is Verdict.TRUE


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"parent_link": "world"}, "another robot or mounting"),
        ({"camera": CameraModel(1280, 960, K)}, "1280x960"),
    ],
)
def test_an_estimate_of_another_cell_is_refused(cell, estimate, change, message):
    with pytest.raises(InputError, match=message):
        Watch(cell[0], replace(estimate, **change))


def test_frames_and_joints_that_do_not_fit_are_refused(cell, estimate):
    recording, frame = cell
    watch = Watch(recording, estimate, SETTINGS)
    with pytest.raises(InputError, match="frame 0: shape"):
        watch.update(np.zeros((48, 64, 3), np.uint8), recording.joints_rad[0])
    with pytest.raises(InputError, match="6 finite numbers"):
        watch.update(frame(0), np.full(6, np.nan))


def test_the_verb_exits_with_3_at_an_alarm(cell, estimate, tmp_path):
    recording, frame = cell
    moved = BASE_T_CAMERA @ se3.exp([0, 0, 0, 0.01, 0, 0])
    count = 28
    cameras = [BASE_T_CAMERA] * 22 + [moved] * 6
    rows = np.array([recording.joints_rad[i % len(recording)] for i in range(count)])
    images = tuple(frame(i % len(recording), camera) for i, camera in enumerate(cameras))
    filmed = replace(
        recording, sample_ids=tuple(f"{i:03d}" for i in range(count)), joints_rad=rows, images=images
    )
    recording_io.save(filmed, tmp_path / "film")
    estimate.save(tmp_path / "estimate.json")
    done = CliRunner().invoke(
        verb, [str(tmp_path / "film"), "--estimate", str(tmp_path / "estimate.json"), "--json"]
    )
    assert done.exit_code == 3, done.output
    lines = [json.loads(line) for line in done.output.splitlines()]
    assert lines[-1]["verdict"] == "moved"
    assert 22 <= lines[-1]["frame"] < 28


def test_the_verb_refuses_what_it_cannot_watch(cell, estimate, tmp_path):
    estimate.save(tmp_path / "estimate.json")
    recording_io.save(cell[0], tmp_path / "bare")
    arguments = [str(tmp_path / "bare"), "--estimate", str(tmp_path / "estimate.json")]
    for more, message in (
        ([], "needs pictures"),
        (["--camera", "lab"], "both --camera and --robot"),
        (["--out", str(tmp_path / "x.json")], "only --track"),
    ):
        done = CliRunner().invoke(verb, [*arguments, *more])
        assert isinstance(done.exception, InputError)
        assert message in str(done.exception)
