"""Names that data chose are shown as text, and never name a place outside the folder that was given."""

import json
import os
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from hecbench import conformance
from hecbench.conformance.photographs import photographs
from hecbench.recording import Mounting
from hecbench.storage import recording_io

MARKUP = "[/x] cell [left] $\\foo$ <b>&amp;"


def everything_below(folder):
    """Content of every file below a folder by its path."""
    return {path: path.read_bytes() for path in sorted(Path(folder).rglob("*")) if path.is_file()}


@pytest.fixture
def cell(tmp_path, rng):
    def make(name, ids):
        work = tmp_path / "work"
        folder = work / "cell"
        recording = replace(conformance.rig(rng, Mounting.EYE_TO_HAND), name="plain")
        recording_io.save(recording, folder)
        content = json.loads((folder / "recording.json").read_text())
        content["name"] = name
        for sample, sample_id in zip(content["samples"], ids, strict=False):
            sample["id"] = sample_id
        (folder / "recording.json").write_text(json.dumps(content))
        return work

    return make


def test_markup_in_a_name_is_shown_as_it_is(hecbench, cell):
    work = cell(MARKUP, ["[bold]a[/bold]", "[/]"])
    for words in (["check", "cell"], ["solve", "cell", "--solver", "park"]):
        done = hecbench(*words, cwd=work)
        assert done.returncode == 0, done.stderr
        assert MARKUP in done.stdout
    assert hecbench("run", "cell", "--solver", "park", "--held-out", "--out", "out", cwd=work).returncode == 0
    done = hecbench("report", "out", cwd=work)
    assert done.returncode == 0, done.stderr
    page = (work / "out" / "report.html").read_text()
    assert "<b>&amp;" not in page


HOSTILE = ["../../../escaped", "/abs/escaped", "..", "a/../../b", "con\x00trol", "x" * 300, ".hidden", "a\nb"]


def test_hostile_ids_and_names_write_nothing_outside(hecbench, tmp_path):
    work = tmp_path / "deep" / "er" / "work"
    given = photographs()
    recording = replace(given, name="../../outside", sample_ids=tuple(HOSTILE[: len(given)]))
    for first in range(0, len(HOSTILE), len(given)):
        ids = HOSTILE[first : first + len(given)]
        folder = work / f"cell{first}"
        recording_io.save(replace(recording, sample_ids=tuple(ids)), folder)
        assert set(everything_below(tmp_path)) == set(everything_below(work))
        answer = work / f"answers{first}"
        done = hecbench("solve", folder, "--solver", "render_gn", "--out", answer, cwd=work)
        assert done.returncode == 0, done.stderr
        done = hecbench("render", folder, "--estimate", answer / "render_gn.json", cwd=work)
        assert done.returncode == 0, done.stderr
        done = hecbench("run", folder, "--solver", "render_gn", "--out", work / f"out{first}", cwd=work)
        assert done.returncode == 0, done.stderr
        assert hecbench("report", work / f"out{first}", cwd=work).returncode == 0
        hecbench("detect", folder, work / f"seen{first}", cwd=work)
        assert set(everything_below(tmp_path)) == set(everything_below(work))
    assert not Path("/abs").exists()


@pytest.mark.parametrize("key", ["image", "mask"])
@pytest.mark.parametrize("place", ["../secret.png", "/etc/hostname"])
def test_pictures_outside_the_folder_are_not_read(hecbench, tmp_path, key, place):
    recording_io.save(photographs(), tmp_path / "cell")
    (tmp_path / "secret.png").write_bytes((tmp_path / "cell" / "images" / "000000.png").read_bytes())
    content = json.loads((tmp_path / "cell" / "recording.json").read_text())
    content["samples"][0][key] = place
    (tmp_path / "cell" / "recording.json").write_text(json.dumps(content))
    done = hecbench("check", "cell", cwd=tmp_path)
    assert done.returncode == 2
    assert place in done.stderr
    assert len(done.stderr.strip().splitlines()) == 1


def test_robots_outside_the_folder_are_not_read(hecbench, tmp_path):
    recording_io.save(photographs(), tmp_path / "cell")
    content = json.loads((tmp_path / "cell" / "recording.json").read_text())
    for robot in ({"urdf": "../robot.urdf"}, {"model": "/etc/passwd"}, {"model": "../robot.urdf"}):
        content["robot"] = {"base_link": "base", "flange_link": "tool0", **robot}
        (tmp_path / "cell" / "recording.json").write_text(json.dumps(content))
        done = hecbench("solve", "cell", "--solver", "render_gn", cwd=tmp_path)
        assert done.returncode in (1, 2)
        assert "root:" not in done.stdout + done.stderr
        (value,) = robot.values()
        assert os.path.basename(value) in done.stderr + done.stdout


def test_trials_embed_no_foreign_picture(hecbench, tmp_path):
    np.save(tmp_path / "secret", np.zeros(1))
    (tmp_path / "x.png").write_bytes(b"secret picture")
    out = tmp_path / "out"
    out.mkdir()
    record = {
        "schema": "hecbench.trial/1", "task": "grasp", "robot": "../x", "method": "m", "calibration": "c", "place": 0,
        "clearance_mm": 1.0, "seed": 0, "outcome": "success", "reason": "", "state": "done",
    }  # fmt: skip
    (out / "trials.jsonl").write_text(json.dumps(record) + "\n")
    hecbench("report", out, cwd=tmp_path)
    page = out / "report.html"
    import base64

    assert not page.exists() or base64.b64encode(b"secret picture").decode() not in page.read_text()
