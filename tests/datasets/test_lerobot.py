"""LeRobot sets written here in their documented layouts, from lab pictures."""

import json
from pathlib import Path

import numpy as np
import pytest
from hecbench_datasets import episodes
from hecbench_datasets.formats import lerobot

from hecbench import se3
from hecbench.errors import InputError
from hecbench.estimate import Estimate, Status
from hecbench.preparation import load_recording
from hecbench.recording import Mounting
from hecbench.storage import recording_io

av = pytest.importorskip("av", reason="the extra 'lerobot' is not installed")
pyarrow = pytest.importorskip("pyarrow", reason="the extra 'lerobot' is not installed")

FPS, HELD = 10, 4
"""Frames a second, and how long the arm rests at each configuration, in frames."""
KEY = "observation.images.top"
HINTS = "robot: ur5e\ncamera: {width: 640, height: 480, K: [[600, 0, 320], [0, 600, 240], [0, 0, 1]]}\n"


@pytest.fixture(scope="module")
def lab(data):
    """Joints and pictures of a fixed camera's view of a UR5e."""
    recording = recording_io.load(data / "lit_ur5e_1_00")
    return recording.joints_rad, [recording.image(i) for i in range(len(recording))]


def rows_of(joints):
    """Joints (N, 7) of an arm that rests and moves on, with a gripper."""
    held = np.repeat(joints, HELD, axis=0)
    return np.hstack([held, np.zeros((len(held), 1))]).astype(np.float32)


def write_video(file, pictures):
    file.parent.mkdir(parents=True, exist_ok=True)
    with av.open(str(file), "w") as container:
        stream = container.add_stream("mpeg4", rate=FPS)
        stream.height, stream.width = pictures[0].shape[:2]
        stream.bit_rate = 20_000_000
        for picture in pictures:
            for packet in stream.encode(av.VideoFrame.from_ndarray(picture, format="rgb24")):
                container.mux(packet)
        for packet in stream.encode():
            container.mux(packet)


def write_table(file, columns):
    import pyarrow.parquet

    file.parent.mkdir(parents=True, exist_ok=True)
    pyarrow.parquet.write_table(pyarrow.table(columns), file)


def table(joints, index):
    state = rows_of(joints)
    return {
        "observation.state": state.tolist(),
        "timestamp": (np.arange(len(state)) / FPS).tolist(),
        "frame_index": list(range(len(state))),
        "episode_index": [index] * len(state),
    }


def write(root, told, version="v3.0"):
    """A set of episodes of (joints, pictures)."""
    names = [
        f"{n}_joint" for n in ("shoulder_pan", "shoulder_lift", "elbow", "wrist_1", "wrist_2", "wrist_3")
    ]
    v3 = version == "v3.0"
    info = {
        "codebase_version": version,
        "robot_type": "ur5e",
        "total_episodes": len(told),
        "fps": FPS,
        "chunks_size": 1000,
        "data_path": "data/chunk-{chunk_index:03d}/file-{file_index:03d}.parquet"
        if v3
        else "data/chunk-{episode_chunk:03d}/episode_{episode_index:06d}.parquet",
        "video_path": "videos/{video_key}/chunk-{chunk_index:03d}/file-{file_index:03d}.mp4"
        if v3
        else "videos/chunk-{episode_chunk:03d}/{video_key}/episode_{episode_index:06d}.mp4",
        "features": {
            "observation.state": {"dtype": "float32", "shape": [7], "names": [*names, "gripper"]},
            KEY: {"dtype": "video", "shape": [480, 640, 3]},
        },
    }
    (root / "meta").mkdir(parents=True)
    (root / "meta" / "info.json").write_text(json.dumps(info))
    (root / "hecbench-import.yaml").write_text(HINTS)
    tables = [table(joints, i) for i, (joints, _) in enumerate(told)]
    films = [[picture for picture in pictures for _ in range(HELD)] for _, pictures in told]
    if v3:
        write_table(root / info["data_path"].format(chunk_index=0, file_index=0), joined(tables))
        film = [picture for pictures in films for picture in pictures]
        write_video(root / info["video_path"].format(video_key=KEY, chunk_index=0, file_index=0), film)
        starts = np.cumsum([0, *map(len, films)])[:-1] / FPS
        episodes_table = {"episode_index": list(range(len(told))), "length": list(map(len, films))}
        parts = [f"{name}/{part}_index" for name in ("data", f"videos/{KEY}") for part in ("chunk", "file")]
        places = dict.fromkeys(parts, [0] * len(told))
        columns = {**episodes_table, **places, f"videos/{KEY}/from_timestamp": starts.tolist()}
        write_table(root / "meta" / "episodes" / "chunk-000" / "file-000.parquet", columns)
        return
    for i, (content, film) in enumerate(zip(tables, films, strict=True)):
        place = {"episode_chunk": 0, "episode_index": i}
        write_table(root / info["data_path"].format(**place), content)
        write_video(root / info["video_path"].format(video_key=KEY, **place), film)


def joined(tables):
    return {name: [value for one in tables for value in one[name]] for name in tables[0]}


