"""The next pose in words, as a person in front of the camera understands them."""

import numpy as np
import pytest
from hecbench_hardware.cockpit.scene import pixel_of
from hecbench_hardware.cockpit.suggestion import joint_words, target_words
from hecbench_hardware.cockpit.texts import plain

from hecbench import se3
from hecbench.lens import CameraModel

NOW = se3.make(np.eye(3), [0.0, 0.0, 1.0])
CAMERA = CameraModel(640, 480, np.array([[600.0, 0, 300], [0, 610, 250], [0, 0, 1]]))


@pytest.mark.parametrize(
    ("rotvec_deg", "shift", "said"),
    [
        ((0, 0, 0), (0.1, 0, 0), "10 cm right"),
        ((0, 0, 0), (-0.1, 0.2, 0), "10 cm left, 20 cm down"),
        ((0, 0, 0), (0, 0, -0.25), "25 cm nearer"),
        ((30, 0, 0), (0, 0, 0), "its top towards the camera by 30 deg"),
        ((0, -20, 0), (0, 0, 0), "its left side towards the camera by 20 deg"),
        ((0, 0, 40), (0, 0, 0.05), "5 cm farther, turned clockwise by 40 deg"),
    ],
)
def test_moves_as_the_camera_sees_them(rotvec_deg, shift, said):
    wanted = se3.from_rotvec(np.deg2rad(rotvec_deg), np.add([0, 0, 1.0], shift))
    assert target_words(NOW, wanted).endswith(f"move the target {said}")


def test_top_towards_the_camera_brings_the_top_nearer():
    """The words agree with the geometry: y points down in the picture."""
    tilted = se3.from_rotvec(np.deg2rad([30.0, 0, 0]), [0, 0, 1.0])
    assert se3.transform_points(tilted, [[0, -0.1, 0]])[0, 2] < 1.0


def test_small_moves_are_not_worth_a_word():
    assert target_words(NOW, se3.make(np.eye(3), [0.01, 0, 1.0])) == "hold the target there"


def test_joints_by_name():
    assert (
        joint_words(np.zeros(6), np.deg2rad([20, 0, -10.4, 0, 0, 0.2]))
        == "turn shoulder pan +20 deg, elbow -10 deg"
    )


def test_a_click_on_the_hanging_picture_is_its_pixel():
    base_T_camera = se3.from_rotvec([0.3, -0.8, 2.0], [1.0, 0.5, 0.7])
    for pixel in ([0.0, 0.0], [300.0, 250.0], [639.0, 12.5]):
        ray = base_T_camera[:3, :3] @ np.linalg.solve(CAMERA.K, [*pixel, 1.0])
        np.testing.assert_allclose(
            pixel_of(base_T_camera[:3, 3], ray, base_T_camera, CAMERA), pixel, atol=1e-9
        )


def test_names_from_data_are_text():
    assert plain("a_b *c* [x](y)") == r"a\_b \*c\* \[x\](y)"
