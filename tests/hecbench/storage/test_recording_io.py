"""The native recording folder: round trips, real data, and every kind of damage."""

import copy
import json
import os
import shutil
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from hecbench.conformance import rig
from hecbench.errors import InputError
from hecbench.recording import Mounting
from hecbench.storage import recording_io


@pytest.fixture
def folder(tmp_path, exact_rig):
    recording_io.save(exact_rig, tmp_path)
    return tmp_path


def rewrite(folder, change):
    file = folder / "recording.json"
    content = json.loads(file.read_text())
    change(content)
    file.write_text(json.dumps(content))


def test_round_trip(folder, exact_rig):
    assert recording_io.load(folder).sha256 == exact_rig.sha256
    assert recording_io.load(folder / "recording.json").sha256 == exact_rig.sha256


def test_round_trip_with_absent_values(tmp_path, exact_rig):
    corners = exact_rig.corners_px.copy()
    corners[0, 3] = np.nan
    corners[2] = np.nan
    poses = exact_rig.camera_T_target.copy()
    poses[1] = np.nan
    partial = replace(exact_rig, corners_px=corners, camera_T_target=poses)
    recording_io.save(partial, tmp_path)
    assert recording_io.load(tmp_path).sha256 == partial.sha256
    sample = json.loads((tmp_path / "recording.json").read_text())["samples"][0]
    assert sample["corners_px"][3] is None


def test_arrays_may_come_from_npz(folder, exact_rig):
    rewrite(folder, lambda c: [s.pop("corners_px") for s in c["samples"]])
    np.savez(folder / "samples.npz", corners_px=exact_rig.corners_px)
    assert recording_io.load(folder).sha256 == exact_rig.sha256


@pytest.mark.parametrize(
    ("arrays", "message"),
    [
        ({"corners_px": np.zeros((12, 30, 2))}, "stands in samples.npz too"),
        ({"nonsense": np.zeros(12)}, "unknown array 'nonsense'"),
        ({"joints_rad": np.zeros((3, 6))}, "first axis 12"),
        ({"joints_rad": np.array([["a"]] * 12)}, "expected numbers"),
        ({"joints_rad": np.array([object()] * 12)}, "no readable .npz|not a readable .npz"),
    ],
)
def test_bad_npz(folder, arrays, message):
    np.savez(folder / "samples.npz", **arrays)
    with pytest.raises(InputError, match=message):
        recording_io.load(folder)


def test_truncated_npz(folder):
    np.savez(folder / "samples.npz", joints_rad=np.zeros((12, 6)))
    content = (folder / "samples.npz").read_bytes()
    (folder / "samples.npz").write_bytes(content[: len(content) // 2])
    with pytest.raises(InputError, match=r"samples.npz"):
        recording_io.load(folder)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda c: c.update(schema="hecbench.recording/9"), r"Invalid enum value.*\$.schema"),
        (lambda c: c.update(colour="red"), "unknown field `colour`"),
        (
            lambda c: c["samples"][1].update(base_t_flange=1),
            r"unknown field `base_t_flange` - at `\$.samples",
        ),
        (lambda c: c.update(mounting="eye_on_foot"), r"\$.mounting"),
        (lambda c: c.pop("name"), "missing required field `name`"),
        (lambda c: c.update(samples=[]), "at least one"),
        (
            lambda c: c["samples"][0].update(base_T_flange=[[1, 0], [0, 1]]),
            r"samples\[0\].base_T_flange: shape",
        ),
        (lambda c: c["samples"][0].update(base_T_flange=[[1, 0, 0, 0], [0]]), "different lengths"),
        (lambda c: c["samples"][0].update(base_T_flange="near the table"), "Expected `array"),
        (lambda c: c["samples"][3].update(corners_px=[[1.0, 2.0]]), r"samples\[3\].corners_px: shape"),
        (lambda c: c["samples"][0].update(image="../secret.png"), "leaves the recording's folder"),
        (lambda c: c["samples"][0].update(image="/etc/hostname"), "leaves the recording's folder"),
        (lambda c: c["samples"][0].update(mask="a\u0000b"), r"samples\[0\].mask"),
        (lambda c: c["target"].update(kind="cube"), "Invalid value 'cube'"),
        (lambda c: c["camera"].update(K=[[1, 0, 0], [0, 1, 0], [0, 0, 1]]), "identity"),
    ],
)
def test_faults_are_one_line_with_file_key_and_value(folder, change, message):
    rewrite(folder, change)
    with pytest.raises(InputError, match=message) as caught:
        recording_io.load(folder)
    assert "recording.json" in str(caught.value)
    assert "\n" not in str(caught.value)


