"""Settings of the arm, and its end."""

from __future__ import annotations

from typing import Final

import numpy as np

from hecbench_hardware.controller_sim.arm import ScriptError
from hecbench_hardware.controller_sim.geometry import vector_of
from hecbench_hardware.controller_sim.program import Watchdog
from hecbench_hardware.controller_sim.signals import INPUTS, RobotMode
from hecbench_hardware.controller_sim.urscript.functions import builtins
from hecbench_hardware.controller_sim.urscript.machine import Machine
from hecbench_hardware.controller_sim.urscript.values import Value, number, pose, text, truth, vector

_ACTIONS = ("ignore", "pause", "stop")


def set_tcp(m: Machine, pose_: Value, tcp_name: Value = "") -> None:
    """The tool centre point, from the flange."""
    m.arm.set_tcp(vector_of(pose(pose_)))


def set_payload(m: Machine, m_: Value, cog: Value = None) -> None:
    """Mass of the tool and its centre of gravity, which stays without one."""
    m.arm.payload_kg = number(m_, "the mass")
    if cog is not None:
        m.arm.payload_cog_m = vector(cog, 3, "cog").tolist()


def set_target_payload(
    m: Machine, m_: Value, cog: Value, inertia: Value = None, transition_time: Value = 0
) -> None:
    """Mass, centre of gravity and inertia of the tool, at once."""
    set_payload(m, m_, cog)
    if inertia is not None:
        m.arm.payload_inertia = vector(inertia, 6, "inertia").tolist()


def set_payload_mass(m: Machine, m_: Value) -> None:
    """Mass of the tool."""
    set_payload(m, m_)


def set_payload_cog(m: Machine, CoG: Value) -> None:
    """Centre of gravity of the tool."""
    set_payload(m, m.arm.payload_kg, CoG)


def set_gravity(m: Machine, d: Value) -> None:
    """Acceleration of the base, m/s^2."""
    m.arm.gravity = vector(d, 3, "d").tolist()


def zero_ftsensor(m: Machine) -> None:
    """Forces from here on relative to the present ones."""
    m.arm.zero_force()


def enable_external_ft_sensor(
    m: Machine,
    enable: Value,
    sensor_mass: Value = 0.0,
    sensor_measuring_offset: Value = None,
    sensor_cog: Value = None,
) -> None:
    """Take the wrench that a client writes through RTDE."""
    m.arm.external_sensor = truth(enable, "enable")


def ft_rtde_input_enable(
    m: Machine,
    enable: Value,
    sensor_mass: Value = 0.0,
    sensor_measuring_offset: Value = None,
    sensor_cog: Value = None,
) -> None:
    """The newer name of the same."""
    enable_external_ft_sensor(m, enable)


def force_mode_set_damping(m: Machine, damping: Value) -> None:
    """Of a force loop without inertia: no effect."""
    number(damping, "damping")


def force_mode_set_gain_scaling(m: Machine, scaling: Value) -> None:
    """Of a force loop of one gain: no effect."""
    number(scaling, "scaling")


def rtde_set_watchdog(
    m: Machine, variable_name: Value, min_frequency: Value, action: Value = "pause"
) -> None:
    """End or pause the program when a client writes an input less often."""
    hertz = number(min_frequency, "min_frequency")
    verb = text(action, "action").lower()
    if text(variable_name, "variable_name") not in INPUTS or not hertz > 0 or verb not in _ACTIONS:
        raise ScriptError(f"it takes an RTDE input, a frequency above 0 and one of {', '.join(_ACTIONS)}")
    m.runner.watchdog = Watchdog(variable_name, hertz, verb, m.runner.wall_s)


def set_pos(m: Machine, q: Value) -> None:
    """Put the arm, which is a simulated one, to other joints at once."""
    m.arm.move(vector(q, 6, "q"))


def set_safety_mode_transition_hardness(m: Machine, type_: Value) -> None:
    """How abruptly speed limits act, of which there are none here."""
    number(type_, "type")


def position_deviation_warning(m: Machine, enabled: Value, threshold: Value = 0.8) -> None:
    """Warn of a deviation from the target, of which there is none here."""
    truth(enabled, "enabled")


def protective_stop(m: Machine) -> None:
    """Stop as after a collision."""
    m.arm.protective_stop("asked for by the program")


def powerdown(m: Machine) -> None:
    """Power off; the program ends with it."""
    m.arm.robot_mode, m.arm.joint_speeds = RobotMode.POWER_OFF, np.zeros(6)
    raise ScriptError("the program switched the arm off")


FUNCTIONS: Final = builtins(
    set_tcp,
    set_payload,
    set_target_payload,
    set_payload_mass,
    set_payload_cog,
    set_gravity,
    zero_ftsensor,
    enable_external_ft_sensor,
    ft_rtde_input_enable,
    force_mode_set_damping,
    force_mode_set_gain_scaling,
    rtde_set_watchdog,
    set_pos,
    set_safety_mode_transition_hardness,
    position_deviation_warning,
    protective_stop,
    powerdown,
)
