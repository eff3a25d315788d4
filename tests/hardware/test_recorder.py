"""Recordings from a robot and a camera: complete, resumable, and never half-written."""

import json
import threading
from dataclasses import replace

import numpy as np
import pytest
from hecbench_hardware.cameras.images import ImageFolder
from hecbench_hardware.clearance import check_motion
from hecbench_hardware.devices import DeviceFault, Fault
from hecbench_hardware.kinematics import ARMS
from hecbench_hardware.limits import Box, Limits
from hecbench_hardware.motions import JointMotion
from hecbench_hardware.recorder.plan import check_plan, dry_run, write_plan
from hecbench_hardware.recorder.poses import Criterion, View, diverse_plan, informative_plan
from hecbench_hardware.recorder.record import Recorder
from hecbench_hardware.recorder.session import FILE_NAME
from PIL import Image

from hecbench import se3
from hecbench.errors import HecbenchError, InputError
from hecbench.next_view import RobotView
from hecbench.recording import CameraModel, Mounting, Recording, RobotDescription
from hecbench.storage import recording_io
from hecbench.targets import AprilTagTarget

pytest.importorskip("rtde_receive", reason="ur-rtde has no wheel for this Python")

ARM = ARMS["ur5e"]
K = np.array([[600.0, 0, 320], [0, 600, 240], [0, 0, 1]])


@pytest.fixture(params=list(Mounting))
def cell(request, ready_pose):
    """A rough cell: the tag is seen from 0.6 m in the first sample."""
    seen = se3.make(se3.so3_exp([0.1, 0.2, 0.3]), [0.02, -0.03, 0.6])
    base_T_flange = ARM.forward(ready_pose)
    if request.param is Mounting.EYE_IN_HAND:
        parent_T_camera = se3.make(np.eye(3), [0.0, 0.06, 0.04])
    else:
        flange_T_target = se3.make(se3.so3_exp([0, np.pi / 2, 0]), [0.05, 0, 0.1])
        parent_T_camera = base_T_flange @ flange_T_target @ se3.inverse(seen)
    return Recording(
        name="cell",
        mounting=request.param,
        sample_ids=("seed",),
        robot=RobotDescription(model="ur5e"),
        camera=CameraModel(640, 480, K),
        target=AprilTagTarget("tag36h11", 0, 0.1),
        initial_parent_T_camera=parent_T_camera,
        joints_rad=ready_pose[None],
        camera_T_target=seen[None],
    )


@pytest.fixture
def plan(ready_pose):
    joints = ready_pose + 0.1 * np.eye(6)[:4]
    return Recording(
        name="plan",
        mounting=Mounting.EYE_IN_HAND,
        sample_ids=("a", "b", "c", "d"),
        joints_rad=joints,
        camera=CameraModel(64, 48, K),
        target=AprilTagTarget("tag36h11", 0, 0.1),
    )


@pytest.fixture
def camera(tmp_path):
    folder = tmp_path / "pictures"
    folder.mkdir()
    for k in range(8):
        Image.fromarray(np.full((48, 64, 3), 10 * k, np.uint8)).save(folder / f"{k}.png")
    return ImageFolder(folder)


def yes(line):
    return True


def test_drive_writes_a_recording_that_loads(robot, camera, plan, tmp_path):
    lines = []
    out = tmp_path / "out"
    Recorder(robot, camera, plan, out, frames=2, report=lines.append).drive()
    recording = recording_io.load(out)
    assert recording.sample_ids == plan.sample_ids
    assert recording.joints_rad == pytest.approx(plan.joints_rad, abs=1e-9)
    assert recording.base_T_flange == pytest.approx(ARM.forward(plan.joints_rad), abs=1e-9)
    assert np.abs(recording.robot_stamp_s - recording.camera_stamp_s).max() < 2
    assert recording.image(1)[0, 0, 0] == 25, "the mean of the frames 20 and 30"
    assert recording.robot.model == "ur5e"
    assert recording.robot.joint_names[0] == "shoulder_pan_joint"
    diary = [json.loads(line) for line in (out / FILE_NAME).read_text().splitlines()]
    assert diary[0]["robot"]["serial_number"].isdigit()
    assert diary[0]["robot"]["flange_T_tcp"]
    assert diary[1]["kinematics_gap_mm"] < 1e-6
    assert diary[1]["image_change"] == 10
    assert len(lines) == 4


