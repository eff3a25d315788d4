"""The verb: tables and JSON, estimates checked against the cell, the real driver, one line for bad input."""

import json
import re
from base64 import b64encode
from dataclasses import replace

import numpy as np
import pytest
from click.testing import CliRunner
from hecbench_hardware.lab import cells
from hecbench_hardware.trial_commands import trial

from hecbench import se3
from hecbench.commands.cli import cli
from hecbench.errors import InputError
from hecbench.estimate import Estimate, Status
from hecbench.recording import CameraModel, Mounting
from hecbench.report import html
from hecbench.report import trials as report
from hecbench.storage import trial_record

pytest.importorskip("mujoco", reason="the contact sweep needs mujoco: pip install 'hecbench[lab]'")


@pytest.fixture
def estimate(station):
    return Estimate(
        station.camera_pose(4),
        solver="mine",
        recording="lab_ur5e_04",
        suite="lab",
        item="000004",
        level="markers",
        camera=cells.camera_model(),
    )


def test_dynamics_are_an_option_for_grasps(tmp_path):
    given = ["--offset-mm", 0, "--no-render", "--trials", 1, "--dynamics"]
    assert run("grasp", *given, "--out", tmp_path / "a").exit_code == 0
    (found,) = trial_record.read(tmp_path / "a").trials
    assert found.outcome == "success"
    assert found.provenance["dynamics"] is True
    with pytest.raises(InputError, match="contact alone"):
        run("insertion", *given, "--out", tmp_path / "b")


def run(*arguments):
    result = CliRunner().invoke(trial, [*map(str, arguments)], catch_exceptions=True)
    if isinstance(result.exception, InputError):
        raise result.exception
    return result


def test_estimate_file_is_tried_and_tables_stand_beside_the_paper(tmp_path, estimate):
    replace(estimate, solver="tsai").save(tmp_path / "tsai.json")
    wrong = replace(estimate, parent_T_camera=se3.make(np.eye(3), [0.03, 0, 0]) @ estimate.parent_T_camera)
    replace(wrong, solver="daniilidis").save(tmp_path / "daniilidis.json")
    out = tmp_path / "out"
    given = ["--estimate", tmp_path / "tsai.json", "--estimate", tmp_path / "daniilidis.json", "--no-render"]
    assert run("grasp", *given, "--out", out).exit_code == 0
    result = run("insertion", *given, "--out", out, "--resume", "--json")
    assert result.exit_code == 0
    assert {trial["method"] for trial in json.loads(result.stdout)} == {"tsai", "daniilidis"}
    trials = trial_record.read(out).trials
    success, paired = report.tables(trials)
    assert [row[:2] for row in success.rows] == [("tsai", "3/3 100.0 %"), ("daniilidis", "0/3 0.0 %")]
    assert [row[4] for row in success.rows] == ["5.6", "9.3"]
    assert paired.rows[0][:3] == ("daniilidis", "3 : 0", "0.25")
    assert all(figure.startswith("<svg") for figure in report.figures(trials))


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"mounting": Mounting.EYE_IN_HAND}, "eye_to_hand"),
        ({"parent_link": "base_link"}, "the cell in 'base'"),
        ({"camera": CameraModel(640, 480, np.array([[600.0, 0, 320], [0, 600, 240], [0, 0, 1]]))}, "another camera"),
        ({"suite": None}, "--calibration N"),
        ({"item": "000099"}, "0 to 17"),
    ],
)  # fmt: skip
def test_estimate_of_another_cell_is_refused(tmp_path, estimate, change, reason):
    replace(estimate, **change).save(tmp_path / "e.json")
    with pytest.raises(InputError, match=reason):
        run("grasp", "--estimate", tmp_path / "e.json", "--no-render", "--out", tmp_path / "out")
    assert not (tmp_path / "out").exists()


def test_estimate_without_an_answer_is_named(tmp_path, estimate):
    refused = replace(estimate, parent_T_camera=None, status=Status.REFUSED, reason="one axis only")
    refused.save(tmp_path / "e.json")
    with pytest.raises(InputError, match="no calibration to try"):
        run("grasp", "--estimate", tmp_path / "e.json", "--no-render", "--out", tmp_path / "out")


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        ([], "either --estimate FILE or --offset-mm"),
        (["--offset-mm", 0, "--station", "vs060"], "needs its URDF"),
        (["--offset-mm", 0, "--size", "big"], "WIDTHxHEIGHT"),
        (["--estimate", "absent.json"], "does not exist"),
        (["--offset-mm", 0, "--robot", "ur5e"], "--camera and --gripper"),
    ],
)
def test_bad_usage_is_one_line(tmp_path, arguments, reason):
    with pytest.raises(InputError, match=reason):
        run("grasp", *arguments, "--no-render", "--out", tmp_path / "out")


def test_trials_over_the_real_driver(tmp_path):
    pytest.importorskip("rtde_control", reason="the driver needs ur-rtde: pip install 'hecbench[ur]'")
    arguments = ["--offset-mm", 0, "--robot", "sim_ur5e", "--set", "robot.time_scale=50", "--trials", 3]
    result = run("insertion", *arguments, "--no-render", "--out", tmp_path)
    assert result.exit_code == 0, result.output
    trials = trial_record.read(tmp_path).trials
    assert [trial.outcome for trial in trials] == ["success"] * 3


def test_trial_with_pictures(tmp_path):
    from hecbench_hardware.lab.gl import open_context

    from hecbench.errors import HecbenchError

    try:
        open_context(16, 16).free()
    except HecbenchError as error:
        pytest.skip(str(error))
    arguments = ["--offset-mm", 0, "--size", "1224x1024", "--trials", 1, "--noise", 2]
    assert run("grasp", *arguments, "--out", tmp_path).exit_code == 0
    (found,) = trial_record.read(tmp_path).trials
    assert found.outcome == "success"
    assert 0 < found.tag_error_mm < 5
    grasp = (tmp_path / "ur5e_grasp.png").read_bytes(), (tmp_path / "ur5e_grasp.gif").read_bytes()
    assert [picture[:4] for picture in grasp] == [b"\x89PNG", b"GIF8"]
    text = html.write(tmp_path).path.read_text()
    assert [b64encode(picture).decode() in text for picture in grasp] == [True, True]
    assert not re.findall(r'(?:src|href)="(?!data:|#)', text)


def test_report_of_trials_alone_counts_them(tmp_path):
    assert run("grasp", "--offset-mm", 0, "--no-render", "--trials", 2, "--out", tmp_path).exit_code == 0
    assert CliRunner().invoke(cli, ["report", str(tmp_path)]).output.strip().endswith("report.html: 2 trials")
    printed = json.loads(CliRunner().invoke(cli, ["report", str(tmp_path), "--json"]).stdout)
    assert (printed["results"], printed["trials"], printed["damage"]) == (0, 2, [])
    text = html.write(tmp_path).path.read_text()
    assert "2 trials of 1 calibration method." in text
    for words in (
        "<dt>libraries</dt><dd>",
        "numpy ",
        "<dt>seeds</dt><dd>0</dd>",
        "<dt>robot of the trials</dt><dd>lab",
    ):
        assert words in text
