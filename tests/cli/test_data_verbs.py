"""check, import, export and detect as scripts use them."""

import json
from dataclasses import replace

import numpy as np
import pytest

from hecbench import conformance, se3
from hecbench.recording import Mounting
from hecbench.storage import recording_io


@pytest.fixture
def good():
    return conformance.rig(np.random.default_rng(1), Mounting.EYE_TO_HAND, noise=1e-4)


def test_check_is_quiet_on_a_good_recording(hecbench, good, tmp_path):
    recording_io.save(good, tmp_path / "cell")
    done = hecbench("check", tmp_path / "cell", "--json")
    assert done.returncode == 0, done.stdout
    found = json.loads(done.stdout)
    assert found["recording"] == "rig"
    assert {"id", "severity", "summary", "action", "value", "limit", "samples"} == set(found["findings"][0])


def test_check_names_inverted_poses_and_exits_3(hecbench, good, tmp_path):
    wrong = replace(good, camera_T_target=None, base_T_flange=se3.inverse(good.base_T_flange))
    recording_io.save(wrong, tmp_path / "cell")
    done = hecbench("check", tmp_path / "cell", "--json")
    assert done.returncode == 3
    critical = {f["id"] for f in json.loads(done.stdout)["findings"] if f["severity"] == "critical"}
    assert critical == {"pose_direction_or_mounting"}
    assert "invert" in hecbench("check", tmp_path / "cell").stdout


def test_import_and_export(hecbench, refused, shared, tmp_path):
    done = hecbench("import", shared / "data" / "camodocal_ur", tmp_path / "cell")
    assert done.returncode == 0, done.stderr
    assert "base_T_flange" in done.stderr
    assert len(recording_io.load(tmp_path / "cell")) == 42
    refused(
        hecbench("import", shared / "data" / "camodocal_ur", tmp_path / "cell"), "holds a recording already"
    )
    refused(hecbench("import", shared / "data" / "camodocal_ur", tmp_path / "x", "--format", "visp"))
    refused(hecbench("import", tmp_path / "nowhere", tmp_path / "x"), "nowhere")
    assert not (tmp_path / "x").exists()

    urdf = shared / "data" / "robots" / "denso_vs060" / "vs060_description" / "vs060.urdf"
    easyhec = shared / "data" / "easyhec_franka"
    refused(hecbench("import", easyhec, tmp_path / "x", "--urdf", urdf), "has no joint 'panda_joint1'")
    refused(hecbench("import", easyhec, tmp_path / "x", "--urdf", tmp_path / "no.urdf"), "no.urdf")
    assert not (tmp_path / "x").exists()

    assert (
        hecbench("solve", tmp_path / "cell", "--solver", "shah", "--no-check", "--out", tmp_path).returncode
        == 0
    )
    estimate = tmp_path / "shah.json"
    line = hecbench("export", estimate, "--to", "ros", "--child", "camera_link")
    assert "static_transform_publisher" in line.stdout
    assert "--child-frame-id camera_link" in line.stdout
    written = hecbench("export", estimate, "--to", "urdf", "--out", tmp_path / "camera.urdf.xml")
    assert written.returncode == 0
    assert "<joint" in (tmp_path / "camera.urdf.xml").read_text()
    refused(hecbench("export", estimate, "--to", "papyrus"), "papyrus", "ros")
    refused(hecbench("export", tmp_path / "cell" / "recording.json", "--to", "ros"), "recording.json")


def test_detect_writes_corners_and_pictures(hecbench, refused, shared, tmp_path):
    source = shared / "data" / "visp_franka" / "data-eye-to-hand"
    done = hecbench("detect", source, tmp_path / "cell")
    assert done.returncode == 0, done.stderr
    assert "apriltag found in 8 of 8 images" in done.stderr
    assert len(list((tmp_path / "cell" / "detections").glob("*.png"))) == 8
    assert np.isfinite(recording_io.load(tmp_path / "cell").corners_px).all()
    refused(hecbench("detect", source, tmp_path / "cell"), "holds a recording already")


def test_solve_detects_the_target_in_images(hecbench, shared):
    done = hecbench(
        "solve", shared / "data" / "visp_franka" / "data-eye-in-hand", "--solver", "park", "--json"
    )
    assert done.returncode == 3  # its target is larger than declared, which `check` finds
    assert "CRITICAL target_scale" in done.stderr
    (estimate,) = json.loads(done.stdout)
    assert estimate["mounting"] == "eye_in_hand"
    assert estimate["diagnostics"]["target_spread_mm"] == pytest.approx(4.4, rel=0.1)
    assert "chessboard found in 8 of 8 images" in done.stderr
