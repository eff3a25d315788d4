"""Lens models against OpenCV, their inverses, and their derivatives."""

import cv2
import numpy as np
import pytest

from hecbench.errors import InputError
from hecbench.lens import (
    DISTORTION_LENGTHS,
    EQUIDISTANT,
    OPENCV,
    CameraModel,
    FixedSensor,
    Sensor,
    distort,
    normalised,
    parameters_of,
    project,
    undistort,
)

K = np.array([[900.0, 0, 640], [0, 920.0, 350], [0, 0, 1]])
LENSES = [(model, length) for model, lengths in DISTORTION_LENGTHS.items() for length in lengths]


def camera(model, length, rng):
    return CameraModel(1280, 720, K, rng.uniform(-0.05, 0.05, length), model)


@pytest.fixture
def points_c(rng):
    return rng.uniform([-0.5, -0.4, 1.0], [0.5, 0.4, 2.0], (40, 3))


@pytest.mark.parametrize(("model", "length"), LENSES)
def test_projects_as_opencv_does(model, length, rng, points_c):
    lens = camera(model, length, rng)
    if model == EQUIDISTANT:
        coefficients = np.zeros(4) if length == 0 else lens.distortion
        expected, _ = cv2.fisheye.projectPoints(points_c[:, None], np.zeros(3), np.zeros(3), K, coefficients)
    else:
        expected, _ = cv2.projectPoints(points_c, np.zeros(3), np.zeros(3), K, lens.distortion)
    np.testing.assert_allclose(project(lens, points_c), expected.reshape(-1, 2), atol=1e-8)
    np.testing.assert_allclose(
        FixedSensor(lens)(points_c, np.zeros(0))[0], project(lens, points_c), atol=1e-9
    )


@pytest.mark.parametrize(("model", "length"), LENSES)
def test_undistorting_undoes_distorting(model, length, rng, points_c):
    lens = camera(model, length, rng)
    ideal = points_c[:, :2] / points_c[:, 2:]
    np.testing.assert_allclose(undistort(distort(ideal, lens), lens), ideal, atol=1e-9)
    np.testing.assert_allclose(normalised(lens, project(lens, points_c)), ideal, atol=1e-9)


def test_points_that_no_ray_reaches_are_nan():
    """With k1 = -0.5 the distorted radius never exceeds 0.55."""
    lens = CameraModel(1280, 720, K, np.array([-0.5, 0, 0, 0]))
    found = undistort(np.array([[0.3, 0.0], [0.7, 0.0]]), lens)
    assert np.isfinite(found[0]).all()
    assert np.isnan(found[1]).all()


@pytest.mark.parametrize(("model", "length"), LENSES)
def test_derivatives_are_those_of_small_steps(model, length, rng, points_c):
    sensor, parameters, step = Sensor(model), parameters_of(camera(model, length, rng)), 1e-6
    _, by_point, by_parameter = sensor(points_c, parameters)
    for k, shift in enumerate(step * np.eye(3)):
        change = sensor(points_c + shift, parameters)[0] - sensor(points_c - shift, parameters)[0]
        np.testing.assert_allclose(by_point[..., k], change / (2 * step), atol=2e-4)
    for k, shift in enumerate(step * np.eye(len(parameters))):
        change = sensor(points_c, parameters + shift)[0] - sensor(points_c, parameters - shift)[0]
        np.testing.assert_allclose(by_parameter[..., k], change / (2 * step), atol=2e-4)


def test_a_point_behind_the_camera_has_no_pixel():
    assert np.isnan(project(CameraModel(10, 10, K), np.array([0.0, 0.0, -1.0]))).all()


@pytest.mark.parametrize(
    ("model", "coefficients", "named"),
    [
        ("fisheye", [], "distortion_model"),
        (EQUIDISTANT, [0.1] * 5, "distortion"),
        (OPENCV, [0.1] * 3, "distortion"),
    ],
)
def test_lenses_that_do_not_exist_are_refused(model, coefficients, named):
    with pytest.raises(InputError, match=f"camera.{named}"):
        CameraModel(10, 10, K, np.array(coefficients), model)
