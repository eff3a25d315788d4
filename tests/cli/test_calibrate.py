"""`calibrate`: one command, one answer, and folders that the other verbs accept."""

import json
import shutil
from dataclasses import replace

import numpy as np
import pytest

from hecbench import conformance, se3
from hecbench.recording import Mounting
from hecbench.storage import recording_io


@pytest.fixture(scope="module")
def calibrated(hecbench, tmp_path_factory):
    folder = tmp_path_factory.mktemp("calibrate")
    recording = conformance.rig(np.random.default_rng(1), Mounting.EYE_TO_HAND, noise=1e-4)
    recording_io.save(recording, folder / "cell")
    done = hecbench(
        "calibrate",
        folder / "cell",
        "--out",
        folder / "out",
        "--at",
        "0.4,0,0.2",
        "--json",
        "--tolerance-mm",
        20,
    )
    return recording, done, folder / "out"


def test_the_answer_and_its_expected_error(calibrated):
    recording, done, out = calibrated
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    assert found["schema"] == "hecbench.verdict/1"
    assert found["grade"] in ("good", "usable")
    assert found == json.loads((out / "verdict.json").read_text())
    error_mm = 1e3 * se3.translation_error_m(found["parent_T_camera"], recording.truth_parent_T_camera)
    assert error_mm < 20
    expected = found["expected_error_mm"]
    assert 0 < expected["low"] < expected["value"] < expected["high"]
    assert found["expected_error_at_mm"]["value"] > 0
    assert all(estimate["errors"] is None for estimate in found["estimates"])
    assert f"report: {out / 'report.html'}" in done.stderr


def test_what_is_left_in_the_folder(calibrated):
    _, done, out = calibrated
    found = json.loads(done.stdout)
    written = {path.stem for path in out.glob("*.json")} - {"verdict"}
    assert written == {estimate["solver"] for estimate in found["estimates"]}
    exported = json.loads((out / "exports" / "json.json").read_text())
    np.testing.assert_allclose(exported["matrix"], found["parent_T_camera"])
    assert exported["camera"] == found["camera"]
    assert {"ros.sh", "urdf.urdf.xml", "moveit.launch"} <= {path.name for path in (out / "exports").iterdir()}


def test_report_and_export_accept_every_folder(hecbench, calibrated, tmp_path):
    recording, _, out = calibrated
    recording_io.save(recording, tmp_path / "cell")
    assert (
        hecbench("solve", tmp_path / "cell", "--solver", "shah", "--out", tmp_path / "solved").returncode == 0
    )
    ran = hecbench("run", tmp_path / "cell", "--solver", "shah", "--out", tmp_path / "ran")
    assert ran.returncode == 0, ran.stderr
    for folder in (out, tmp_path / "solved", tmp_path / "ran"):
        assert hecbench("report", folder).returncode == 0
        exported = hecbench("export", folder, "--to", "json")
        assert exported.returncode == 0, exported.stderr
        assert len(json.loads(exported.stdout)["matrix"]) == 4


def test_wrong_data_are_not_to_be_used(hecbench, tmp_path):
    good = conformance.rig(np.random.default_rng(1), Mounting.EYE_TO_HAND, noise=1e-3)
    recording_io.save(replace(good, base_T_flange=se3.inverse(good.base_T_flange)), tmp_path / "cell")
    done = hecbench("calibrate", tmp_path / "cell", "--out", tmp_path / "out", "--solver", "shah")
    assert done.returncode == 3
    assert "DO NOT USE" in done.stdout
    assert json.loads((tmp_path / "out" / "verdict.json").read_text())["grade"] == "do_not_use"


def test_bad_usage(hecbench, refused, tmp_path):
    refused(hecbench("calibrate", tmp_path / "nowhere"), "nowhere", "does not exist")
    refused(hecbench("calibrate", tmp_path, "--at", "1,2"), "--at 1,2")


def test_an_unreadable_image_costs_its_sample_only(hecbench, tmp_path):
    from hecbench_datasets.suites import photographs

    shutil.copytree(photographs.FOLDER, tmp_path / "cell")
    damaged, missing = (tmp_path / "cell" / "images" / name for name in ("img05.jpg", "img12.jpg"))
    damaged.write_bytes(damaged.read_bytes()[:20_000])
    missing.unlink()
    done = hecbench(
        "solve", tmp_path / "cell", "--solver", "render_gn_free", "--json", "--no-check", "--no-held-out"
    )
    assert done.returncode == 0, done.stderr
    (estimate,) = json.loads(done.stdout)
    assert len(estimate["diagnostics"]["confirmed_by_sample"]) == 10
    assert "left out" in done.stderr
    assert "img05.jpg" in done.stderr
    assert "img12.jpg" in done.stderr


def test_an_exporter_that_cannot_costs_its_own_file(hecbench, tmp_path):
    poses_alone = replace(
        conformance.rig(np.random.default_rng(1), Mounting.EYE_TO_HAND, noise=1e-4),
        camera=None,
        target=None,
        corners_px=None,
    )
    recording_io.save(poses_alone, tmp_path / "cell")
    done = hecbench("calibrate", tmp_path / "cell", "--out", tmp_path / "out", "--solver", "shah")
    assert "report: " in done.stderr, done.stderr
    assert "camera_info.yaml is not written: estimate of 'shah': holds no camera with K" in done.stderr
    assert (tmp_path / "out" / "report.html").exists()
    assert (tmp_path / "out" / "exports" / "json.json").exists()