def test_a_run_goes_on_where_it_ended(robot, camera, plan, tmp_path, controller):
    out = tmp_path / "out"
    short = ImageFolder(camera.folder)
    short._files = short._files[:2]
    with pytest.raises(DeviceFault, match="all 2 images") as caught:
        Recorder(robot, short, plan, out).drive()
    assert caught.value.fault is Fault.CAMERA
    assert np.abs(robot.state().joint_speeds_rad_s).max() == 0
    assert not (out / "recording.json").exists()
    with (out / FILE_NAME).open("ab") as diary:
        diary.write(b'{"id": "c", "joints_rad": [0.')
    lines = []
    Recorder(robot, camera, plan, out, report=lines.append).drive()
    assert [line.split()[0] for line in lines] == ["3/4", "4/4"]
    assert len(recording_io.load(out)) == 4
    assert not [path for path in out.rglob(".*")]


def test_a_fault_is_acknowledged_once_and_the_pose_repeated(robot, plan, tmp_path, controller):
    asked = []
    actor = threading.Timer(0.15, controller.fault, ("protective_stop",))
    actor.start()
    recording = Recorder(
        robot, None, plan, tmp_path / "out", acknowledge=lambda line: not asked.append(line)
    ).drive()
    actor.join()
    assert len(recording) == 4
    assert recording.images is None
    assert len(asked) <= 1


def test_without_the_operators_word_the_run_ends(robot, plan, tmp_path, controller):
    controller.fault("push 120")
    with pytest.raises(DeviceFault):
        Recorder(robot, None, plan, tmp_path / "out").drive()


def test_follow_hand(robot, camera, plan, tmp_path, controller, ready_pose):
    def more(count):
        if count < 2:
            controller.fault("hand " + " ".join(map(str, ready_pose + 0.1 * count)))
        return count < 2

    recording = Recorder(robot, camera, plan, tmp_path / "out").follow_hand(more)
    assert recording.sample_ids == ("000000", "000001")
    robot.move_joints(ready_pose)


def test_nothing_recorded_by_hand(robot, plan, tmp_path):
    with pytest.raises(InputError, match="no sample"):
        Recorder(robot, None, plan, tmp_path / "out").follow_hand(lambda count: False)


def test_bad_folders(robot, plan, tmp_path):
    busy = tmp_path / "busy"
    busy.mkdir()
    (busy / "thesis.tex").write_text("precious")
    with pytest.raises(InputError, match="not empty"):
        Recorder(robot, None, plan, busy)
    Recorder(robot, None, plan, tmp_path / "begun")
    with pytest.raises(InputError, match="another plan"):
        Recorder(robot, None, replace(plan, joints_rad=plan.joints_rad + 0.1), tmp_path / "begun")
    (tmp_path / "begun" / FILE_NAME).write_text("nonsense\n")
    with pytest.raises(InputError, match="choose another --out"):
        Recorder(robot, None, plan, tmp_path / "begun")
    with pytest.raises(HecbenchError, match="cannot be made"):
        Recorder(robot, None, plan, busy / "thesis.tex" / "out")
    with pytest.raises(InputError, match="at least one frame"):
        Recorder(robot, None, plan, tmp_path / "none", frames=0)


def test_frames_of_different_sizes(robot, camera, plan, tmp_path):
    Image.fromarray(np.zeros((10, 10, 3), np.uint8)).save(camera.folder / "1.png")
    with pytest.raises(DeviceFault, match="different sizes"):
        Recorder(robot, camera, plan, tmp_path / "out", frames=2).drive()


def test_dry_run_checks_drives_and_writes(plan, ready_pose, tmp_path):
    steps = dry_run(ARM, plan, ready_pose, Limits())
    assert [step.id for step in steps] == list(plan.sample_ids)
    assert max(step.reached_error_rad for step in steps) < 1e-9
    write_plan(steps, tmp_path / "plan.json")
    written = json.loads((tmp_path / "plan.json").read_text())
    assert written["motions"] == 4
    assert written["expected_s"] == pytest.approx(sum(step.expected_s for step in steps))
    assert written["largest_rotation_deg"] > 5


def test_check_plan_names_the_sample(plan, ready_pose):
    flange = ARM.forward(plan.joints_rad[2])[:3, 3]
    box = Box(tuple(flange - 0.02), tuple(flange + 0.02))
    with pytest.raises(InputError, match="sample"):
        check_plan(ARM, plan, ready_pose, Limits(keep_out=(box,)))
    with pytest.raises(InputError, match="six joints_rad"):
        check_plan(
            ARM,
            replace(plan, joints_rad=None, base_T_flange=ARM.forward(plan.joints_rad)),
            ready_pose,
            Limits(),
        )


