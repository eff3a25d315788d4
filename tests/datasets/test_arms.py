"""The arms' published parameters give what their URDFs give; a fit finds a motion; pickles run nothing."""

import pickle

import numpy as np
import pytest
from hecbench_datasets.reading.arms import BAXTER_LEFT, PANDA
from hecbench_datasets.reading.pickles import plain_pickle
from hecbench_datasets.reading.rigid import rigid_fit

from hecbench import se3
from hecbench.errors import InputError
from hecbench.robots.model import load_robot

R = np.pi / 2
PANDA_ORIGINS = (
    ("0 0 0", "0 0 0.333"), (f"{-R} 0 0", "0 0 0"), (f"{R} 0 0", "0 -0.316 0"), (f"{R} 0 0", "0.0825 0 0"),
    (f"{-R} 0 0", "-0.0825 0.384 0"), (f"{R} 0 0", "0 0 0"), (f"{R} 0 0", "0.088 0 0"),
)  # fmt: skip
BAXTER_ORIGINS = (
    ("0 0 0", "0 0 0"), (f"{-R} 0 0", "0.069 0 0.27035"), (f"{R} 0 {R}", "0.102 0 0"),
    (f"{-R} {-R} 0", "0.069 0 0.26242"), (f"{R} 0 {R}", "0.10359 0 0"), (f"{-R} {-R} 0", "0.01 0 0.2707"),
    (f"{R} 0 {R}", "0.115975 0 0"),
)  # fmt: skip


def urdf(arm, origins, hand, path):
    """A URDF without meshes from joint origins (rpy, xyz) and that of the hand."""
    links = [arm.base_link, *(f"link{i}" for i in range(7)), arm.flange_link]
    text = [f'<link name="{link}"/>' for link in links]
    for i, (rpy, xyz) in enumerate((*origins, hand)):
        name, kind = (arm.joint_names[i], "revolute") if i < 7 else ("hand", "fixed")
        text.append(
            f'<joint name="{name}" type="{kind}"><origin rpy="{rpy}" xyz="{xyz}"/><axis xyz="0 0 1"/>'
            f'<parent link="{links[i]}"/><child link="{links[i + 1]}"/>'
            '<limit lower="-4" upper="4" effort="1" velocity="1"/></joint>'
        )
    path.write_text(f'<robot name="arm">{"".join(text)}</robot>')
    return path


@pytest.mark.parametrize(
    ("arm", "origins", "hand", "tolerance_m"),
    [
        (PANDA, PANDA_ORIGINS, (f"0 0 {-np.pi / 4}", "0 0 0.107"), 1e-9),
        (BAXTER_LEFT, BAXTER_ORIGINS, ("0 0 0", "0 0 0.11355"), 1e-4),
    ],
)
def test_parameters_agree_with_the_urdf(arm, origins, hand, tolerance_m, tmp_path, rng):
    model = load_robot(urdf(arm, origins, hand, tmp_path / "arm.urdf"), meshes=False)
    joints = rng.uniform(-1.5, 1.5, (20, 7))
    expected = model.forward(joints, arm.joint_names, base=arm.base_link, tip=arm.flange_link)
    found = arm.base_T_flange(joints)
    assert se3.translation_error_m(expected, found).max() < tolerance_m
    assert se3.rotation_error_rad(expected, found).max() < 1e-6
    if arm is PANDA:
        links = model.link_poses(joints, arm.joint_names)[..., :3, 3]
        names = tuple(f"panda_link{i}" for i in range(8))
        np.testing.assert_allclose(arm.link_origins(joints, names), links[:, :8], atol=1e-9)


def test_a_fit_finds_the_motion(rng):
    a_T_b = se3.exp(rng.normal(0, 1, 6))
    points = rng.normal(0, 1, (10, 3))
    moved = se3.transform_points(a_T_b, points)
    found, rms = rigid_fit(points, moved)
    np.testing.assert_allclose(found, a_T_b, atol=1e-9)
    assert rms < 1e-9
    assert rigid_fit(points, moved + rng.normal(0, 0.01, (10, 3)))[1] == pytest.approx(0.015, abs=0.006)


@pytest.mark.parametrize("protocol", range(pickle.HIGHEST_PROTOCOL + 1))
def test_pickles_of_values_and_arrays_are_read(tmp_path, protocol):
    value = {"pose_0": {"joints": [0.1, 0.2], "ee_3d": np.arange(3.0), "n": np.float64(2.5)}}
    (tmp_path / "p").write_bytes(pickle.dumps(value, protocol=protocol))
    found = plain_pickle(tmp_path / "p")
    np.testing.assert_array_equal(found["pose_0"].pop("ee_3d"), np.arange(3.0))
    assert found == {"pose_0": {"joints": [0.1, 0.2], "n": 2.5}}


class Harmful:
    def __init__(self, path):
        self.path = path

    def __reduce__(self):
        return (open, (str(self.path), "w"))


def test_a_pickle_runs_nothing(tmp_path):
    (tmp_path / "p").write_bytes(pickle.dumps({"x": Harmful(tmp_path / "made")}))
    with pytest.raises(InputError, match="it asks for"):
        plain_pickle(tmp_path / "p")
    assert not (tmp_path / "made").exists()


@pytest.mark.parametrize("content", [b"", b"no pickle", pickle.dumps({"a": [1, 2]})[:-4]])
def test_damaged_pickles_are_named(tmp_path, content):
    (tmp_path / "p").write_bytes(content)
    with pytest.raises(InputError, match="is not a pickle of plain values"):
        plain_pickle(tmp_path / "p")
