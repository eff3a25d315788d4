"""Which frame an exported transform places, and where.

The estimate is about the camera's optical frame (z forward, x right, y down). A driver usually publishes that
frame below its own `camera_link`; publishing it below the robot too would give it two parents. So with `child`
the transform to the child is written, composed with the known child_T_optical, and tf stays a tree.
"""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from hecbench import se3
from hecbench.errors import InputError
from hecbench.estimate import Estimate, Status
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

OPTICAL = "camera_optical_frame"
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
        return rounded(self.parent_T_child[:3, 3])

    @property
    def quat_xyzw(self) -> list[float]:
        """Quaternion x, y, z, w."""
        return rounded(se3.to_quat_xyzw(self.parent_T_child))

    @property
    def rpy(self) -> list[float]:
        """Roll, pitch, yaw (rad) about the fixed axes x, y, z, as in URDF."""
        return rounded(se3.to_rpy(self.parent_T_child[:3, :3]))


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
    parent = frame_name(options.get("parent") or estimate.parent_link)
    optical = frame_name(options.get("optical") or OPTICAL)
    child = frame_name(options.get("child") or optical)
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
    lens = " ".join(map(text, camera.distortion)) or "none"
    said = (
        f"camera: fx {text(fx)} fy {text(fy)} cx {text(cx)} cy {text(cy)}, {camera.width}x{camera.height} px, "
        f"distortion ({camera.distortion_model}) {lens}"
    )
    return (said, CAMERA_CHANGED) if estimate.diagnostics.get("camera_changed") else (said,)


def frame_name(name: str) -> str:
    """The name, unless it is none."""
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


def rounded(values: Array) -> list[float]:
    """Numbers without the last bits, and without -0."""
    return [float(value) for value in np.round(values, 12) + 0.0]


def text(value: float) -> str:
    """A number with at most ten decimals."""
    return f"{value:.10f}".rstrip("0").rstrip(".")