@pytest.mark.parametrize("version", ["v2.1", "v3.0"])
def test_episodes_are_read_with_the_frames_of_their_joints(tmp_path, lab, sniffers, version):
    joints, pictures = lab
    root = tmp_path / "set"
    write(root, [(joints, pictures), (joints[::-1], pictures[::-1])], version)
    with pytest.raises(InputError, match="holds 2 episodes; name one"):
        load_recording(root)
    assert sniffers(root / "episode_000001") == ["lerobot"]
    for index, (expected, seen) in enumerate([(joints, pictures), (joints[::-1], pictures[::-1])]):
        recording = load_recording(root / f"episode_{index:06d}")
        assert recording.mounting is Mounting.EYE_TO_HAND
        assert recording.robot.model == "ur5e"
        assert len(recording) == len(joints)
        order = [int(np.abs(expected - row).max(1).argmin()) for row in recording.joints_rad]
        assert sorted(order) == list(range(len(joints)))
        for i, k in enumerate(order):
            assert np.abs(recording.image(i).astype(float) - seen[k]).mean() < 4


def test_a_camera_that_moves_is_refused(tmp_path, lab):
    joints, pictures = lab
    moved = [np.roll(picture, (37 * i, 90 * i), (0, 1)) for i, picture in enumerate(pictures)]
    write(tmp_path / "set", [(joints, moved)])
    with pytest.raises(InputError, match=r"observation\.images\.top moves: nothing"):
        load_recording(tmp_path / "set")


def test_damaged_and_foreign_files_end_in_one_line(tmp_path, lab):
    joints, pictures = lab
    root = tmp_path / "set"
    write(root, [(joints, pictures)])
    video = next(root.rglob("*.mp4"))
    film = video.read_bytes()
    info = (root / "meta" / "info.json").read_text()
    for change, message in (
        (lambda: video.write_bytes(film[:300]), "does not decode"),
        (lambda: video.unlink(), "does not exist"),
        (
            lambda: (root / "meta" / "info.json").write_text(info.replace("v3.0", "v9.9")),
            "codebase_version 'v9.9'",
        ),
        (
            lambda: (root / "meta" / "info.json").write_text(info.replace("videos/{", "../../x/{")),
            "leaves the set",
        ),
        (
            lambda: next(root.glob("data/*/*.parquet")).write_bytes(b"PAR1"),
            "is no readable Parquet|leaves the set",
        ),
    ):
        change()
        with pytest.raises(InputError, match=message) as caught:
            load_recording(root / "episode_000000")
        assert "\n" not in str(caught.value)
    (root / "meta" / "info.json").write_text(info)
    with pytest.raises(InputError, match="has no episode 7"):
        load_recording(root / "episode_000007")


def test_a_moved_camera_stands_out_in_the_table():
    usual = se3.from_rotvec([0.1, 2.0, 0.3], [0.9, 0.2, 0.6])
    rng = np.random.default_rng(1)
    poses = [se3.exp(rng.normal(0, 1, 6) * np.repeat([1e-3, 1e-3], 3)) @ usual for _ in range(6)]
    poses[4] = poses[4] @ se3.from_rotvec([0, 0.05, 0], [0.02, 0, 0])
    estimates = [Estimate(pose, solver="s", item=f"/x/episode_{i:06d}") for i, pose in enumerate(poses)]
    estimates.append(
        Estimate(solver="s", item="/x/episode_000006", status=Status.FAILED, reason="nothing seen")
    )
    found = episodes.compared(estimates)
    assert [one.episode for one in found if one.drifted] == ["episode_000004"]
    assert found[4].off_mm > 15
    assert found[6].reason == "nothing seen"
    assert len(episodes.rows(found)) == 7


def test_each_episode_becomes_a_recording_beside_the_set(tmp_path, lab):
    joints, pictures = lab
    root = tmp_path / "set"
    write(root, [(joints, pictures), (joints, [np.roll(p, 60 * i, 1) for i, p in enumerate(pictures)])])
    found, faults = episodes.as_recordings(root, None, tmp_path / "out", 1)
    assert [place.name for place in found] == ["episode_000000"]
    assert len(faults) == 1
    assert "moves" in faults[0]
    assert recording_io.load(found[0]).robot.model == "ur5e"


def test_frames_are_slow_and_far_apart():
    stamps = np.arange(100) / 10
    joints = np.repeat(np.linspace(0, 1, 10)[:, None], 10, 0) * np.ones((1, 6))
    rows = lerobot._chosen(joints, stamps)
    assert len(rows) == lerobot.FRAMES
    assert len(np.unique(joints[rows, 0])) == lerobot.FRAMES


WRITTEN = Path(__file__).parent / "data/lerobot_writer"
"""Two episodes of a drawn UR5e, by `LeRobotDataset.create`, `add_frame`, `save_episode` of lerobot 0.4.4 (AV1 film)."""


def test_what_the_package_itself_writes_is_read(data):
    drawn = recording_io.load(data / "lit_ur5e_1_00")
    for index in range(2):
        recording = load_recording(WRITTEN / f"episode_{index:06d}")
        np.testing.assert_allclose(recording.joints_rad, drawn.joints_rad, atol=1e-6)
        for i in range(len(drawn)):
            assert np.abs(recording.image(i).astype(float) - drawn.image(i)).mean() < 4