def test_diverse_plan(cell, ready_pose):
    limits = Limits()
    planned = diverse_plan(cell, ARM, limits, 12, np.random.default_rng(0))
    again = diverse_plan(cell, ARM, limits, 12, np.random.default_rng(0))
    assert np.array_equal(planned.joints_rad, again.joints_rad)
    assert np.array_equal(planned.joints_rad[0], ready_pose)
    for start, end in zip(planned.joints_rad, planned.joints_rad[1:], strict=False):
        check_motion(ARM, JointMotion(ARM, start, end), limits)

    def hands(joints):
        poses = ARM.forward(joints)
        return poses if cell.mounting is Mounting.EYE_TO_HAND else se3.inverse(poses)

    carrier_T_target = se3.inverse(hands(ready_pose)) @ cell.initial_parent_T_camera @ cell.camera_T_target[0]
    camera_T_target = se3.inverse(cell.initial_parent_T_camera) @ hands(planned.joints_rad) @ carrier_T_target
    points = se3.transform_points(camera_T_target, cell.target.points_m) @ K.T
    px = points[..., :2] / points[..., 2:]
    assert (points[..., 2] > 0).all()
    assert (px[1:] > 0).all()
    assert (px[1:] < [640, 480]).all()
    assert np.degrees(np.arccos(np.abs(camera_T_target[1:, 2, 2]))).max() < np.degrees(View().tilt_rad) + 1e-6

    turns = se3.so3_log(planned.base_T_flange[0, :3, :3].T @ planned.base_T_flange[1:, :3, :3])
    spread = np.linalg.svd(turns, compute_uv=False)
    assert spread[2] / spread[0] > 0.2, "the rotations span all three axes"


@pytest.mark.parametrize("missing", ["camera", "target", "initial_parent_T_camera", "camera_T_target"])
def test_diverse_plan_says_what_the_cell_lacks(cell, missing):
    with pytest.raises(InputError, match=missing):
        diverse_plan(replace(cell, **{missing: None}), ARM, Limits(), 5, np.random.default_rng(0))


def test_diverse_plan_refuses_what_cannot_be_reached(cell, ready_pose):
    flange = ARM.forward(ready_pose)[:3, 3]
    tight = Limits(workspace=Box(tuple(flange - 0.2), tuple(flange + 0.2)))
    with pytest.raises(InputError, match="of 40 poses"):
        diverse_plan(cell, ARM, tight, 40, np.random.default_rng(0))


@pytest.fixture
def markerless(ready_pose):
    """A camera 1.8 m before the arm that sees all of it, and no target."""
    eye, aim = np.array([-1.6, -1.2, 0.6]), np.array([-0.2, -0.1, 0.35])
    forward = (aim - eye) / np.linalg.norm(aim - eye)
    right = np.cross(forward, [0, 0, 1]) / np.linalg.norm(np.cross(forward, [0, 0, 1]))
    rotation = np.stack([right, np.cross(forward, right), forward], 1)
    return Recording(
        name="markerless",
        mounting=Mounting.EYE_TO_HAND,
        sample_ids=("seed",),
        robot=RobotDescription(model="ur5e"),
        camera=CameraModel(640, 480, K),
        initial_parent_T_camera=se3.make(rotation, eye),
        joints_rad=ready_pose[None],
    )


@pytest.mark.parametrize("criterion", list(Criterion))
def test_informative_plan(markerless, ready_pose, criterion):
    limits = Limits()
    planned = informative_plan(markerless, ARM, limits, 5, np.random.default_rng(0), criterion)
    again = informative_plan(markerless, ARM, limits, 5, np.random.default_rng(0), criterion)
    assert np.array_equal(planned.joints_rad, again.joints_rad)
    assert np.array_equal(planned.joints_rad[0], ready_pose)
    assert len(planned) == 5
    for start, end in zip(planned.joints_rad, planned.joints_rad[1:], strict=False):
        check_motion(ARM, JointMotion(ARM, start, end), limits)
    view = RobotView(markerless)
    for joints in planned.joints_rad[1:]:
        assert view.look(joints, markerless.initial_parent_T_camera).in_view >= 0.6


@pytest.mark.parametrize("missing", ["camera", "robot", "initial_parent_T_camera"])
def test_informative_plan_says_what_the_cell_lacks(markerless, missing):
    with pytest.raises(InputError, match=missing):
        informative_plan(replace(markerless, **{missing: None}), ARM, Limits(), 5, np.random.default_rng(0))


def test_informative_plan_refuses_what_cannot_be_reached(markerless, ready_pose):
    flange = ARM.forward(ready_pose)[:3, 3]
    tight = Limits(workspace=Box(tuple(flange - 0.19), tuple(flange + 0.19)))
    with pytest.raises(InputError, match="of 40 poses can be reached"):
        informative_plan(markerless, ARM, tight, 40, np.random.default_rng(0))
