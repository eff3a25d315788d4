"""Robots, grippers and cameras by name, with options from the command line."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from hecbench.errors import InputError

if TYPE_CHECKING:
    from contextlib import ExitStack

    from hecbench.specs import Kind


def device_settings(pairs: tuple[str, ...]) -> dict[str, dict[str, str]]:
    """Options by device from ``robot.x=1``, ``camera.y=2``, ``gripper.z=3``."""
    found: dict[str, dict[str, str]] = {"robot": {}, "camera": {}, "gripper": {}}
    for pair in pairs:
        key, separator, value = pair.partition("=")
        device, dot, name = key.partition(".")
        if not separator or not dot or device not in found:
            raise InputError(f"--set {pair}: write robot.NAME=VALUE, camera.NAME=VALUE or gripper.NAME=VALUE")
        found[device][name] = value
    return found


def open_device(kind: Kind, name: str, options: Mapping[str, str]) -> Any:
    """Open a device by name; an option that it does not take is refused."""
    from hecbench import registry
    from hecbench.specs import DeviceSpec

    spec = registry.load().get(kind, name, DeviceSpec)
    for option in options:
        if option not in spec.options:
            raise InputError(f"{kind} '{name}' has no option {option}: it takes {', '.join(spec.options)}")
    return spec.open(options)


def open_robot_and_camera(
    opened: ExitStack, robot: str, camera: str, given: Mapping[str, Mapping[str, str]]
) -> tuple[Any, Any]:
    """Open both until `opened` is closed; a camera that draws its pictures is shown the robot."""
    from hecbench.specs import Kind

    arm = open_device(Kind.ROBOT, robot, given["robot"])
    opened.callback(arm.close)
    eye = open_device(Kind.CAMERA, camera, given["camera"])
    opened.callback(eye.close)
    if hasattr(eye, "follow"):
        eye.follow(arm)
    return arm, eye
