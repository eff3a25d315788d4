"""Real recordings laid out in twenty ways that nobody's format describes are imported with at most one hint."""

import json
import shutil

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from hecbench import se3
from hecbench.errors import InputError
from hecbench.preparation import load_recording, with_robot_poses
from hecbench.recording import Mounting

CHESSBOARD = "target: {kind: chessboard, columns: 9, rows: 6, square_m: 0.0236}\n"
TAG = "target: {kind: apriltag, family: tag36h11, id: 10, size_m: 0.048}\n"
K = "601.5 0 321.4\n0 602.4 236.8\n0 0 1\n"
HAND, FIXED = "visp_franka/data-eye-in-hand", "visp_franka/data-eye-to-hand"
PAIRS, ARM = "camodocal_ur", "ur3e_cam1"
ARM_SAMPLES = tuple(range(0, 40, 4))


def lines(rows, separator=",", head=None, digits=7):
    body = [
        separator.join(cell if isinstance(cell, str) else f"{cell:.{digits}f}" for cell in row)
        for row in rows
    ]
    return "\n".join([*([separator.join(head)] if head else []), *body]) + "\n"


def position_mm(poses):
    return 1e3 * poses[:, :3, 3]


def euler_deg(poses, order):
    return Rotation.from_matrix(poses[:, :3, :3]).as_euler(order, degrees=True)


def rotvec(poses):
    return np.hstack([poses[:, :3, 3], se3.so3_log(poses[:, :3, :3])])


def quaternion(poses, order="xyzw"):
    return np.hstack([poses[:, :3, 3], getattr(se3, f"to_quat_{order}")(poses)])


def pictures(folder, recording, name="{:02d}.png"):
    folder.mkdir(parents=True, exist_ok=True)
    for i, image in enumerate(recording.images):
        shutil.copyfile(image, folder / name.format(i))


def image_column_in_kuka(root, r):
    pictures(root / "images", r)
    poses = r.base_T_flange
    table = [
        (f"{i:02d}.png", *p, *a)
        for i, (p, a) in enumerate(zip(position_mm(poses), euler_deg(poses, "ZYX"), strict=True))
    ]
    (root / "poses.csv").write_text(lines(table[::-1], head=["file", "X", "Y", "Z", "A", "B", "C"]))


def ur_lines_deep_pictures(root, r):
    pictures(root / "data" / "cam0" / "rgb", r, "img{}.png")
    (root / "robot_poses.txt").write_text(
        "".join(f"p[{line}]\n" for line in lines(rotvec(r.base_T_flange), ", ").splitlines())
    )


def json_records(root, r):
    pictures(root, r)
    records = [
        {
            "image": f"{i:02d}.png",
            "tcp": {"position": q[:3].tolist(), "orientation": dict(zip("xyzw", q[3:], strict=True))},
        }
        for i, q in enumerate(quaternion(r.base_T_flange))
    ]
    (root / "samples.json").write_text(json.dumps({"date": "today", "samples": records}))


def npz_beside_pictures(root, r):
    pictures(root / "color", r)
    np.savez(root / "gripper_poses.npz", gripper2base=r.base_T_flange)


def matrix_of_each_picture(root, r):
    pictures(root, r, "frame_{}.png")
    for i, pose in enumerate(r.base_T_flange):
        (root / f"frame_{i}.txt").write_text(lines(pose, " "))


def yaml_matrices(root, r):
    pictures(root / "imgs", r)
    (root / "robot.yaml").write_text("poses:\n" + "".join(f"- {pose.tolist()}\n" for pose in r.base_T_flange))


def fanuc_workbook(root, r):
    openpyxl = pytest.importorskip("openpyxl", reason="the extra 'excel' is not installed")
    pictures(root / "images", r)
    book = openpyxl.Workbook()
    book.active.append(["No", "X", "Y", "Z", "W", "P", "R"])
    for i, row in enumerate(np.hstack([position_mm(r.base_T_flange), euler_deg(r.base_T_flange, "xyz")])):
        book.active.append([i + 1, *row.tolist()])
    book.save(root / "positions.xlsx")


