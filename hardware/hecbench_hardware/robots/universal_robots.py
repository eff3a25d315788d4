"""UR3e, UR5e, UR10e on ur_rtde, and the same arms on a simulated controller that lives as long as they do."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from functools import partial
from pathlib import Path
from typing import Any

from hecbench.errors import InputError
from hecbench.registry import hookimpl
from hecbench.specs import DeviceSpec, Kind
from hecbench_hardware.kinematics import ARMS, UrArm
from hecbench_hardware.options import number, text

_COMMON = ("limits", "speed_slider", "max_age_s", "max_force_n", "leniency")


def _settings(options: Mapping[str, str]) -> dict[str, Any]:
    from hecbench_hardware.limits import Limits, load_limits
    from hecbench_hardware.ur.stream import Supervision

    usual = Supervision()
    supervision = Supervision(
        max_age_s=number(options, "max_age_s", usual.max_age_s),
        max_force_n=number(options, "max_force_n", usual.max_force_n),
        leniency=number(options, "leniency", usual.leniency),
    )
    slider = number(options, "speed_slider", 1.0) if "speed_slider" in options else None
    if slider is not None and not 0 < slider <= 1:
        raise InputError(f"speed_slider={slider} is not above 0 and at most 1")
    limits = load_limits(Path(options["limits"])) if "limits" in options else Limits()
    return {"limits": limits, "supervision": supervision, "speed_slider": slider}


def open_arm(arm: UrArm, options: Mapping[str, str]) -> Any:
    """Connect to a controller, read-only."""
    from hecbench_hardware.ur.robot import UrRobot

    return UrRobot(text(options, "host"), arm, **_settings(options))


def open_simulated(arm: UrArm, options: Mapping[str, str]) -> Any:
    """Start a simulated controller and connect to it; it ends when the robot is closed."""
    from hecbench_hardware.controller_sim.process import SimulatedController
    from hecbench_hardware.ur.robot import UrRobot

    class WithController(UrRobot):
        def close(self) -> None:
            super().close()
            controller.stop()

    controller = SimulatedController(
        options.get("host"), model=arm.name, time_scale=number(options, "time_scale", 1.0)
    ).start()
    try:
        return WithController(controller.host, arm, **_settings(options))
    except BaseException:
        controller.stop()
        raise


@hookimpl
def hecbench_robots() -> Iterable[DeviceSpec]:
    """Every arm, real and simulated."""
    for arm in ARMS.values():
        yield DeviceSpec(
            name=arm.name,
            kind=Kind.ROBOT,
            summary=f"Universal Robots {arm.name.upper()} through ur_rtde; read-only without --arm",
            imports=("rtde_control", "rtde_receive"),
            open=partial(open_arm, arm),
            simulated=False,
            options=("host", *_COMMON),
        )
        yield DeviceSpec(
            name=f"sim_{arm.name}",
            kind=Kind.ROBOT,
            summary=f"the same {arm.name.upper()} driver on a simulated controller",
            imports=("rtde_control", "rtde_receive"),
            open=partial(open_simulated, arm),
            simulated=True,
            options=("host", "time_scale", *_COMMON),
        )
