"""The command line as scripts use it: stdout, exit codes, and one-line errors."""

import json
import os
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from hecbench import conformance, se3
from hecbench.recording import Mounting
from hecbench.storage import recording_io

HECBENCH = Path(sys.executable).parent / "hecbench"


@pytest.fixture
def cell(tmp_path):
    recording = conformance.rig(np.random.default_rng(1), Mounting.EYE_IN_HAND, noise=1e-3)
    recording_io.save(recording, tmp_path / "cell")
    return tmp_path / "cell"


def test_solve_prints_json_best_first_and_writes_files(hecbench, cell, tmp_path):
    done = hecbench("solve", cell, "--json", "--out", tmp_path / "answers")
    assert done.returncode == 0, done.stderr
    estimates = json.loads(done.stdout)
    assert {"tsai", "park", "horaud", "andreff", "daniilidis", "shah", "li"} <= {
        e["solver"] for e in estimates
    }
    errors = [e["errors"]["tre_mm"] for e in estimates if e["errors"]]
    assert errors == sorted(errors)
    assert estimates[0]["mounting"] == "eye_in_hand"
    assert estimates[0]["parent_link"] == "flange"
    written = json.loads((tmp_path / "answers" / f"{estimates[0]['solver']}.json").read_text())
    assert written == estimates[0]
    assert written["provenance"]["command"].startswith("hecbench solve")


def test_solve_with_named_solver_views_and_start(hecbench, cell, tmp_path):
    assert hecbench("solve", cell, "--solver", "shah", "--out", tmp_path).returncode == 0
    done = hecbench(
        "solve", cell, "--solver", "shah", "--views", 6, "--init", tmp_path / "shah.json", "--json"
    )
    (estimate,) = json.loads(done.stdout)
    assert estimate["diagnostics"]["samples"] == 6
    text = hecbench("solve", cell, "--solver", "shah").stdout
    assert "flange_T_camera by shah" in text


def test_a_named_solver_without_an_answer_exits_1(hecbench, tmp_path):
    still = conformance.rig(np.random.default_rng(1), Mounting.EYE_TO_HAND, rotations=np.zeros((8, 3)))
    recording_io.save(still, tmp_path / "still")
    done = hecbench("solve", tmp_path / "still", "--solver", "park", "--json", "--no-check")
    assert done.returncode == 1
    (estimate,) = json.loads(done.stdout)
    assert estimate["status"] == "refused"
    assert "hardly rotates" in estimate["reason"]


def test_a_critical_finding_is_printed_first_and_exits_3(hecbench, tmp_path):
    """Inverted robot poses: most methods give an answer, which is not to be used."""
    good = conformance.rig(np.random.default_rng(1), Mounting.EYE_TO_HAND, noise=1e-3).without_truth()
    inverted = replace(good, base_T_flange=se3.inverse(good.base_T_flange))
    recording_io.save(inverted, tmp_path / "cell")
    done = hecbench("solve", tmp_path / "cell", "--solver", "shah", "--json")
    assert done.returncode == 3
    assert json.loads(done.stdout)[0]["solver"] == "shah"
    assert "CRITICAL pose_direction_or_mounting" in done.stderr
    text = hecbench("solve", tmp_path / "cell", "--solver", "shah").stdout
    assert "DO NOT USE base_T_camera by shah" in text or "│ failed" in text
    unchecked = hecbench("solve", tmp_path / "cell", "--solver", "shah", "--no-check")
    assert "CRITICAL" not in unchecked.stderr
    ran = hecbench("run", tmp_path / "cell", "--solver", "shah", "--out", tmp_path / "out")
    assert ran.returncode == 3
    assert "CRITICAL pose_direction_or_mounting" in ran.stderr


def rewrite(cell, change):
    content = json.loads((cell / "recording.json").read_text())
    change(content)
    (cell / "recording.json").write_text(json.dumps(content))


def test_bad_input_is_one_line_and_exit_2(hecbench, refused, cell, tmp_path):
    refused(hecbench("solve", tmp_path / "nowhere"), "nowhere", "does not exist")
    refused(hecbench("solve", tmp_path), "cell/recording.json", "nearest")
    refused(hecbench("solve", cell, "--solver", "tasi"), "tasi", "choose one of")
    refused(hecbench("solve", cell, "--solver", "shah", "--segmenter", "no_such"), "no_such", "choose one of")
    refused(hecbench("solve", cell, "--views", 99), "--views 99")
    (tmp_path / "junk.json").write_text("{}")
    refused(hecbench("solve", cell, "--init", tmp_path / "junk.json"), "junk.json")
    refused(hecbench("run", "nothing_such"), "nothing_such")
    refused(hecbench("run", "markers", "--level", "tag_9m"), "tag_9m", "tag_2m")
    refused(hecbench("run", cell, "--level", "tag_2m"), "--level")
    refused(hecbench("report", tmp_path), "estimates.jsonl")
    refused(hecbench("conformance", "tasi"), "tasi")
    refused(hecbench("plugins", "--kind", "toaster"), "toaster")
    rewrite(cell, lambda c: c["samples"][2].update(base_T_flange=[[1, 2], [3, 4]]))
    refused(hecbench("solve", cell), "recording.json", "samples[2].base_T_flange")
    (cell / "recording.json").write_text('{"schema": ')
    refused(hecbench("solve", cell), "recording.json")


