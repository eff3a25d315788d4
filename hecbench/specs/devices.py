"""Robots, grippers and cameras."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from hecbench.specs.base import Kind, Spec


@dataclass(frozen=True, kw_only=True)
class DeviceSpec(Spec):
    """A robot, gripper or camera. `open(options)` imports the SDK and connects."""

    kind: Kind
    open: Callable[[Mapping[str, str]], Any]
    simulated: bool
    options: tuple[str, ...] = field(default=())