def german_table(root, r):
    pictures(root / "Bilder", r, "Bild ({}).png")
    rows = [(str(i), *q) for i, q in enumerate(quaternion(r.base_T_flange))]
    head = ["Nr", "x", "y", "z", "qx", "qy", "qz", "qw"]
    (root / "roboter.csv").write_text(lines(rows, ";", head).replace(".", ","))


def scalar_first_for_a_tag(root, r):
    pictures(root / "cam", r)
    head = ["tx", "ty", "tz", "qw", "qx", "qy", "qz"]
    (root / "base_T_tool.csv").write_text(lines(quaternion(r.base_T_flange, "wxyz"), head=head))


def roll_pitch_yaw_for_a_tag(root, r):
    pictures(root / "cam", r, "{}.png")
    table = np.hstack([position_mm(r.base_T_flange), euler_deg(r.base_T_flange, "xyz")])
    (root / "tcp.tsv").write_text(lines(table, "\t", ["x [mm]", "y [mm]", "z [mm]", "roll", "pitch", "yaw"]))


def camera_info_for_a_tag(root, r):
    pictures(root / "left", r)
    (root / "camera_info.yaml").write_text(
        "image_width: 640\nimage_height: 480\ndistortion_model: plumb_bob\n"
        f"camera_matrix: {{rows: 3, cols: 3, data: [{', '.join(K.split())}]}}\n"
        "distortion_coefficients: {rows: 1, cols: 5, data: [0, 0, 0, 0, 0]}\n"
    )
    rows = np.swapaxes(r.base_T_flange, 1, 2).reshape(-1, 16)
    (root / "O_T_EE.csv").write_text(lines(rows, head=[f"O_T_EE_{i}" for i in range(16)]))


def two_tables(root, r):
    (root / "robot.csv").write_text(lines(r.base_T_flange.reshape(-1, 16)))
    (root / "marker.csv").write_text(
        lines(np.hstack([position_mm(r.camera_T_target), rotvec(r.camera_T_target)[:, 3:]]))
    )


def one_wide_table(root, r):
    head = [f"{who}_{axis}" for who in ("ee", "cam") for axis in ("x", "y", "z", "qx", "qy", "qz", "qw")]
    (root / "log.csv").write_text(
        lines(np.hstack([quaternion(r.base_T_flange), quaternion(r.camera_T_target)]), head=head)
    )


def hand_and_eye_rows(root, r):
    pairs = zip(rotvec(r.base_T_flange), rotvec(r.camera_T_target), strict=True)
    (root / "all.txt").write_text("".join(lines([("hand", *a), ("eye", *b)], " ") for a, b in pairs))


def stacked_matrices(root, r):
    (root / "hand.txt").write_text("\n".join(lines(pose, " ") for pose in r.base_T_flange))
    (root / "target.txt").write_text("\n".join(lines(pose, " ") for pose in r.camera_T_target))


def json_pairs(root, r):
    pairs = zip(r.base_T_flange.tolist(), r.camera_T_target.tolist(), strict=True)
    (root / "pairs.json").write_text(json.dumps([{"gripper2base": a, "target2cam": b} for a, b in pairs]))


def npz_pairs(root, r):
    np.savez(root / "pairs.npz", robot_poses=r.base_T_flange, board_poses=r.camera_T_target)


def storage_from_one(root, r):
    named = [
        (f"{n}_{i + 1}", p)
        for n, poses in (("gripper", r.base_T_flange), ("marker", r.camera_T_target))
        for i, p in enumerate(poses)
    ]
    body = [
        f"{n}: !!opencv-matrix\n   rows: 4\n   cols: 4\n   dt: d\n   data: {p.ravel().tolist()}"
        for n, p in named
    ]
    (root / "poses.yml").write_text("\n".join(["%YAML:1.0", "---", *body]) + "\n")


def joints_in_degrees(root, r):
    pictures(root / "pics", r, "img{}.png")
    (root / "joints.csv").write_text(lines(np.rad2deg(r.joints_rad), head=[f"q{i}" for i in range(1, 7)]))


def ros_joint_names(root, r):
    pictures(root / "pics", r, "{:03d}.png")
    order = np.argsort(r.robot.joint_names)
    head = [r.robot.joint_names[i] for i in order]
    (root / "joint_states.csv").write_text(lines(r.joints_rad[:, order], head=head))


