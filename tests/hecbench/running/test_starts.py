"""Starts in words: files, numbers, a place to look from; what is not understood names the cure."""

import json
from dataclasses import replace

import numpy as np
import pytest

from hecbench import registry, se3
from hecbench.conformance.photographs import photographs
from hecbench.errors import InputError
from hecbench.estimate import Estimate
from hecbench.recording import Mounting
from hecbench.running.starts import start_of

POSE = se3.make(se3.from_rpy([0.3, -0.2, 1.1]), np.array([1.5, -0.4, 0.8]))


@pytest.fixture
def cell(exact_rig):
    return replace(exact_rig, mounting=Mounting.EYE_TO_HAND)


def words(pose, unit="rad"):
    angles = se3.to_rpy(pose[:3, :3])
    shown = np.rad2deg(angles) if unit == "deg" else angles
    return " ".join(map(repr, [*pose[:3, 3].tolist(), *shown.tolist()])) + (" deg" if unit == "deg" else "")


@pytest.mark.parametrize("unit", ["rad", "deg"])
def test_six_numbers(cell, unit):
    np.testing.assert_allclose(start_of(words(POSE, unit), cell), POSE, atol=1e-12)


def test_commas_and_quaternions(cell):
    text = ", ".join(map(repr, [*POSE[:3, 3].tolist(), *se3.to_quat_xyzw(POSE).tolist()]))
    np.testing.assert_allclose(start_of(text, cell), POSE, atol=1e-12)


def test_a_bare_matrix_in_json(cell, tmp_path):
    for content in (POSE.tolist(), {"parent_T_camera": POSE.tolist()}, {"matrix": POSE.tolist()}):
        (tmp_path / "start.json").write_text(json.dumps(content))
        np.testing.assert_allclose(start_of(str(tmp_path / "start.json"), cell), POSE, atol=1e-12)


def test_an_estimate_must_be_of_the_mounting(cell, tmp_path):
    Estimate(POSE, mounting=cell.mounting, parent_link=cell.parent_link).save(tmp_path / "good.json")
    np.testing.assert_allclose(start_of(str(tmp_path / "good.json"), cell), POSE)
    Estimate(POSE, mounting=Mounting.EYE_IN_HAND, parent_link="flange").save(tmp_path / "other.json")
    with pytest.raises(InputError, match="the recording needs"):
        start_of(str(tmp_path / "other.json"), cell)


def test_a_camera_that_looks_at_the_robot_is_a_start_for_render_gn():
    recording = photographs()
    x, y, z = recording.truth_parent_T_camera[:3, 3]
    start = start_of(f"looking-at {x:.1f} {y:.1f} {z:.1f}", recording)
    assert np.rad2deg(se3.rotation_error_rad(start, recording.truth_parent_T_camera)) < 15
    given = replace(recording, initial_parent_T_camera=start).without_truth()
    found = registry.load().named("render_gn").factory()(given, rng=np.random.default_rng(0))
    assert se3.translation_error_m(found.parent_T_camera, recording.truth_parent_T_camera) < 0.01


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("nowhere.json", "no file that exists"),
        ("1 2 3", "3 numbers"),
        ("1500 200 800 0 0 0", "metres, not millimetres"),
        ("1 0 0 180 0 90", "end with the word deg"),
        ("1 0 0 nan 0 0", "not finite"),
        ("1 0 0 0.5 0.5 0.5 0.9", "no unit quaternion"),
        ("looking-at", "where the camera stands"),
        ("looking-at 0 0 3", "straight above"),
        ("", "0 numbers"),
    ],
)
def test_what_is_not_understood_names_the_cure(cell, text, message):
    with pytest.raises(InputError, match=message) as caught:
        start_of(text, replace(cell, base_T_flange=None, joints_rad=np.zeros((len(cell), 6))))
    assert "\n" not in str(caught.value)


@pytest.mark.parametrize("content", ["[[1, 0], [0, 1]]", '{"a": 1}', "{", "3", '[["x"]]'])
def test_files_that_hold_no_matrix(cell, tmp_path, content):
    (tmp_path / "start.json").write_text(content)
    with pytest.raises(InputError, match="4x4"):
        start_of(str(tmp_path / "start.json"), cell)


def test_a_camera_on_the_robot_looks_at_nothing_by_itself(cell):
    with pytest.raises(InputError, match="beside the robot"):
        start_of("looking-at 1 0 1", replace(cell, mounting=Mounting.EYE_IN_HAND))
