"""An estimate in the formats that robots are set up with; `placement` says which frame is placed."""

from __future__ import annotations

from collections.abc import Mapping

import msgspec
import numpy as np

from hecbench import se3
from hecbench.errors import InputError
from hecbench.estimate import Estimate, plain
from hecbench.exchange.placement import (
    CAMERA_CHANGED,
    OPTICAL,
    OPTIONS,
    Placement,
    frame_name,
    placement,
    rounded,
    text,
)
from hecbench.lens import EQUIDISTANT, CameraModel
from hecbench.recording import Mounting
from hecbench.se3 import Array


def ros_static_transform(estimate: Estimate, options: Mapping[str, str]) -> str:
    """A shell line that publishes the transform: ROS 2, and ROS 1 as a comment."""
    at = placement(estimate, options)
    x, y, z = map(text, at.xyz)
    qx, qy, qz, qw = map(text, at.quat_xyzw)
    return (
        f"{_lines('# ', at)}"
        f"ros2 run tf2_ros static_transform_publisher --x {x} --y {y} --z {z} "
        f"--qx {qx} --qy {qy} --qz {qz} --qw {qw} --frame-id {at.parent} --child-frame-id {at.child}\n"
        f"# ROS 1: rosrun tf2_ros static_transform_publisher {x} {y} {z} {qx} {qy} {qz} {qw} "
        f"{at.parent} {at.child}\n"
    )


def urdf_joint(estimate: Estimate, options: Mapping[str, str]) -> str:
    """A fixed joint for a URDF; the child link is the camera's own or must be declared once."""
    at = placement(estimate, options)
    return (
        f"{_lines('<!-- ', at, ' -->')}"
        f'<joint name="{at.parent}_to_{at.child}" type="fixed">\n'
        f'  <parent link="{at.parent}"/>\n'
        f'  <child link="{at.child}"/>\n'
        f'  <origin xyz="{" ".join(map(text, at.xyz))}" rpy="{" ".join(map(text, at.rpy))}"/>\n'
        "</joint>\n"
    )


def json_transform(estimate: Estimate, options: Mapping[str, str]) -> str:
    """The transform in every spelling, units in the names, with the covariance when there is one.

    The covariance is of a perturbation in the parent frame, so it holds for the child as for the camera.
    """
    at = placement(estimate, options)
    content = {
        "parent": at.parent,
        "child": at.child,
        "comment": at.comments[0],
        "matrix": at.parent_T_child,
        "translation_m": at.xyz,
        "quaternion_xyzw": at.quat_xyzw,
        "rotvec_rad": rounded(se3.so3_log(at.parent_T_child[:3, :3])),
        "rpy_rad": at.rpy,
        "covariance_parent_rad_m": estimate.covariance,
        "camera": estimate.to_json()["camera"],
        "warnings": [comment for comment in at.comments if comment == CAMERA_CHANGED],
    }
    return msgspec.json.format(msgspec.json.encode(plain(content)), indent=2).decode() + "\n"


def easy_handeye(estimate: Estimate, options: Mapping[str, str]) -> str:
    """The calibration file that easy_handeye's publisher reads."""
    at = placement(estimate, options)
    on_hand = estimate.mounting is Mounting.EYE_IN_HAND
    other = frame_name(options.get("other_link") or ("base_link" if on_hand else "tool0"))
    base, effector = (other, at.parent) if on_hand else (at.parent, other)
    names = dict(zip(("x", "y", "z", "qx", "qy", "qz", "qw"), [*at.xyz, *at.quat_xyzw], strict=True))
    parameters = {
        "eye_on_hand": str(on_hand).lower(),
        "freehand_robot_movement": "true",
        "move_group": "manipulator",
        "move_group_namespace": "/",
        "namespace": "/hecbench_eye_on_hand/" if on_hand else "/hecbench_eye_on_base/",
        "robot_base_frame": base,
        "robot_effector_frame": effector,
        "tracking_base_frame": at.child,
        "tracking_marker_frame": frame_name(options.get("marker") or "target"),
    }
    lines = [
        *(f"# {comment}" for comment in at.comments),
        "parameters:",
        *(f"  {key}: {value}" for key, value in parameters.items()),
    ]
    return "\n".join([*lines, "transformation:", *(f"  {k}: {text(v)}" for k, v in names.items())]) + "\n"


