"""The arm of the virtual lab as a device; the suite of recordings that are made there."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import replace
from typing import Any

from hecbench.recording import Recording
from hecbench.registry import hookimpl
from hecbench.specs import DeviceSpec, Kind, SuiteSpec
from hecbench_hardware.options import number

MARKERS, VIEWS, PHOTOGRAPHS, DEPTH = "markers", "views", "photographs", "depth"


def open_lab(options: Mapping[str, str]) -> Any:
    """The arm, in its home pose; nothing of it goes below `floor`, m."""
    from hecbench_hardware.lab.arm import LabRobot
    from hecbench_hardware.lab.cells import station

    robot = LabRobot(station(options.get("arm", "ur5e"), options.get("urdf")))
    box = robot.limits.workspace
    x, y, z = box.lower_m
    floor = replace(box, lower_m=(x, y, number(options, "floor", z)))
    robot.limits = replace(robot.limits, workspace=floor)
    return robot


def make(level: str, index: int, seed: int) -> Any:
    """One recording of the suite, drawn now."""
    from hecbench_hardware.lab import recordings

    makers: dict[str, Callable[[int, int], Recording]] = {
        MARKERS: recordings.marker_recording,
        VIEWS: recordings.view_recording,
        PHOTOGRAPHS: recordings.photograph_recording,
        DEPTH: recordings.depth_recording,
    }
    return makers[level](index, seed)


@hookimpl
def hecbench_robots() -> Iterable[DeviceSpec]:
    """The arm."""
    yield DeviceSpec(
        name="lab",
        kind=Kind.ROBOT,
        summary="the arm of the virtual lab, driven directly",
        imports=("mujoco",),
        open=open_lab,
        simulated=True,
        options=("arm", "urdf", "floor"),
    )


@hookimpl
def hecbench_suites() -> Iterable[SuiteSpec]:
    """Marker calibrations and pictures of the arm."""
    yield SuiteSpec(
        name="lab",
        summary="drawn in the virtual lab: poses with a tag, or pictures of the arm with masks, without, or with depth",
        imports=("mujoco",),
        levels=(MARKERS, VIEWS, PHOTOGRAPHS, DEPTH),
        default_samples=18,
        make=make,
    )
