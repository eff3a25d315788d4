"""The exporters of the project; the writing is done in `hecbench.exchange.export`."""

from __future__ import annotations

from collections.abc import Iterable

from hecbench.exchange import export
from hecbench.registry import hookimpl
from hecbench.specs import ExporterSpec


@hookimpl
def hecbench_exporters() -> Iterable[ExporterSpec]:
    """One per format."""
    yield ExporterSpec(
        name="ros",
        summary="a static_transform_publisher line for the shell (ROS 2, ROS 1 as a comment)",
        suffix=".sh",
        write=export.ros_static_transform,
    )
    yield ExporterSpec(
        name="urdf",
        summary="a fixed URDF joint",
        suffix=".urdf.xml",
        write=export.urdf_joint,
    )
    yield ExporterSpec(
        name="json",
        summary="matrix, quaternion, rotation vector, roll-pitch-yaw and covariance",
        suffix=".json",
        write=export.json_transform,
    )
    yield ExporterSpec(
        name="easy_handeye",
        summary="the calibration file of easy_handeye's publisher",
        suffix=".yaml",
        write=export.easy_handeye,
    )
    yield ExporterSpec(
        name="moveit",
        summary="a ROS 1 launch file like moveit_calibration's",
        suffix=".launch",
        write=export.moveit_launch,
    )
    yield ExporterSpec(
        name="moveit_ros2",
        summary="a ROS 2 launch file (Python) with the static transform",
        suffix=".launch.py",
        write=export.moveit_launch_ros2,
    )
    yield ExporterSpec(
        name="camera_info",
        summary="the calibrated lens as ROS's camera_info file (YAML)",
        suffix=".yaml",
        write=export.camera_info,
    )