def moveit_launch(estimate: Estimate, options: Mapping[str, str]) -> str:
    """A ROS 1 launch file like the one that moveit_calibration saves."""
    at = placement(estimate, options)
    numbers = " ".join(map(text, [*at.xyz, *at.quat_xyzw]))
    return (
        "<launch>\n"
        f"{_lines('  <!-- ', at, ' -->')}"
        '  <node pkg="tf2_ros" type="static_transform_publisher" name="camera_link_broadcaster"\n'
        f'        args="{numbers} {at.parent} {at.child}"/>\n'
        "</launch>\n"
    )


def moveit_launch_ros2(estimate: Estimate, options: Mapping[str, str]) -> str:
    """A ROS 2 launch file (Python) with the static transform."""
    at = placement(estimate, options)
    values = dict(zip(("x", "y", "z", "qx", "qy", "qz", "qw"), [*at.xyz, *at.quat_xyzw], strict=True))
    arguments = [part for key, value in values.items() for part in (f"--{key}", text(value))]
    arguments += ["--frame-id", at.parent, "--child-frame-id", at.child]
    return (
        f"{_lines('# ', at)}\n"
        "from launch import LaunchDescription\n"
        "from launch_ros.actions import Node\n\n\n"
        "def generate_launch_description():\n"
        f"    arguments = {arguments!r}\n"
        '    node = Node(package="tf2_ros", executable="static_transform_publisher", arguments=arguments)\n'
        "    return LaunchDescription([node])\n"
    )


def camera_info(estimate: Estimate, options: Mapping[str, str]) -> str:
    """The calibrated camera as camera_calibration_parsers and camera_info_manager read it (YAML).

    Five coefficients are plumb_bob, eight are rational_polynomial, four of a fisheye lens are equidistant; the other
    lengths of OpenCV have no name in ROS. The projection is that of the undistorted picture with the same K.

    Raises:
        InputError: the estimate knows no intrinsics, or its distortion has no name in ROS.
    """
    import yaml

    camera = estimate.camera
    if camera is None or camera.K is None:
        raise InputError(
            f"estimate of '{estimate.solver}': holds no camera with K; give the recording's camera"
        )
    unknown = sorted(set(options) - set(OPTIONS))
    if unknown:
        raise InputError(f"option '{unknown[0]}': choose among {', '.join(OPTIONS)}")
    name, length = _ros_lens(camera)
    coefficients = np.zeros(length)
    coefficients[: len(camera.distortion)] = camera.distortion
    projection = np.hstack([camera.K, np.zeros((3, 1))])

    def matrix(values: Array) -> dict[str, object]:
        rows, columns = values.shape
        return {"rows": rows, "cols": columns, "data": [float(value) for value in values.ravel()]}

    content = {
        "image_width": camera.width,
        "image_height": camera.height,
        "camera_name": options.get("optical", OPTICAL).removesuffix("_optical_frame"),
        "camera_matrix": matrix(camera.K),
        "distortion_model": name,
        "distortion_coefficients": matrix(coefficients[None]),
        "rectification_matrix": matrix(np.eye(3)),
        "projection_matrix": matrix(projection),
    }
    return str(yaml.safe_dump(content, sort_keys=False))


def _ros_lens(camera: CameraModel) -> tuple[str, int]:
    """The name of the lens model in ROS, and how many coefficients it takes."""
    count = len(camera.distortion)
    if camera.distortion_model == EQUIDISTANT:
        return "equidistant", 4
    if count <= 5:
        return "plumb_bob", 5
    if count == 8:
        return "rational_polynomial", 8
    raise InputError(
        f"camera.distortion: {count} coefficients have no name in ROS; calibrate the lens with 5 or 8 of them"
    )


def _lines(before: str, at: Placement, after: str = "") -> str:
    """A comment line for each comment."""
    return "".join(f"{before}{comment}{after}\n" for comment in at.comments)
