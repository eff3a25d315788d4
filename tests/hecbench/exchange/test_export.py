"""Exports are read back by the rules of their formats and must give the transform again."""

import ast
import json
import re
import shlex
from xml.etree import ElementTree

import numpy as np
import pytest
import yaml
from scipy.spatial.transform import Rotation

from hecbench import registry, se3
from hecbench.errors import InputError
from hecbench.estimate import Estimate, Status, Termination
from hecbench.exchange import export
from hecbench.recording import CameraModel, Mounting
from hecbench.specs import ExporterSpec, Kind

TO_LINK = {"child": "camera_link", "optical": "camera_color_optical_frame"}


@pytest.fixture(params=[0.3, np.pi / 2, -np.pi / 2])
def estimate(request):
    """An answer whose pitch is moderate or 90 degrees, where roll and yaw are not unique."""
    rotation = Rotation.from_euler("xyz", [0.4, request.param, -0.7]).as_matrix()
    return Estimate(
        se3.make(rotation, [0.1, -0.25, 1.5]),
        solver="park",
        recording="my cell",
        mounting=Mounting.EYE_IN_HAND,
        parent_link="tool0",
        covariance=np.diag(np.arange(1.0, 7)),
    )


def read_ros(text):
    line = next(line for line in text.splitlines() if line.startswith("ros2"))
    words = shlex.split(line)
    value = {words[i][2:]: words[i + 1] for i in range(len(words) - 1) if words[i].startswith("--")}
    numbers = [float(value[k]) for k in ("x", "y", "z", "qx", "qy", "qz", "qw")]
    return se3.from_quat_xyzw(numbers[3:], numbers[:3]), value["frame-id"], value["child-frame-id"]


def read_urdf(text):
    joint = ElementTree.fromstring(text)
    origin = joint.find("origin")
    xyz, rpy = ([float(v) for v in origin.get(key).split()] for key in ("xyz", "rpy"))
    rotation = Rotation.from_euler("xyz", rpy).as_matrix()
    return se3.make(rotation, xyz), joint.find("parent").get("link"), joint.find("child").get("link")


def read_json(text):
    content = json.loads(text)
    return np.array(content["matrix"]), content["parent"], content["child"]


def read_easy_handeye(text):
    content = yaml.safe_load(text)
    parameters, at = content["parameters"], content["transformation"]
    numbers = [at[key] for key in ("x", "y", "z", "qx", "qy", "qz", "qw")]
    parent = parameters["robot_effector_frame" if parameters["eye_on_hand"] else "robot_base_frame"]
    return se3.from_quat_xyzw(numbers[3:], numbers[:3]), parent, parameters["tracking_base_frame"]


def read_launch(text):
    words = ElementTree.fromstring(text).find("node").get("args").split()
    numbers = [float(word) for word in words[:7]]
    return se3.from_quat_xyzw(numbers[3:], numbers[:3]), words[7], words[8]


def read_launch_ros2(text):
    assigned = next(node for node in ast.walk(ast.parse(text)) if isinstance(node, ast.Assign))
    return read_ros("ros2 " + " ".join(ast.literal_eval(assigned.value)))


READERS = {
    "ros": read_ros,
    "urdf": read_urdf,
    "json": read_json,
    "easy_handeye": read_easy_handeye,
    "moveit": read_launch,
    "moveit_ros2": read_launch_ros2,
}


def exporter(name):
    return registry.load().get(Kind.EXPORTER, name, ExporterSpec)


@pytest.mark.parametrize("name", READERS)
def test_each_format_gives_the_transform_again(estimate, name):
    parent_T_child, parent, child = READERS[name](exporter(name).write(estimate, {}))
    assert (parent, child) == ("tool0", "camera_optical_frame")
    np.testing.assert_allclose(parent_T_child, estimate.parent_T_camera, atol=1e-8)


@pytest.mark.parametrize("name", READERS)
def test_with_a_child_the_optical_frame_keeps_its_only_parent(estimate, name):
    child_T_optical = se3.from_quat_xyzw([-0.5, 0.5, -0.5, 0.5], [0, 0.015, 0])
    options = TO_LINK | {"child_T_optical": "0 0.015 0 -0.5 0.5 -0.5 0.5"}
    parent_T_child, _, child = READERS[name](exporter(name).write(estimate, options))
    assert child == "camera_link"
    np.testing.assert_allclose(parent_T_child @ child_T_optical, estimate.parent_T_camera, atol=1e-8)


