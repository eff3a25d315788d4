"""Tables in conventions drawn at random are read as they were meant, or it is said that another reading fits."""

import os

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from hecbench import se3
from hecbench.errors import InputError
from hecbench.preparation import load_recording
from hecbench.recording import Mounting

TABLES = int(os.environ.get("HECBENCH_TABLES", "40"))
"""As many as there is time for."""
FACTOR = {"m": 1.0, "cm": 100.0, "mm": 1000.0}
WORDS = {
    "quat_xyzw": ["qx", "qy", "qz", "qw"],
    "quat_wxyz": ["qw", "qx", "qy", "qz"],
    "rotvec": ["rx", "ry", "rz"],
    "euler_xyz": ["roll", "pitch", "yaw"],
    "euler_ZYX": ["A", "B", "C"],
    "euler_ZYZ": ["O", "A", "T"],
}


def cell(rng):
    """Mounting, base_T_flange and camera_T_target (N, 4, 4) of a cell with noise of 0.2 deg and 0.5 mm."""
    mounting = Mounting(rng.choice(list(Mounting)))
    count, most_rad = int(rng.integers(8, 25)), np.deg2rad(rng.uniform(25, 60))
    X = se3.from_rotvec(rng.normal(0, 1, 3), rng.normal([0.6, 0, 0.5], 0.3))
    Y = se3.from_rotvec(rng.normal(0, 1, 3), rng.normal(0, 0.05, 3))
    target = se3.from_rotvec(
        rng.uniform(-1, 1, (count, 3)) * most_rad, rng.normal([0, 0, 0.7], 0.12, (count, 3))
    )
    hand = X @ target @ se3.inverse(Y)
    noise = rng.normal(0, 1, (count, 6)) * np.repeat([np.deg2rad(0.2), 5e-4], 3)
    return mounting, hand if mounting is Mounting.EYE_TO_HAND else se3.inverse(hand), se3.exp(noise) @ target


def spelled(poses, rng, rotation, unit, degrees):
    """Rows of numbers in a spelling."""
    R = poses[:, :3, :3]
    if rotation.startswith("quat"):
        turn = se3.to_quat_xyzw(poses) if rotation == "quat_xyzw" else se3.to_quat_wxyz(poses)
        turn = turn * rng.choice([-1, 1], (len(turn), 1))
    elif rotation == "rotvec":
        turn = se3.so3_log(R)
    elif rotation == "matrix":
        rows = poses.copy()
        rows[:, :3, 3] *= FACTOR[unit]
        return rows.reshape(-1, 16)[:, : rng.choice([12, 16])]
    else:
        turn = Rotation.from_matrix(R).as_euler(rotation.removeprefix("euler_"))
    if degrees and rotation.startswith(("euler", "rotvec")):
        turn = np.rad2deg(turn)
    return np.hstack([poses[:, :3, 3] * FACTOR[unit], turn])


def write(file, rows, rng, rotation, first):
    """A table in a dialect: separator, decimal comma, counter, header in any order, rotation first."""
    names = ["x", "y", "z", *WORDS.get(rotation, [])] if rotation in WORDS and rng.random() < 0.5 else None
    order = np.arange(rows.shape[1])
    if names:
        order = rng.permutation(order)
    elif first and rows.shape[1] < 8:
        order = np.roll(order, -3)
    rows = rows[:, order]
    names = names and [names[i] for i in order]
    if rng.random() < 0.3:
        rows = np.column_stack([np.arange(len(rows)) + rng.integers(2), rows])
        names = names and ["id", *names]
    separator = str(rng.choice([",", ";", "\t", " ", ", "]))
    lines = [separator.join(f"{value:.6f}" for value in row) for row in rows]
    if separator in (";", "\t") and rng.random() < 0.5:
        lines = [line.replace(".", ",") for line in lines]
    header = [separator.join(names)] if names else []
    file.write_text("\n".join([*header, *lines]) + "\n")


def table(folder, seed):
    """A folder of two tables; what is meant by them."""
    rng = np.random.default_rng(seed)
    mounting, robot, target = cell(rng)
    spellings = [*WORDS, "euler_XYZ", "euler_zyx", "euler_ZXZ", "matrix"]
    first = rng.random() < 0.2
    words = []
    for name, poses, inverse in (("robot", robot, False), ("target", target, rng.random() < 0.3)):
        rotation, unit = str(rng.choice(spellings)), str(rng.choice(["m", "mm", "mm", "cm"]))
        numbers = se3.inverse(poses) if inverse else poses
        rows = spelled(numbers, rng, rotation, unit, rng.random() < 0.5)
        write(folder / f"{name}.csv", rows, rng, rotation, first)
        words.append(
            {"robot": "base_T_flange", "target": ("camera_T_target", "target_T_camera")[inverse]}[name]
        )
    return mounting, robot, target, f"{mounting} with {words[0]}", words[1]


def test_no_wrong_convention_is_chosen_silently(tmp_path):
    right, said, refused, wrong = [], [], [], []
    for seed in range(TABLES):
        folder = tmp_path / str(seed)
        folder.mkdir()
        mounting, robot, target, robot_words, target_words = table(folder, seed)
        try:
            recording = load_recording(folder)
        except InputError as error:
            refused.append((seed, str(error)))
            continue
        same = recording.mounting is mounting and all(
            np.allclose(a, b, atol=2e-4)
            for a, b in ((recording.base_T_flange, robot), (recording.camera_T_target, target))
        )
        others = recording.notes[0].split("; ", 1)[-1]
        if same:
            right.append(seed)
        elif robot_words in others and target_words in others and "would fit as well" in others:
            said.append(seed)
        else:
            wrong.append((seed, recording.notes))
    assert not wrong, wrong
    assert not any("\n" in reason for _, reason in refused)
    assert len(right) + len(said) >= 0.85 * TABLES, refused


@pytest.mark.parametrize(("factor", "named"), [(4.0, "0.25"), (0.6, "1.6")])
def test_lengths_that_disagree_are_named(tmp_path, factor, named):
    _, robot, target = cell(np.random.default_rng(4))
    target[:, :3, 3] *= factor
    np.savetxt(tmp_path / "robot.csv", robot.reshape(-1, 16))
    np.savetxt(tmp_path / "target.csv", target.reshape(-1, 16))
    with pytest.raises(InputError, match=f"lengths are {named}"):
        load_recording(tmp_path)


def test_a_left_handed_table_is_named(tmp_path):
    _, robot, target = cell(np.random.default_rng(5))
    mirror = np.diag([1.0, -1, 1, 1])
    left = mirror @ robot @ mirror
    np.savetxt(tmp_path / "robot.csv", np.hstack([left[:, :3, 3], se3.to_quat_xyzw(left)]))
    np.savetxt(tmp_path / "target.csv", target.reshape(-1, 16))
    with pytest.raises(InputError, match="one is left-handed"):
        load_recording(tmp_path)
