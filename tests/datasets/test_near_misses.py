"""Tables and stamps as people write them: read as they were meant, or the one thing that differs is named."""

import ast
import re

import numpy as np
import pytest
from hecbench_datasets.reading.streams import clock_units
from scipy.spatial.transform import Rotation

from hecbench import se3
from hecbench.errors import InputError
from hecbench.exchange.conventions import prove
from hecbench.exchange.pose_numbers import VENDORS, pose_conventions
from hecbench.preparation import load_recording
from hecbench.recording import Mounting

CASES = {
    "table_centimetres": "in cm",
    "table_counter_column": "euler_ZYX in mm",
    "table_decimal_comma": "euler_ZYX in mm",
    "table_header_wxyz": "camera_T_target rotvec",
    "table_rotation_first": "rotation first",
    "stamps_ms": "stamps read in ms",
    "same_stamps_latency": "a lag of 0.120 s",
}


@pytest.mark.parametrize("name", CASES)
def test_cases_from_public_reports(shared, spread, name):
    folder = shared / "cases" / "marker" / name
    recording = load_recording(folder)
    truth = np.array(ast.literal_eval(re.search(r"= (\[\[.*\]\])", (folder / "README").read_text())[1]))
    assert recording.mounting is Mounting.EYE_IN_HAND
    assert CASES[name] in " ".join(recording.notes)
    assert 1e3 * se3.translation_error_m(truth, spread(recording)[2]) < 1.5


def test_one_axis_keeps_what_is_documented(shared):
    recording = load_recording(shared / "cases" / "marker" / "one_axis_convention")
    assert "base_T_flange matrix in m, camera_T_target matrix in m; one axis" in recording.notes[0]


@pytest.fixture
def pair(cell):
    """base_T_flange and camera_T_target of a fixed camera."""
    robot, target, _ = cell(False, count=12)
    return robot, target


def about_one_axis(count=10):
    rng = np.random.default_rng(2)
    angles = np.outer(rng.uniform(-1, 1, count), [0, 0, 1])
    robot = se3.from_rotvec(angles, rng.normal([0.5, 0, 0.3], 0.1, (count, 3)))
    X, Y = se3.from_rotvec([[0.3, 2.0, 1.0], [1.0, 0.2, 0.3]], [[0.1, 0, 0], [0.9, 0.2, 0.1]])
    return robot, se3.inverse(X) @ se3.inverse(robot) @ Y


def test_one_axis_without_a_documented_reading_is_refused():
    robot, target = about_one_axis()
    streams = pose_conventions(robot, ("base", "flange")), pose_conventions(target, ("camera", "target"))
    with pytest.raises(InputError, match="one axis of rotation proves no convention"):
        prove("x", *streams, list(Mounting))
    proof = prove("x", *streams, [Mounting.EYE_IN_HAND])
    np.testing.assert_allclose(proof.base_T_flange, robot)


def rows(poses):
    return np.hstack([poses[:, :3, 3], se3.so3_log(poses[:, :3, :3])])


def text(table, separator=","):
    return "\n".join(separator.join(f"{value:.9f}" for value in row) for row in table) + "\n"


def check(folder, pair):
    recording = load_recording(folder)
    assert recording.mounting is Mounting.EYE_TO_HAND
    np.testing.assert_allclose(recording.base_T_flange, pair[0], atol=1e-6)
    np.testing.assert_allclose(recording.camera_T_target, pair[1], atol=1e-6)
    return recording


def test_matrices_below_each_other(tmp_path, pair):
    (tmp_path / "robot.txt").write_text("\n".join(text(pose, " ") for pose in pair[0]))
    (tmp_path / "target.txt").write_text("".join(text(pose[:3], "\t") for pose in pair[1]))
    check(tmp_path, pair)


def test_matrices_as_numpy_prints_them(tmp_path, pair):
    with np.printoptions(precision=9, suppress=True):
        for name, poses in zip(("robot", "target"), pair, strict=True):
            (tmp_path / f"{name}.txt").write_text("\n".join(map(str, poses)))
            assert "[[" in (tmp_path / f"{name}.txt").read_text()
    check(tmp_path, pair)


@pytest.mark.parametrize("cells", [["nan"] * 6, [""] * 6])
def test_a_row_without_a_pose_is_named(tmp_path, pair, cells):
    lines = text(rows(pair[1])).splitlines()
    lines[4] = ",".join(cells)
    (tmp_path / "robot.csv").write_text(text(rows(pair[0])))
    (tmp_path / "target.csv").write_text("\n".join(lines))
    with pytest.raises(InputError, match=r"row 5 holds no pose.*delete it, and the row that belongs to it"):
        load_recording(tmp_path)


def test_one_file_with_hand_and_eye_rows(tmp_path, pair):
    lines = [
        f"{word},{','.join(f'{v:.9f}' for v in row)}"
        for robot, target in zip(*map(rows, pair), strict=True)
        for word, row in (("hand", robot), ("eye", target))
    ]
    (tmp_path / "poses.csv").write_text("\n".join(lines) + "\n")
    check(tmp_path, pair)
    (tmp_path / "poses.csv").write_text("\n".join(line.split(",", 1)[1] for line in lines) + "\n")
    check(tmp_path, pair)


def test_both_in_one_row_with_a_header(tmp_path, pair):
    names = [f"{who}_{axis}" for who in ("tcp", "marker") for axis in ("x", "y", "z", "rx", "ry", "rz")]
    (tmp_path / "samples.csv").write_text(",".join(names) + "\n" + text(np.hstack([rows(p) for p in pair])))
    check(tmp_path, pair)