def test_usage_errors_exit_2(hecbench):
    assert hecbench("solve").returncode == 2
    assert hecbench("frobnicate").returncode == 2
    assert hecbench("solve", "x", "--seed", "-1").returncode == 2


def test_images_are_not_needed_unless_a_solver_needs_them(hecbench, cell):
    rewrite(cell, lambda c: [s.update(image=f"images/{s['id']}.png") for s in c["samples"]])
    assert hecbench("solve", cell, "--solver", "park").returncode == 0
    (cell / "images").mkdir()
    (cell / "images" / "000000.png").write_bytes(b"not a picture")
    assert hecbench("solve", cell, "--solver", "park").returncode == 0


def test_run_report_and_resume(hecbench, refused, cell, tmp_path):
    out = tmp_path / "out"
    arguments = ("run", "markers", "--level", "board_2m", "--samples", 3, "--solver", "park", "--out", out)
    first = hecbench(*arguments, "--json")
    assert first.returncode == 0, first.stderr
    estimates = json.loads(first.stdout)
    assert [(e["suite"], e["level"], e["item"]) for e in estimates] == [
        ("markers", "board_2m", f"{i:06d}") for i in range(3)
    ]
    refused(hecbench(*arguments), "--resume")
    again = hecbench(*arguments, "--resume", "--json")
    assert json.loads(again.stdout) == estimates
    more = hecbench("run", cell, "--solver", "shah", "--out", out, "--resume", "--jobs", 2, "--held-out")
    assert more.returncode == 0, more.stderr
    assert "held-out px" in more.stdout
    done = hecbench("report", out, "--json")
    assert json.loads(done.stdout)["results"] == 4
    assert "markers: board_2m" in (out / "report.html").read_text()


def test_a_killed_run_goes_on_where_it_was(hecbench, tmp_path):
    """kill -9 at some moment: what is written is whole, and --resume completes the run without doubles."""
    out = tmp_path / "out"
    arguments = [
        "run",
        "markers",
        "--level",
        "tag_2m",
        "--samples",
        "150",
        "--solver",
        "shah",
        "--out",
        str(out),
    ]
    process = subprocess.Popen([HECBENCH, *arguments], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    store = out / "estimates.jsonl"
    deadline = time.monotonic() + 60
    while not (store.exists() and store.stat().st_size > 20_000) and time.monotonic() < deadline:
        time.sleep(0.005)
    os.kill(process.pid, signal.SIGKILL)
    process.wait()
    partial = store.read_bytes().count(b"\n")
    assert partial > 0
    resumed = hecbench(*arguments, "--resume", "--json")
    items = [e["item"] for e in json.loads(resumed.stdout)]
    assert sorted(items) == [f"{i:06d}" for i in range(150)]


def test_plugins_and_doctor(hecbench):
    listed = json.loads(hecbench("plugins", "--kind", "solver", "--json").stdout)
    park = next(row for row in listed if row["name"] == "park")
    assert park["status"] == "ready"
    assert park["needs"] == ["target_poses"]
    assert set(park) == {"name", "kind", "status", "needs", "detail", "distribution", "version"}
    states = {row["subject"]: row["state"] for row in json.loads(hecbench("doctor", "--json").stdout)}
    assert states["numpy"] == "ok"
    assert states["cv2.calibrateHandEye"] == "ok"


def test_conformance_verb(hecbench):
    done = hecbench("conformance", "shah", "--json")
    assert done.returncode == 0
    assert all(check["passed"] for check in json.loads(done.stdout))


def test_help_imports_nothing_heavy():
    code = (
        "import sys; sys.argv = ['hecbench', '--help']\n"
        "from hecbench.commands.cli import main\n"
        "try:\n    main()\nexcept SystemExit:\n    pass\n"
        "heavy = {'numpy', 'scipy', 'cv2', 'torch', 'matplotlib', 'numba', 'mujoco'} & set(sys.modules)\n"
        "assert not heavy, heavy"
    )
    assert subprocess.run([sys.executable, "-c", code], capture_output=True, check=False).returncode == 0


def test_listing_plugins_imports_nothing_heavy():
    code = (
        "import sys\nfrom hecbench import registry\nregistry.load()\n"
        "heavy = {'torch', 'mujoco', 'matplotlib', 'rtde_control', 'cv2', 'numba', 'scipy', 'trimesh'}\n"
        "heavy &= set(sys.modules)\n"
        "assert not heavy, heavy"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def test_the_answer_is_the_transform_that_was_measured(hecbench, tmp_path):
    recording = conformance.rig(np.random.default_rng(5), Mounting.EYE_TO_HAND)
    recording_io.save(recording.without_truth(), tmp_path / "cell")
    estimates = json.loads(hecbench("solve", tmp_path / "cell", "--solver", "park", "--json").stdout)
    found = np.array(estimates[0]["parent_T_camera"])
    assert se3.translation_error_m(found, recording.truth_parent_T_camera) < 1e-6
    assert estimates[0]["held_out"]["target_mm"] < 1e-3
