"""What `recording.json` may hold, schema ``hecbench.recording/1``: keys, types, and what may be left out."""

from __future__ import annotations

from typing import Annotated, Literal

import msgspec

from hecbench.lens import OPENCV
from hecbench.recording import Mounting

SCHEMA = "hecbench.recording/1"

Matrix = list[list[float]]
Count = Annotated[int, msgspec.Meta(ge=0, le=100_000)]


class Strict(msgspec.Struct, forbid_unknown_fields=True, kw_only=True):
    """Unknown keys are refused."""


class RobotJson(Strict):
    """`robot`."""

    model: str | None = None
    urdf: str | None = None
    base_link: str | None = None
    flange_link: str | None = None
    joint_names: list[str] | None = None


class CameraJson(Strict):
    """`camera`."""

    width: Count
    height: Count
    K: Matrix | None = None
    distortion: list[float] | None = None
    distortion_model: str = OPENCV


class PointsJson(Strict, tag_field="kind", tag="points"):
    """A target of points."""

    points_m: Matrix


class ChessboardJson(Strict, tag_field="kind", tag="chessboard"):
    """As `hecbench.targets` describes it."""

    columns: Count
    rows: Count
    square_m: float


class CharucoJson(Strict, tag_field="kind", tag="charuco"):
    """As `hecbench.targets` describes it."""

    columns: Count
    rows: Count
    square_m: float
    marker_m: float
    dictionary: str
    legacy: bool | None = None


class AprilTagJson(Strict, tag_field="kind", tag="apriltag"):
    """As `hecbench.targets` describes it."""

    family: str
    id: Annotated[int, msgspec.Meta(ge=-1, le=100_000)]
    size_m: float


class ArucoJson(Strict, tag_field="kind", tag="aruco"):
    """As `hecbench.targets` describes it."""

    dictionary: str
    id: Count
    size_m: float


class ArucoGridJson(Strict, tag_field="kind", tag="aruco_grid"):
    """As `hecbench.targets` describes it."""

    columns: Count
    rows: Count
    marker_m: float
    gap_m: float
    dictionary: str
    first_id: Count = 0


class AprilGridJson(Strict, tag_field="kind", tag="aprilgrid"):
    """As `hecbench.targets` describes it."""

    columns: Count
    rows: Count
    tag_m: float
    spacing: float
    family: str = "tag36h11"
    first_id: Count = 0


TargetJson = (
    PointsJson | ChessboardJson | CharucoJson | AprilTagJson | ArucoJson | ArucoGridJson | AprilGridJson
)


class SampleJson(Strict):
    """One of `samples`."""

    id: str
    robot_stamp_s: float | None = None
    camera_stamp_s: float | None = None
    base_T_flange: Matrix | None = None
    joints_rad: list[float] | None = None
    camera_T_target: Matrix | None = None
    corners_px: list[list[float] | None] | None = None
    image: str | None = None
    mask: str | None = None
    depth: str | None = None


class RecordingJson(Strict):
    """The whole file."""

    schema: Literal["hecbench.recording/1"]
    name: str
    mounting: Mounting
    samples: list[SampleJson]
    robot: RobotJson | None = None
    camera: CameraJson | None = None
    target: TargetJson | None = None
    initial_parent_T_camera: Matrix | None = None
    truth_parent_T_camera: Matrix | None = None
