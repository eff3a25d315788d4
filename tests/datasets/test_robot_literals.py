"""Poses as robot programs, spreadsheets and FileStorage hold them, for both mountings: read as they were meant."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from hecbench import se3
from hecbench.errors import InputError
from hecbench.preparation import load_recording
from hecbench.recording import Mounting


def vectors(poses):
    return np.hstack([poses[:, :3, 3], se3.so3_log(poses[:, :3, :3])])


def angles(poses, order):
    turns = Rotation.from_matrix(poses[:, :3, :3]).as_euler(order, degrees=True)
    return np.hstack([1e3 * poses[:, :3, 3], turns])


def csv(rows):
    return "".join(",".join(f"{value:.6f}" for value in row) + "\n" for row in rows)


def robtargets(poses, form):
    rows = np.hstack([1e3 * poses[:, :3, 3], se3.to_quat_wxyz(poses)])
    return "".join(
        form
        % (
            f"[[{x:.3f},{y:.3f},{z:.3f}],[{a:.7f},{b:.7f},{c:.7f},{d:.7f}],[-1,0,0,0],[9E+09,9E9,9E9,9E9,9E9,9E9]]"
        )
        + "\n"
        for x, y, z, a, b, c, d in rows
    )


def lettered(form, rows):
    return "".join(form % tuple(row) + "\n" for row in rows)


def with_thousands(rows, thousands, decimal):
    marks = str.maketrans({",": thousands, ".": decimal})
    return "".join(";".join(f"{v:,.4f}".translate(marks) for v in row) + "\n" for row in rows)


KUKA = "{X %.3f, Y %.3f, Z %.3f, A %.5f, B %.5f, C %.5f}"
ROBOTS = {
    "ABB": lambda poses: robtargets(poses, "%s"),
    "ABB, declared": lambda poses: robtargets(poses, "CONST robtarget p10:=%s;"),
    "KUKA": lambda poses: lettered(KUKA, angles(poses, "ZYX")),
    "KUKA, declared": lambda poses: lettered(
        "DECL E6POS XP1={X %.3f,Y %.3f,Z %.3f,A %.5f,B %.5f,C %.5f,S 6,T 27,E1 0.0,E2 0.0}",
        angles(poses, "ZYX"),
    ),
    "FANUC": lambda poses: lettered(
        "X = %.3f mm, Y = %.3f mm, Z = %.3f mm, W = %.5f deg, P = %.5f deg, R = %.5f deg",
        angles(poses, "xyz"),
    ),
    "thousands with points": lambda poses: with_thousands(angles(poses, "ZYX"), ".", ","),
    "thousands with commas": lambda poses: with_thousands(angles(poses, "ZYX"), ",", "."),
    "a counter before quaternions": lambda poses: csv(
        np.column_stack([np.arange(len(poses)), poses[:, :3, 3], se3.to_quat_wxyz(poses)[:, [1, 2, 3, 0]]])
    ),
}


@pytest.fixture(params=list(Mounting))
def pair(request, cell):
    """Mounting, base_T_flange beyond a metre, and camera_T_target."""
    robot, target, _ = cell(request.param is Mounting.EYE_IN_HAND, count=12)
    robot = robot.copy()
    robot[:, :3, 3] += [1.2, -1.1, 1.0]
    return request.param, robot, target


def check(folder, pair):
    mounting, robot, target = pair
    recording = load_recording(folder)
    assert recording.mounting is mounting
    np.testing.assert_allclose(recording.base_T_flange, robot, atol=2e-6)
    np.testing.assert_allclose(recording.camera_T_target, target, atol=2e-6)
    return recording


@pytest.mark.parametrize("form", ROBOTS)
def test_the_robot_in_its_makers_words(tmp_path, pair, form):
    (tmp_path / "robot.csv").write_text(ROBOTS[form](pair[1]))
    counted = "counter" in form
    (tmp_path / "target.csv").write_text(ROBOTS[form](pair[2]) if counted else csv(vectors(pair[2])))
    check(tmp_path, pair)


@pytest.mark.parametrize("first", [0, 1])
@pytest.mark.parametrize("turn", ["matrix", "vector"])
def test_rotation_and_translation_numbered_apart(tmp_path, pair, first, turn):
    lines = ["%YAML:1.0", "---"]
    for number, (robot, target) in enumerate(zip(*pair[1:], strict=True), first):
        for family, pose in (("gripper2base", robot), ("target2cam", target)):
            rotation = pose[:3, :3] if turn == "matrix" else se3.so3_log(pose[:3, :3])[:, None]
            for part, value in (("R", rotation), ("t", pose[:3, 3:])):
                lines += matrix(f"{part}_{family}_{number}: ", value, "   ")
    (tmp_path / "poses.yml").write_text("\n".join(lines))
    check(tmp_path, pair)


def test_sequences_of_matrices(tmp_path, pair):
    lines = ["%YAML:1.0", "---"]
    for family, poses in (("gripper2base", pair[1]), ("target2cam", pair[2])):
        for part, column in (("R", slice(0, 3)), ("t", slice(3, 4))):
            lines.append(f"{part}_{family}:")
            lines += [line for pose in poses for line in matrix("   - ", pose[:3, column], "      ")]
    (tmp_path / "poses.yml").write_text("\n".join(lines))
    check(tmp_path, pair)


def matrix(start, value, indent):
    numbers = ", ".join(f"{v:.9f}" for v in value.ravel())
    size = [f"{indent}rows: {value.shape[0]}", f"{indent}cols: {value.shape[1]}"]
    return [f"{start}!!opencv-matrix", *size, f"{indent}dt: d", f"{indent}data: [ {numbers} ]"]


def test_a_translation_without_its_rotation_is_named(tmp_path, pair):
    lines = ["%YAML:1.0", "---", *matrix("t_gripper2base_0: ", pair[1][0, :3, 3:], "   ")]
    (tmp_path / "poses.yml").write_text("\n".join(lines))
    with pytest.raises(InputError, match=r"gripper2base_0: expected R .* and t"):
        load_recording(tmp_path)


def test_the_targets_rows_below_the_robots(tmp_path, pair):
    (tmp_path / "poses.csv").write_text(csv(np.vstack([vectors(pair[1]), vectors(pair[2])])))
    recording = check(tmp_path, pair)
    assert "rows 1 to 12 taken for the robot's" in recording.notes[0]


def test_rows_that_prove_nothing_are_no_pair(tmp_path, rng):
    (tmp_path / "poses.csv").write_text(csv(rng.normal(size=(20, 6))))
    with pytest.raises(InputError, match="target"):
        load_recording(tmp_path)


@pytest.mark.parametrize("seed", range(4))
@pytest.mark.parametrize("mounting", list(Mounting))
@pytest.mark.parametrize("stream", ["robot", "target"])
def test_a_left_handed_frame_is_named(tmp_path, cell, mounting, stream, seed):
    robot, target, _ = cell(mounting is Mounting.EYE_IN_HAND, count=12, seed=seed)
    mirror = np.diag([1.0, -1.0, 1.0, 1.0])
    if stream == "robot":
        robot = mirror @ robot @ mirror
    else:
        target = mirror @ target @ mirror
    (tmp_path / "robot.csv").write_text(csv(vectors(robot)))
    (tmp_path / "target.csv").write_text(csv(vectors(target)))
    with pytest.raises(InputError, match="one is left-handed"):
        load_recording(tmp_path)


@pytest.mark.parametrize("axis", range(3))
def test_one_axis_with_the_other_sign_is_named(tmp_path, pair, axis):
    rows = vectors(pair[1])
    rows[:, axis] *= -1
    (tmp_path / "robot.csv").write_text(csv(rows))
    (tmp_path / "target.csv").write_text(csv(vectors(pair[2])))
    with pytest.raises(InputError, match=f"the robot's {'xyz'[axis]} has the other sign"):
        load_recording(tmp_path)