def test_rep_103_stands_in_for_an_unknown_offset_and_says_so(estimate):
    text = exporter("ros").write(estimate, TO_LINK)
    parent_T_link, _, _ = read_ros(text)
    link_R_optical = parent_T_link[:3, :3].T @ estimate.parent_T_camera[:3, :3]
    np.testing.assert_allclose(link_R_optical @ [0, 0, 1], [1, 0, 0], atol=1e-8)
    np.testing.assert_allclose(link_R_optical @ [0, 1, 0], [0, 0, -1], atol=1e-8)
    assert "tf2_echo camera_link camera_color_optical_frame" in text


def test_the_covariance_travels_in_the_parent_frame(estimate):
    content = json.loads(exporter("json").write(estimate, TO_LINK))
    np.testing.assert_array_equal(content["covariance_parent_rad_m"], estimate.covariance)


def test_names_of_the_other_end(estimate):
    text = exporter("easy_handeye").write(estimate, {"other_link": "base", "marker": "tag_0"})
    parameters = yaml.safe_load(text)["parameters"]
    assert (parameters["robot_base_frame"], parameters["tracking_marker_frame"]) == ("base", "tag_0")


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"chld": "x"}, "option 'chld' is unknown"),
        ({"child": "a; rm -rf /"}, "is not a frame name"),
        ({"child": "tool0"}, "cannot be its own child"),
        ({"child": "/camera"}, "no leading slash"),
        (TO_LINK | {"child_T_optical": "0 0 0 1"}, "x y z qx qy qz qw"),
        (TO_LINK | {"child_T_optical": "0 0 0 1 1 1 1"}, "unit quaternion"),
    ],
)
def test_wrong_options_are_named(estimate, options, message):
    with pytest.raises(InputError, match=re.escape(message)):
        export.ros_static_transform(estimate, options)


def test_nothing_to_export_is_said():
    failed = Estimate(
        status=Status.REFUSED, reason="one axis only", solver="park", termination=Termination.NOT_RUN
    )
    with pytest.raises(InputError, match="one axis only"):
        export.urdf_joint(failed, {})


def test_names_from_elsewhere_cannot_leave_the_comment(estimate):
    from dataclasses import replace

    text = exporter("moveit_ros2").write(replace(estimate, recording='x"""\nimport os --> \n'), {})
    assert [node.module for node in ast.walk(ast.parse(text)) if isinstance(node, ast.ImportFrom)]
    assert not [node for node in ast.walk(ast.parse(text)) if isinstance(node, ast.Import)]


@pytest.mark.parametrize(
    ("distortion", "model", "name", "length"),
    [
        ([], "opencv", "plumb_bob", 5),
        ([0.1, -0.2, 0.001, 0.002], "opencv", "plumb_bob", 5),
        ([0.1, -0.2, 0.001, 0.002, 0.3], "opencv", "plumb_bob", 5),
        ([0.1] * 8, "opencv", "rational_polynomial", 8),
        ([0.1, 0.01, 0.001, 0.0001], "equidistant", "equidistant", 4),
    ],
)
def test_camera_info_names_the_lens_as_ros_does(distortion, model, name, length):
    K = np.array([[600.0, 0, 320], [0, 610, 240], [0, 0, 1]])
    camera = CameraModel(640, 480, K, np.array(distortion), model)
    found = yaml.safe_load(
        export.camera_info(Estimate(np.eye(4), camera=camera), {"optical": "left_optical_frame"})
    )
    assert (found["image_width"], found["image_height"], found["camera_name"]) == (640, 480, "left")
    np.testing.assert_array_equal(np.reshape(found["camera_matrix"]["data"], (3, 3)), K)
    assert found["distortion_model"] == name
    coefficients = found["distortion_coefficients"]["data"]
    assert len(coefficients) == length
    np.testing.assert_array_equal(coefficients[: len(distortion)], distortion)
    np.testing.assert_array_equal(np.reshape(found["projection_matrix"]["data"], (3, 4))[:, :3], K)


def test_a_lens_without_a_name_in_ros_is_refused():
    camera = CameraModel(640, 480, np.array([[600.0, 0, 320], [0, 610, 240], [0, 0, 1]]), np.full(12, 0.01))
    with pytest.raises(InputError, match="12 coefficients"):
        export.camera_info(Estimate(np.eye(4), camera=camera), {})
    with pytest.raises(InputError, match="no camera with K"):
        export.camera_info(Estimate(np.eye(4)), {})