def test_one_file_for_each_pose(tmp_path, pair):
    for name, poses in zip(("robot", "board"), pair, strict=True):
        (tmp_path / name).mkdir()
        for i, pose in enumerate(poses):
            (tmp_path / name / f"pose{i}.txt").write_text(text(pose, " "))
    check(tmp_path, pair)


def test_json_npz_and_yaml(tmp_path, pair):
    import msgspec
    import yaml

    for suffix in ("json", "yaml", "npz"):
        folder = tmp_path / suffix
        folder.mkdir()
        records = [
            {
                "robot": {
                    "position": dict(zip("xyz", p[:3, 3].tolist(), strict=True)),
                    "orientation": q.tolist(),
                },
                "camera_T_marker": t.tolist(),
            }
            for p, q, t in zip(pair[0], se3.to_quat_wxyz(pair[0]), pair[1], strict=True)
        ]
        if suffix == "json":
            (folder / "samples.json").write_bytes(msgspec.json.encode({"version": 1, "samples": records}))
        elif suffix == "yaml":
            (folder / "samples.yaml").write_text(yaml.safe_dump(records))
        else:
            np.savez(folder / "samples.npz", gripper2base=pair[0], target2cam=pair[1])
        check(folder, pair)


def test_a_workbook(tmp_path, pair):
    openpyxl = pytest.importorskip("openpyxl", reason="the extra 'excel' is not installed")
    for name, poses in zip(("robot", "target"), pair, strict=True):
        book = openpyxl.Workbook()
        book.active.append(["Nr", "X [mm]", "Y [mm]", "Z [mm]", "RX", "RY", "RZ"])
        for i, row in enumerate(rows(poses)):
            book.active.append([i + 1, *(1e3 * row[:3]), *row[3:]])
        book.save(tmp_path / f"{name}.xlsx")
    check(tmp_path, pair)


def test_a_file_storage_numbered_from_one(tmp_path, pair):
    matrices = [(f"T{k + 1}_{i + 1}", pose) for k, poses in enumerate(pair) for i, pose in enumerate(poses)]
    lines = [
        f"{name}: !!opencv-matrix\n   rows: 4\n   cols: 4\n   dt: d\n   data: {pose.ravel().tolist()}"
        for name, pose in matrices
    ]
    (tmp_path / "TransformPairs.yml").write_text("\n".join(["%YAML:1.0", "---", *lines]) + "\n")
    check(tmp_path, pair)


@pytest.mark.parametrize(("vendor", "name"), VENDORS.items())
def test_vendors_by_name(tmp_path, pair, vendor, name):
    robot = pair[0]
    if name.startswith("euler"):
        turn = Rotation.from_matrix(robot[:, :3, :3]).as_euler(name[6:], degrees=True)
    elif name == "rotvec":
        turn = se3.so3_log(robot[:, :3, :3])
    else:
        turn = se3.to_quat_wxyz(robot)
    table = np.hstack([1e3 * robot[:, :3, 3], turn])
    if vendor == "franka":
        table = np.swapaxes(robot, 1, 2).reshape(-1, 16)
    (tmp_path / "robot.csv").write_text(text(table))
    (tmp_path / "target.csv").write_text(text(rows(pair[1])))
    (tmp_path / "hecbench-import.yaml").write_text(f"robot_rotation: {vendor}\n")
    check(tmp_path, pair)


HEADERS = {
    "euler_ZYX": ("A,B,C", True),
    "euler_ZYZ": ("O,A,T", True),
    "euler_xyz": ("W,P,R", True),
    "quat_wxyz": ("q1,q2,q3,q4", False),
    "quat_xyzw": ("rot_qx,rot_qy,rot_qz,rot_qw", False),
}


@pytest.mark.parametrize("name", HEADERS)
def test_words_of_headers(tmp_path, pair, name):
    words, degrees = HEADERS[name]
    poses = Rotation.from_matrix(pair[0][:, :3, :3])
    turn = poses.as_euler(name[6:], degrees=True) if degrees else getattr(se3, f"to_{name}")(pair[0])
    (tmp_path / "robot.csv").write_text(f"{words},X,Y,Z\n" + text(np.hstack([turn, 1e3 * pair[0][:, :3, 3]])))
    (tmp_path / "target.csv").write_text(text(rows(pair[1])))
    assert name in check(tmp_path, pair).notes[0]


@pytest.mark.parametrize(
    ("files", "message"),
    [
        ({"K.txt": "600 0 320 0 600 240 0 0 1"}, "nearest format is easyhec, which lacks qpos"),
        ({"notes.csv": "hello,world\n1,2\n"}, "columns hello, world.*robot.csv is missing"),
        ({"a.csv": text(np.eye(6)), "b.csv": text(np.eye(6))}, "which of them is the robot's stays open"),
        ({"robot.csv": text(np.eye(6))}, "pictures of the target, or a table target.csv"),
        ({"robot.csv": "1,2,3,4,5,6\n1,2\n"}, "row 2: 2 cells after rows of 6"),
    ],
)
def test_what_is_missing_is_named(tmp_path, files, message):
    for name, content in files.items():
        (tmp_path / name).write_text(content)
    with pytest.raises(InputError, match=message) as caught:
        load_recording(tmp_path)
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < 600


@pytest.mark.parametrize("start", [0.0, 1.7e9])
@pytest.mark.parametrize(
    "units", [("s", "s"), ("ms", "ms"), ("us", "us"), ("ns", "ns"), ("ns", "s"), ("s", "ms")]
)
def test_units_of_stamps_by_magnitude_and_rate(start, units):
    scale = {"s": 1.0, "ms": 1e3, "us": 1e6, "ns": 1e9}
    robot, camera = start + np.arange(0, 60, 0.008), start + 0.3 + np.arange(0, 58, 1 / 30)
    assert clock_units(robot * scale[units[0]], camera * scale[units[1]]) == units