def test_an_image_link_that_leaves_the_folder_is_refused(folder, tmp_path_factory):
    outside = tmp_path_factory.mktemp("outside") / "x.png"
    outside.write_bytes(b"")
    (folder / "link.png").symlink_to(outside)
    rewrite(folder, lambda c: c["samples"][0].update(image="link.png"))
    with pytest.raises(InputError, match="leaves the recording's folder"):
        recording_io.load(folder)


@pytest.mark.parametrize("content", [b"", b"{", b"[1, 2]", b"\xff\xfe", b'{"schema": NaN}', b"[" * 100_000])
def test_files_that_are_not_recordings(tmp_path, content):
    (tmp_path / "recording.json").write_bytes(content)
    with pytest.raises(InputError, match=r"recording.json"):
        recording_io.load(tmp_path)


def test_missing_and_unreadable(tmp_path, folder):
    with pytest.raises(InputError, match="does not exist"):
        recording_io.load(tmp_path / "nowhere")
    shutil.rmtree(folder / "recording.json", ignore_errors=True)
    os.remove(folder / "recording.json")
    (folder / "recording.json").mkdir()
    with pytest.raises(InputError, match="cannot be read"):
        recording_io.load(folder)


def test_a_failed_save_leaves_no_half_file(tmp_path, exact_rig, monkeypatch):
    def no_space(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "fsync", no_space)
    with pytest.raises(OSError, match="No space"):
        recording_io.save(exact_rig, tmp_path)
    assert list(tmp_path.rglob("*")) == []


_BASE = None


def _valid_content():
    global _BASE
    if _BASE is None:
        with tempfile.TemporaryDirectory() as place:
            recording_io.save(
                rig(np.random.default_rng(0), Mounting.EYE_TO_HAND).subset(range(3)), Path(place)
            )
            _BASE = json.loads((Path(place) / "recording.json").read_text())
    return copy.deepcopy(_BASE)


_junk = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(-10, 10**400),
    st.floats(allow_nan=False),
    st.text(max_size=8),
    st.just([]),
    st.just({}),
    st.just([[None]]),
    st.just([1e308] * 3),
)


@settings(max_examples=1000, deadline=None, suppress_health_check=list(HealthCheck))
@given(data=st.data())
def test_broken_recordings_give_an_input_error_or_load(tmp_path_factory, data):
    """Replace, remove or add a value anywhere in a valid file: it loads or is refused in one line."""
    content = _valid_content()
    node, path = content, []
    while isinstance(node, dict | list) and node and (not path or data.draw(st.booleans())):
        key = data.draw(st.sampled_from(sorted(node) if isinstance(node, dict) else range(len(node))))
        path.append((node, key))
        node = node[key]
    parent, key = path[-1]
    action = data.draw(st.sampled_from(["replace", "remove", "add"]))
    if action == "remove":
        del parent[key]
    elif action == "add" and isinstance(parent, dict):
        parent[data.draw(st.text(max_size=5))] = data.draw(_junk)
    else:
        parent[key] = data.draw(_junk)
    folder = tmp_path_factory.mktemp("broken")
    (folder / "recording.json").write_text(json.dumps(content))
    message = ""
    try:
        recording_io.load(folder)
    except InputError as error:
        message = str(error)
    finally:
        shutil.rmtree(folder)
    assert "\n" not in message


def test_shared_recordings_load(shared):
    folders = [f for f in sorted((shared / "data").iterdir()) if recording_io.is_recording(f)]
    assert len(folders) >= 10
    for folder in folders:
        recording = recording_io.load(folder)
        assert len(recording) in (5, 40), folder
        assert recording.name == folder.name
