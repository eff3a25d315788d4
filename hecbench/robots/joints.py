"""Joints of a robot: what moves, what follows, and what a position beyond the limits most likely means."""

from __future__ import annotations

from dataclasses import dataclass, replace
from enum import StrEnum
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from hecbench.errors import InputError
from hecbench.se3 import Array
from hecbench.system.wording import significant

_HAIR = 0.005
"""Of a joint's range: encoders and rounded limits stray by less; a wrong unit or order by far more."""
_MOST_HAIR = 0.01
"""rad or m: 0.6 deg, for joints of a large range."""


class Motion(StrEnum):
    """What a joint does with its position."""

    FIXED = "fixed"
    REVOLUTE = "revolute"
    PRISMATIC = "prismatic"


@dataclass(frozen=True, eq=False)
class Joint:
    """One URDF joint. A mimic joint moves with `leader`: ``position = multiplier * leader + offset``."""

    name: str
    motion: Motion
    parent: str
    child: str
    origin: Array
    """parent_T_joint (4, 4) at position zero."""
    axis: Array
    """Unit axis (3,) in the joint frame."""
    lower: float = -np.inf
    upper: float = np.inf
    leader: str | None = None
    multiplier: float = 1.0
    offset: float = 0.0

    @property
    def kind(self) -> str:
        """Its type as a URDF spells it."""
        unlimited = self.motion is Motion.REVOLUTE and not np.isfinite([self.lower, self.upper]).all()
        return "continuous" if unlimited else str(self.motion)

    @property
    def hair(self) -> float:
        """How far beyond its limits a position is still accepted, rad or m."""
        span = self.upper - self.lower
        return min(_HAIR * span, _MOST_HAIR) if np.isfinite(span) else _MOST_HAIR

    def is_beyond(self, positions: Array) -> NDArray[np.bool_]:
        """Which positions are outside the limits, by however little."""
        return np.asarray((positions < self.lower) | (positions > self.upper))

    def refuses(self, positions: Array) -> NDArray[np.bool_]:
        """Which positions are outside the limits by more than a hair."""
        return np.asarray((positions < self.lower - self.hair) | (positions > self.upper + self.hair))

    def reason(self, position: float) -> str:
        """Why a position is refused, and the cure."""
        limits = f"{significant(self.lower, 4)} to {significant(self.upper, 4)}"
        if self.lower > self.upper:
            return f"the URDF's limits of {self.name} are reversed ({limits}): swap lower and upper in its <limit>"
        if self.lower == self.upper:
            return (
                f"the URDF limits {self.name} to {self.lower:g}..{self.upper:g}, but it is at "
                f"{significant(position, 4)}: "
                "correct its <limit>"
            )
        outside = f"{self.name} at {significant(position, 4)} is outside its limits {limits}"
        small = np.deg2rad(position) if self.motion is Motion.REVOLUTE else position / 1000
        if not self.refuses(np.array(small)):
            units = (
                "degrees instead of radians"
                if self.motion is Motion.REVOLUTE
                else "millimetres instead of metres"
            )
            return f"{outside}: {units}, or another joint order?"
        return f"{outside}: another joint order, or a wrong <limit> in the URDF?"


def resolved(joints: tuple[Joint, ...], path: Path, notes: list[str]) -> tuple[Joint, ...]:
    """The joints with chains of mimic joints led by the one at their head.

    Raises:
        InputError: a mimic joint follows one that is not there, or itself.
    """
    by_name = {joint.name: joint for joint in joints}
    done = []
    for joint in joints:
        head, multiplier, offset = joint, 1.0, 0.0
        seen = {joint.name}
        while head.leader is not None:
            if head.leader not in by_name:
                raise InputError(
                    f"{path}: joint '{head.name}' mimics '{head.leader}', which is not there: correct <mimic joint=...>"
                )
            offset += multiplier * head.offset
            multiplier *= head.multiplier
            head = by_name[head.leader]
            if head.name in seen:
                raise InputError(f"{path}: joint '{joint.name}' mimics itself: correct <mimic joint=...>")
            seen.add(head.name)
        if head is joint:
            done.append(joint)
            continue
        if head.motion is Motion.FIXED:
            notes.append(f"joint '{joint.name}' mimics '{head.name}', which is fixed: it stays at {offset:g}")
        done.append(replace(joint, leader=head.name, multiplier=multiplier, offset=offset))
    return tuple(done)


def ordered(joints: list[Joint], links: list[str], path: Path) -> tuple[tuple[Joint, ...], tuple[str, ...]]:
    """Joints parents first and the links root first; refuses anything that is not one tree."""
    known = set(links)
    for joint in joints:
        for link in (joint.parent, joint.child):
            if link not in known:
                raise InputError(
                    f"{path}: joint '{joint.name}' hangs on no link of the tree: there is no '{link}'; correct the "
                    f'joint, or add <link name="{link}"/>'
                )
    if not links:
        raise InputError(
            f"{path}: the robot has no <link>: is it an SRDF, or an xacro that is still to be expanded? Give the "
            "expanded URDF"
        )
    children = {joint.child for joint in joints}
    roots = [link for link in links if link not in children]
    if not roots:
        raise InputError(
            f"{path}: every link is some joint's child, so the joints form a loop: remove the joint that closes it"
        )
    if len(roots) > 1:
        raise InputError(
            f"{path}: a robot has one root link, this has {len(roots)}: {', '.join(roots)}: join them by a fixed "
            "joint, or remove what does not belong to the robot"
        )
    below: dict[str, list[Joint]] = {}
    for joint in joints:
        below.setdefault(joint.parent, []).append(joint)
    done: list[Joint] = []
    waiting = list(below.get(roots[0], ()))
    while waiting:
        done.append(waiting.pop(0))
        waiting += below.get(done[-1].child, ())
    if len(done) < len(joints):
        lost = next(joint for joint in joints if joint not in done)
        raise InputError(
            f"{path}: joint '{lost.name}' hangs on no link of the tree: it is part of a loop; remove the joint that "
            "closes it"
        )
    return tuple(done), (roots[0], *(joint.child for joint in done))
