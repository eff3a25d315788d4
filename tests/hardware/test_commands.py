"""The verbs: a recording by one command, and every wrong word in one line."""

import json
import os
import signal
import socket
import subprocess
import sys

import numpy as np
import pytest
from click.testing import CliRunner
from hecbench_hardware.commands import controller as controller_verb
from hecbench_hardware.commands import record
from hecbench_hardware.controller_sim.server import version_of
from hecbench_hardware.kinematics import ARMS
from PIL import Image

from hecbench import se3
from hecbench.errors import InputError
from hecbench.recording import CameraModel, Mounting, Recording, RobotDescription
from hecbench.storage import recording_io
from hecbench.targets import ChessboardTarget

pytest.importorskip("rtde_receive", reason="ur-rtde has no wheel for this Python")

FAST = ("--set", "robot.time_scale=50", "--set", "robot.max_age_s=5", "--set", "robot.leniency=10")


@pytest.fixture
def cell(tmp_path, ready_pose):
    folder = tmp_path / "cell"
    description = Recording(
        name="cell",
        mounting=Mounting.EYE_IN_HAND,
        sample_ids=("0", "1"),
        robot=RobotDescription(model="ur5e"),
        camera=CameraModel(320, 240, np.array([[300.0, 0, 160], [0, 300, 120], [0, 0, 1]])),
        target=ChessboardTarget(4, 3, 0.03),
        initial_parent_T_camera=se3.make(np.eye(3), [0, 0.06, 0.04]),
        joints_rad=ready_pose + 0.1 * np.eye(6)[:2],
        base_T_flange=ARMS["ur5e"].forward(ready_pose + 0.1 * np.eye(6)[:2]),
        camera_T_target=np.stack([se3.make(np.eye(3), [0, 0, 0.5])] * 2),
    )
    recording_io.save(description, folder)
    return folder


@pytest.fixture
def invoke():
    def run(*words, **settings):
        return CliRunner().invoke(record, [str(word) for word in words], catch_exceptions=False, **settings)

    return run


def test_record_a_plan_with_images(invoke, cell, tmp_path):
    pictures = tmp_path / "pictures"
    pictures.mkdir()
    for k in range(2):
        board = np.indices((4, 5)).sum(0) % 2 * 200 + 30
        picture = np.pad(np.kron(board, np.ones((40, 40))), ((40, 40), (60 + k, 60 - k)), constant_values=255)
        Image.fromarray(picture.astype(np.uint8)).save(pictures / f"{k}.png")
    out = tmp_path / "out"
    camera = ("--camera", "images", "--set", f"camera.folder={pictures}")
    result = invoke(cell, "--out", out, *FAST, *camera, "--json")
    answer = json.loads(result.stdout)
    assert answer["samples"] == 2
    assert {finding["id"] for finding in answer["findings"]}
    assert result.exit_code in (0, 3)
    assert len(recording_io.load(out)) == 2
    assert json.loads((out / "plan.json").read_text())["motions"] == 2


def test_dry_run_writes_the_plan_and_nothing_else(invoke, cell, tmp_path):
    out = tmp_path / "out"
    result = invoke(cell, "--out", out, *FAST, "--poses", 4, "--dry-run")
    assert result.exit_code == 0
    assert result.stdout == ""
    steps = json.loads((out / "plan.json").read_text())["steps"]
    assert len(steps) == 4
    assert max(step["reached_error_rad"] for step in steps) < 1e-9
    assert [path.name for path in out.iterdir()] == ["plan.json"]


def test_a_cell_without_a_target_gets_views_of_the_robot(invoke, cell, tmp_path):
    with_target = recording_io.load(cell)
    markerless = Recording(
        name="markerless",
        mounting=Mounting.EYE_TO_HAND,
        sample_ids=("0",),
        robot=with_target.robot,
        camera=with_target.camera,
        joints_rad=with_target.joints_rad[:1],
    )
    recording_io.save(markerless, tmp_path / "markerless")
    out = tmp_path / "out"
    words = tmp_path / "markerless", "--out", out, *FAST, "--poses", 3, "--dry-run"
    with pytest.raises(InputError, match="initial_parent_T_camera"):
        invoke(*words)
    assert invoke(*words, "--init", "looking-at -1.6 -1.2 0.6").exit_code == 0
    assert json.loads((out / "plan.json").read_text())["motions"] == 3


def test_a_criterion_needs_a_number_of_poses(invoke, cell, tmp_path):
    with pytest.raises(InputError, match="say how many with --poses"):
        invoke(cell, "--out", tmp_path / "out", "--plan", "d_optimal")


def test_freedrive_on_a_simulated_arm(invoke, cell, tmp_path):
    result = invoke(cell, "--out", tmp_path / "out", *FAST, "--freedrive", input="\nq\n")
    assert "1 samples" in result.stdout


@pytest.mark.parametrize(
    ("words", "complaint"),
    [
        (("--robot", "r2d2"), "no robot is called 'r2d2'"),
        (("--camera", "eye"), "no camera is called 'eye'"),
        (("--set", "gain=3"), "camera.NAME=VALUE"),
        (("--set", "robot.colour=red"), "no option colour"),
        (("--robot", "sim_ur10e"), "was made for a ur5e"),
        (("--robot", "ur5e"), "host="),
        (("--freedrive", "--dry-run"), "--freedrive has no plan"),
        (("--poses", "4", "--init", "far away"), "is no file that exists, and not numbers"),
        (("--poses", "4", "--init", "0 0.06 40 0 0 0"), "write metres, not millimetres"),
    ],
)
def test_wrong_words_are_one_line(invoke, cell, tmp_path, words, complaint):
    fast = () if words == ("--robot", "ur5e") else FAST
    with pytest.raises(InputError, match=complaint) as caught:
        invoke(cell, "--out", tmp_path / "out", *fast, *words)
    assert "\n" not in str(caught.value)
    assert not (tmp_path / "out").exists()


def test_controller_prints_ready_and_ends_when_asked():
    process = subprocess.Popen(
        [
            sys.executable,
            "-c",
            "from hecbench_hardware.commands import controller; controller()",
            "--host",
            "127.0.2.9",
            "--software",
            "3.15.8.0",
        ],
        stdout=subprocess.PIPE,
        text=True,
    )
    assert process.stdout.readline() == "ready 127.0.2.9\n"
    with socket.create_connection(("127.0.2.9", 29999), 5) as dashboard, dashboard.makefile("rw") as lines:
        lines.readline()
        lines.write("PolyscopeVersion\n")
        lines.flush()
        assert "URSoftware 3.15.8." in lines.readline()
    os.kill(process.pid, signal.SIGINT)
    assert process.wait(5) == 0
    process.stdout.close()
    assert CliRunner().invoke(controller_verb, ["--help"]).exit_code == 0


@pytest.mark.parametrize("text", ["", "5", "5.x", "-5.11", "5.11.6.0.1", "256.1", "5.256", "5.11.123456"])
def test_a_claimed_software_that_is_no_version_is_refused(text):
    result = CliRunner().invoke(controller_verb, ["--software", text])
    assert isinstance(result.exception, InputError)
    assert "5.11.6.0" in str(result.exception)


def test_what_a_claimed_software_leaves_out_is_zero():
    assert version_of("3.15.8.0") == (3, 15, 8, 0)
    assert version_of("5.26") == (5, 26, 0, 0)
