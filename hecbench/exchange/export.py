"""An estimate in the formats that robots are set up with.

The estimate is about the camera's optical frame (z forward, x right, y down). A driver usually publishes that
frame below its own `camera_link`; publishing it below the robot too would give it two parents. So with `child`
the transform to the child is written, composed with the known child_T_optical, and tf stays a tree.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass

import msgspec
import numpy as np

from hecbench import se3
from hecbench.errors import InputError
from hecbench.estimate import Estimate, Status, plain
from hecbench.lens import EQUIDISTANT, CameraModel
from hecbench.recording import Mounting
from hecbench.se3 import Array

OPTIONS = {
    "parent": "name of the parent frame; default: the estimate's parent_link",
    "child": "frame to place, such as camera_link; default: the optical frame itself",
    "optical": "name of the camera's optical frame; default: camera_optical_frame",
    "child_T_optical": "'x y z qx qy qz qw' of the optical frame in the child, as `tf2_echo CHILD OPTICAL` "
    "prints it; default: no offset and the axes of REP 103",
    "other_link": "the robot's other end, flange or base, where a format names both",
    "marker": "name of the target's frame, where a format names it",
}
"""What `options` may hold; the command line offers each as --name."""

CAMERA_CHANGED = (
    "WARNING: the method changed the camera: use this pose with this camera, not with the recording's"
)

_OPTICAL = "camera_optical_frame"
_REP_103 = se3.make([[0, 0, 1], [-1, 0, 0], [0, -1, 0]], [0, 0, 0])
"""link_T_optical: the link looks along x with z up, the optical frame along z with y down."""
_FRAME_NAME = re.compile(r"[A-Za-z_][\w/.\-]*")


@dataclass(frozen=True, eq=False)
class Placement:
    """Where the child frame goes: parent_T_child (4, 4) m, and what is to be known of it, sentences for comments."""

    parent: str
    child: str
    parent_T_child: Array
    comments: tuple[str, ...]

    @property
    def xyz(self) -> list[float]:
        """Translation, m."""
        return _rounded(self.parent_T_child[:3, 3])

    @property
    def quat_xyzw(self) -> list[float]:
        """Quaternion x, y, z, w."""
        return _rounded(se3.to_quat_xyzw(self.parent_T_child))

    @property
    def rpy(self) -> list[float]:
        """Roll, pitch, yaw (rad) about the fixed axes x, y, z, as in URDF."""
        return _rounded(se3.to_rpy(self.parent_T_child[:3, :3]))


def placement(estimate: Estimate, options: Mapping[str, str]) -> Placement:
    """The transform to write.

    Raises:
        InputError: there is no answer to export, an option is unknown, or a frame name or a transform is not
            one.
    """
    if estimate.status is not Status.OK or estimate.parent_T_camera is None:
        raise InputError(
            f"estimate of '{estimate.solver}' is {estimate.status} ({estimate.reason}): nothing to export"
        )
    for name in options:
        if name not in OPTIONS:
            raise InputError(f"export: option '{name}' is unknown; known are {', '.join(OPTIONS)}")
    parent = _frame(options.get("parent") or estimate.parent_link)
    optical = _frame(options.get("optical") or _OPTICAL)
    child = _frame(options.get("child") or optical)
    if parent == child:
        raise InputError(f"export: '{parent}' cannot be its own child; name another --child")
    origin = re.sub(r"[^\w .:/+-]+|-{2,}", "_", f"{estimate.solver} on {estimate.recording}")
    camera = _camera_comments(estimate)
    if child == optical:
        first = f"{origin}, the camera's optical frame"
        return Placement(parent, child, estimate.parent_T_camera, (first, *camera))
    given = options.get("child_T_optical")
    child_T_optical = _REP_103 if given is None else _transform(given)
    how = "as given" if given else f"by REP 103 without offset: compare `tf2_echo {child} {optical}`"
    return Placement(
        parent,
        child,
        estimate.parent_T_camera @ se3.inverse(child_T_optical),
        (f"{origin}; {child} to {optical} {how}", *camera),
    )


def _camera_comments(estimate: Estimate) -> tuple[str, ...]:
    """The camera that belongs to the pose, and a warning where it is not the recording's."""
    camera = estimate.camera
    if camera is None or camera.K is None:
        return ()
    (fx, _, cx), (_, fy, cy) = camera.K[:2]
    lens = " ".join(map(_text, camera.distortion)) or "none"
    said = (
        f"camera: fx {_text(fx)} fy {_text(fy)} cx {_text(cx)} cy {_text(cy)}, {camera.width}x{camera.height} px, "
        f"distortion ({camera.distortion_model}) {lens}"
    )
    return (said, CAMERA_CHANGED) if estimate.diagnostics.get("camera_changed") else (said,)


def ros_static_transform(estimate: Estimate, options: Mapping[str, str]) -> str:
    """A shell line that publishes the transform: ROS 2, and ROS 1 as a comment."""
    at = placement(estimate, options)
    x, y, z = map(_text, at.xyz)
    qx, qy, qz, qw = map(_text, at.quat_xyzw)
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
        f'  <origin xyz="{" ".join(map(_text, at.xyz))}" rpy="{" ".join(map(_text, at.rpy))}"/>\n'
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
        "rotvec_rad": _rounded(se3.so3_log(at.parent_T_child[:3, :3])),
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
    other = _frame(options.get("other_link") or ("base_link" if on_hand else "tool0"))
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
        "tracking_marker_frame": _frame(options.get("marker") or "target"),
    }
    lines = [
        *(f"# {comment}" for comment in at.comments),
        "parameters:",
        *(f"  {key}: {value}" for key, value in parameters.items()),
    ]
    return "\n".join([*lines, "transformation:", *(f"  {k}: {_text(v)}" for k, v in names.items())]) + "\n"


def moveit_launch(estimate: Estimate, options: Mapping[str, str]) -> str:
    """A ROS 1 launch file like the one that moveit_calibration saves."""
    at = placement(estimate, options)
    numbers = " ".join(map(_text, [*at.xyz, *at.quat_xyzw]))
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
    arguments = [part for key, value in values.items() for part in (f"--{key}", _text(value))]
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
        "camera_name": options.get("optical", _OPTICAL).removesuffix("_optical_frame"),
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


def _frame(name: str) -> str:
    if not _FRAME_NAME.fullmatch(name):
        raise InputError(
            f"export: '{name}' is not a frame name: letters, digits, _ / . - and no leading slash"
        )
    return name


def _transform(text: str) -> Array:
    try:
        numbers = np.array(text.replace(",", " ").split(), float)
    except ValueError:
        numbers = np.zeros(0)
    if numbers.shape != (7,) or not np.isfinite(numbers).all() or abs(np.linalg.norm(numbers[3:]) - 1) > 1e-2:
        raise InputError(
            f"export: child_T_optical '{text}' is not 'x y z qx qy qz qw' with a unit quaternion"
        )
    return se3.from_quat_xyzw(numbers[3:], numbers[:3])


def _rounded(values: Array) -> list[float]:
    return [float(value) for value in np.round(values, 12) + 0.0]


def _text(value: float) -> str:
    return f"{value:.10f}".rstrip("0").rstrip(".")