LAYOUTS = {
    image_column_in_kuka: HAND,
    ur_lines_deep_pictures: HAND,
    json_records: HAND,
    npz_beside_pictures: HAND,
    matrix_of_each_picture: HAND,
    yaml_matrices: HAND,
    fanuc_workbook: HAND,
    german_table: HAND,
    scalar_first_for_a_tag: FIXED,
    roll_pitch_yaw_for_a_tag: FIXED,
    camera_info_for_a_tag: FIXED,
    two_tables: PAIRS,
    one_wide_table: PAIRS,
    hand_and_eye_rows: PAIRS,
    stacked_matrices: PAIRS,
    json_pairs: PAIRS,
    npz_pairs: PAIRS,
    storage_from_one: PAIRS,
    joints_in_degrees: ARM,
    ros_joint_names: ARM,
}
HINTED = {
    HAND: CHESSBOARD,
    FIXED: TAG,
    PAIRS: "",
    ARM: "target: {kind: chessboard, columns: 9, rows: 7, square_m: 0.02}\n",
}


@pytest.fixture(scope="module")
def recordings(data):
    found = {name: load_recording(data / name) for name in (HAND, FIXED, PAIRS, ARM)}
    return found | {ARM: with_robot_poses(found[ARM]).subset(ARM_SAMPLES)}


def test_there_are_twenty():
    assert len(LAYOUTS) == 20


@pytest.mark.parametrize("layout", LAYOUTS, ids=lambda layout: layout.__name__)
def test_layouts_are_imported(tmp_path, recordings, layout):
    source = LAYOUTS[layout]
    recording = recordings[source]
    layout(tmp_path, recording)
    if source in (HAND, FIXED) and not (tmp_path / "camera_info.yaml").exists():
        (tmp_path / "K.txt").write_text(K)
    if HINTED[source]:
        (tmp_path / "hecbench-import.yaml").write_text(HINTED[source])
    read = with_robot_poses(load_recording(tmp_path))
    assert read.mounting is (Mounting.EYE_IN_HAND if source == HAND else Mounting.EYE_TO_HAND)
    expected = recording.base_T_flange
    order = [int(se3.translation_error_m(pose, expected).argmin()) for pose in read.base_T_flange]
    assert sorted(order) == list(range(len(expected)))
    np.testing.assert_allclose(read.base_T_flange, expected[order], atol=2e-4)
    if read.images is not None:
        for i, k in enumerate(order):
            np.testing.assert_array_equal(read.image(i), recording.image(k))


def named_by_row(root, r, names):
    """Pictures and a table with their names, in quaternions."""
    root.mkdir(exist_ok=True)
    (root / "K.txt").write_text(K)
    (root / "hecbench-import.yaml").write_text(HINTED[HAND] or CHESSBOARD)
    pictures(root / "images", r)
    table = [(name, *row) for name, row in zip(names, quaternion(r.base_T_flange), strict=True)]
    (root / "poses.csv").write_text(lines(table, head=["image", "x", "y", "z", "qx", "qy", "qz", "qw"]))


def test_a_row_whose_picture_is_absent_is_left_out_and_said(tmp_path, recordings):
    r = recordings[HAND]
    named_by_row(tmp_path, r, [f"{i:02d}.png" for i in range(len(r))])
    (tmp_path / "images" / "00.png").unlink()
    read = load_recording(tmp_path)
    assert len(read) == len(r) - 1
    assert f"left out 1 of {len(r)} rows, whose pictures are not there: 00.png" in "\n".join(read.notes)


def test_one_picture_for_two_poses_and_two_for_one_are_refused(tmp_path, recordings):
    r = recordings[HAND]
    named_by_row(tmp_path / "one", r, [f"{i // 2:02d}.png" for i in range(len(r))])
    with pytest.raises(InputError, match=r"00\.png stands in several rows, one picture for two poses"):
        load_recording(tmp_path / "one")
    (tmp_path / "two").mkdir()
    for name in ("a", "b"):
        pictures(tmp_path / "two" / name, r)
    (tmp_path / "two" / "poses.txt").write_text(lines(quaternion(r.base_T_flange), " "))
    with pytest.raises(InputError, match=r"both hold \d+ pictures, two for one pose; write 'images: "):
        load_recording(tmp_path / "two")
