"""Options of devices: strings by name, read with one line about what is wrong."""

from __future__ import annotations

from collections.abc import Mapping

from hecbench.errors import InputError

_TRUE, _FALSE = {"1", "true", "yes", "on"}, {"", "0", "false", "no", "off"}


def text(options: Mapping[str, str], name: str, default: str | None = None) -> str:
    """The option as given; without a default it must be."""
    value = options.get(name, default)
    if value is None:
        raise InputError(f"the device needs {name}=...")
    return value


def number(options: Mapping[str, str], name: str, default: float) -> float:
    """The option as a finite number."""
    raw = options.get(name)
    try:
        value = default if raw is None else float(raw)
    except ValueError:
        raise InputError(f"{name}={raw} is not a number") from None
    if not abs(value) < float("inf"):
        raise InputError(f"{name}={raw} is not finite")
    return value


def flag(options: Mapping[str, str], name: str) -> bool:
    """The option as yes or no; absent is no."""
    raw = options.get(name, "").lower()
    if raw not in _TRUE | _FALSE:
        raise InputError(f"{name}={raw} is neither yes nor no")
    return raw in _TRUE
