"""Arguments that the simulated controller takes and does not act on: each is said when a program gives it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, Final

from hecbench_hardware.controller_sim.urscript.values import Value


@dataclass(frozen=True)
class Unsimulated:
    """An argument, which of its values ask for nothing, and what happens instead of what it asks for."""

    parameter: str
    instead: str
    asks_for_nothing: Callable[[Value], bool]

    def said(self, value: Value) -> str | None:
        """What is to be said about a value."""
        return None if self.asks_for_nothing(value) else f"{self.parameter}: {self.instead}"


def _zero(value: Value) -> bool:
    return value is None or value == 0 or (isinstance(value, list) and all(part == 0 for part in value))


def _never(_: Value) -> bool:
    return False


def _is(*values: Any) -> Callable[[Value], bool]:
    return lambda value: any(type(value) is type(other) and value == other for other in values)


BLEND: Final = Unsimulated("r", "the arm stops at the point instead of blending", _zero)
_SENSOR: Final = tuple(
    Unsimulated(name, "the wrench is taken as it is written", _zero)
    for name in ("sensor_mass", "sensor_measuring_offset", "sensor_cog")
)
_NO_INERTIA: Final = "the force loop has no inertia and one gain"
_ROTATION: Final = Unsimulated("aRot", "the rotation changes at the pace of the translation", _is("a"))

UNSIMULATED: Final[dict[str, tuple[Unsimulated, ...]]] = {
    **dict.fromkeys(("movej", "movel", "movep", "optimovej", "optimovel"), (BLEND,)),
    "movec": (BLEND, Unsimulated("mode", "the orientation turns evenly to that of the target", _zero)),
    "servoj": (
        Unsimulated("lookahead_time", "the arm follows as fast as its joints may", _never),
        Unsimulated("gain", "the arm follows as fast as its joints may", _never),
    ),
    "servoc": tuple(Unsimulated(name, "the arm follows as fast as its joints may", _never) for name in "avr"),
    "speedl": (_ROTATION,),
    "stopl": (_ROTATION,),
    "direct_torque": (
        Unsimulated("friction_comp", "the joints have no friction", _is(True)),
        Unsimulated("viscous_scale", "the joints have no friction", _is(None)),
        Unsimulated("coulomb_scale", "the joints have no friction", _is(None)),
    ),
    "freedrive_mode": (
        Unsimulated("freeAxes", "all axes are free", _is(None, [1] * 6)),
        Unsimulated("feature", "all axes are free", _is(None)),
    ),
    "enable_external_ft_sensor": _SENSOR,
    "ft_rtde_input_enable": _SENSOR,
    "set_target_payload": (Unsimulated("transition_time", "the payload changes at once", _zero),),
    "force_mode_set_damping": (Unsimulated("damping", _NO_INERTIA, _never),),
    "force_mode_set_gain_scaling": (Unsimulated("scaling", _NO_INERTIA, _never),),
    "set_safety_mode_transition_hardness": (Unsimulated("type", "there are no reduced speeds", _never),),
    "position_deviation_warning": (
        Unsimulated("enabled", "the arm never deviates from its target", _is(False)),
        Unsimulated("threshold", "the arm never deviates from its target", _is(0.8)),
    ),
}
"""By function; the rest of the library acts on all of its arguments."""
