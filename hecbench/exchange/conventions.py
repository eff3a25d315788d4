"""Which reading of somebody's pose numbers is right: direction, unit, quaternion or Euler order, mounting.

A right reading makes the target stand still: with H the hand poses and C = camera_T_target there are
constant X and Y with ``C = inverse(X) @ H @ Y``, so the target pose seen through the calibration does not
move. A wrong one makes it move as much as the data do. `prove` fits every reading and keeps the one that
holds still.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from hecbench.errors import InputError
from hecbench.exchange.handedness import mirrored
from hecbench.exchange.pose_numbers import PoseConvention
from hecbench.exchange.stillness import (
    Stillness,
    length_factor,
    rotation_misfits,
    stillness,
    turns_about_one_axis,
)
from hecbench.recording import Mounting, hand_poses
from hecbench.samples import agreement
from hecbench.se3 import Array
from hecbench.system.wording import significant

HINTS_NAME = "hecbench-import.yaml"
"""The file beside other people's data that says what they do not (docs/adapters.md)."""

_CURE = f"write which is meant (mounting, robot_pose, target_pose ...) into {HINTS_NAME} beside it"

_STILL = agreement.LARGEST_SHARE
_CLEARLY_WORSE = 3.0
_LEAST_SAMPLES = 5
_ROTATION_SLACK = 0.1
"""Of the turns, by which rotations that are right may disagree: a degree of noise in ten."""
_CONVINCING = 0.1
"""Of the motion, as `Stillness.relative`: real cells leave 0.002 to 0.05."""
_SAME = 1e-6
_MOST_EXAMINED = 20
_MOST_NAMED = 3


@dataclass(frozen=True, eq=False)
class Proof:
    """The reading that was chosen; `note` says which, how still it holds the target, and what was refused.

    `robot_text` is the text of the robot's reading.
    """

    mounting: Mounting
    base_T_flange: Array
    camera_T_target: Array
    note: str
    robot_text: str


@dataclass(frozen=True, eq=False)
class _Candidate:
    mounting: Mounting
    robot: PoseConvention
    target: PoseConvention
    deviations: int
    stillness: Stillness

    def __str__(self) -> str:
        return f"{self.name} ({self.stillness})"

    @property
    def name(self) -> str:
        return f"{self.mounting}, {self.robot.text}, {self.target.text}"

    def beside(self, other: _Candidate) -> str:
        """Its name, without units that are the other's too."""
        units = [
            (mine.text.split(" in ", 1), its.text.split(" in ", 1)) for mine, its in self._pairs_with(other)
        ]
        short = [mine[0] if mine[1:] == its[1:] else " in ".join(mine) for mine, its in units]
        return f"{self.mounting} with {' and '.join(short)}"

    def _pairs_with(self, other: _Candidate) -> tuple[tuple[PoseConvention, PoseConvention], ...]:
        return (self.robot, other.robot), (self.target, other.target)

    @property
    def hand_poses(self) -> Array:
        return hand_poses(self.mounting, self.robot.poses)

    def reads_as(self, other: _Candidate) -> bool:
        """Whether both are the same poses under two names."""
        same = self.mounting is other.mounting
        return same and all(
            np.allclose(mine.poses, its.poses, atol=_SAME) for mine, its in self._pairs_with(other)
        )

    @property
    def sees_target(self) -> bool:
        return bool(np.median(self.target.poses[:, 2, 3]) > 0)


def prove(
    source: str,
    robot: Sequence[PoseConvention],
    target: Sequence[PoseConvention],
    mountings: Sequence[Mounting],
    mounting_given: bool = False,
) -> Proof:
    """The one combination of readings that holds the target still; documented readings go first.

    Unusual readings are tried when no usual one convinces. Turns about one axis prove nothing: then what is
    documented is kept.

    Args:
        source: names the data in notes and errors.
        robot: readings as base_T_flange (N, 4, 4).
        target: readings as camera_T_target (N, 4, 4).
        mountings: the documented or possible ones; the others count as deviations.
        mounting_given: the user vouches for the mounting; no other is tried.

    Raises:
        InputError: several readings hold it equally still (all are listed), or none is documented and none
            holds it still; what would make it hold still is named.
    """
    count = len(robot[0].poses)
    if count != len(target[0].poses):
        raise InputError(
            f"{source}: {count} robot poses for {len(target[0].poses)} target poses; pair them up"
        )
    candidates = list(_candidates(_usual(robot), _usual(target), mountings, mounting_given))
    if count >= _LEAST_SAMPLES and min(c.stillness.relative for c in candidates) > _CONVINCING:
        candidates = list(_candidates(robot, target, mountings, mounting_given))
    documented = [c for c in candidates if c.deviations == 0]
    settled = _count(robot) * _count(target) * len(mountings) == 1
    if count < _LEAST_SAMPLES:
        if len(documented) != 1:
            raise InputError(
                f"{source}: {count} samples cannot tell {len(documented)} possible readings apart; it takes "
                f"{_LEAST_SAMPLES}, or {_CURE}"
            )
        return _proof(documented[0], f"{source}: read as {documented[0].name}; too few samples to prove it")
    limit = min(_STILL, _CLEARLY_WORSE * min(c.stillness.relative for c in candidates) + 0.01)
    still = [c for c in candidates if c.stillness.relative <= limit]
    if any(turns_about_one_axis(c.robot.poses) for c in still or documented):
        return _documented_only(source, documented if settled else [])
    possible = still if settled else [c for c in still if c.sees_target] or still
    least = min((c.deviations for c in possible), default=0)
    fitting = _distinct([c for c in possible if c.deviations == least])
    if len(fitting) > 1:
        fitting = [c for c in fitting if c.sees_target] or fitting
    if len(fitting) > 1:
        raise InputError(
            f"{source}: {len(fitting)} readings hold the target equally still: "
            f"{'; '.join(map(str, fitting[:6]))}; {_CURE}"
        )
    if fitting:
        return _proof(
            fitting[0], f"{source}: {_margin(fitting[0], candidates, still, documented if settled else [])}"
        )
    return _as_documented(source, candidates, documented if settled else [], (robot, target))


def _as_documented(
    source: str,
    candidates: Sequence[_Candidate],
    documented: Sequence[_Candidate],
    streams: tuple[Sequence[PoseConvention], Sequence[PoseConvention]],
) -> Proof:
    """The documented reading, where none holds still; without one an error that names the cause."""
    ranked = sorted(candidates, key=lambda c: c.stillness.relative)
    if documented:
        note = f"{source}: read as documented, {documented[0]}; no reading holds the target still, "
        return _proof(documented[0], note + f"the best is {ranked[0]}: pairs mixed up, or too little motion?")
    raise InputError(
        f"{source}: no reading holds the target still{_cause(ranked, *streams)}; the best are "
        f"{'; '.join(map(str, ranked[:3]))}; check the pairing of robot and target poses, or {_CURE}"
    )


def _usual(stream: Sequence[PoseConvention]) -> Sequence[PoseConvention]:
    return [reading for reading in stream if not reading.unusual] or stream


def _count(stream: Sequence[PoseConvention]) -> int:
    """How many readings depart from nothing that is documented."""
    return sum(reading.deviations == 0 for reading in stream)


def _documented_only(source: str, documented: Sequence[_Candidate]) -> Proof:
    """What is documented, where the motion proves nothing."""
    if not documented:
        raise InputError(
            f"{source}: one axis of rotation proves no convention, and none is documented; turn the hand about two "
            f"axes, or {_CURE}"
        )
    name = documented[0].name
    return _proof(
        documented[0], f"{source}: read as documented, {name}; one axis of rotation proves no convention"
    )


def _distinct(fitting: Sequence[_Candidate]) -> list[_Candidate]:
    """Those that differ in their poses, not only in name."""
    found: list[_Candidate] = []
    for candidate in fitting:
        if not any(candidate.reads_as(other) for other in found):
            found.append(candidate)
    return found


def _margin(
    best: _Candidate,
    candidates: Sequence[_Candidate],
    still: Sequence[_Candidate],
    documented: Sequence[_Candidate],
) -> str:
    """What was chosen, how still it holds the target, and how far behind the others are."""
    note = f"read as {best.name}, which holds the target still to {best.stillness}"
    if not best.sees_target:
        note += " but puts it behind the camera"
    if best.deviations and documented:
        usual = min(documented, key=lambda c: c.stillness.relative)
        note += f"; the documented reading does not: {usual}"
    rivals = [] if documented else _distinct([c for c in still if not c.reads_as(best)])[:_MOST_NAMED]
    worse = [c.stillness.relative for c in candidates if c not in still]
    if rivals:
        names = " or ".join(rival.beside(best) for rival in rivals)
        note += f"; {names} would fit as well: if that is meant, {_CURE}"
    elif worse:
        note += f"; the next leaves {significant(min(worse) / max(best.stillness.relative, 1e-9), 3)} times as much"
    return note


def _cause(
    ranked: Sequence[_Candidate], robot: Sequence[PoseConvention], target: Sequence[PoseConvention]
) -> str:
    """What would make a reading hold still: another unit, or the other handedness."""
    for what, turned in mirrored(_usual(robot)):
        best = min(
            _candidates(turned, _usual(target), list(Mounting), False),
            key=lambda c: (
                c.stillness.relative > _CONVINCING,
                c.deviations,
                not c.sees_target,
                c.stillness.relative,
            ),
        )
        if best.stillness.relative < _CONVINCING:
            return f", but {best.name} does once {what}"
    for candidate in sorted(ranked[:_MOST_EXAMINED], key=lambda c: c.deviations):
        hand, seen = candidate.hand_poses, candidate.target.poses
        scaled = seen.copy()
        scaled[:, :3, 3] *= (factor := length_factor(hand, seen))
        if factor > 0 and stillness(hand, scaled).relative < _CONVINCING:
            return (
                f", but {candidate.name} does once the target's lengths are {significant(factor, 4)}"
                " times as long: correct the unit of one of the two"
            )
    return ""


def _proof(chosen: _Candidate, note: str) -> Proof:
    return Proof(chosen.mounting, chosen.robot.poses, chosen.target.poses, note, chosen.robot.text)


def _candidates(
    robot: Sequence[PoseConvention],
    target: Sequence[PoseConvention],
    mountings: Sequence[Mounting],
    mounting_given: bool,
) -> Iterator[_Candidate]:
    """Combinations worth fitting: those whose rotations agree, and the one that is documented."""
    hands = [
        (mounting, reading) for reading in robot for mounting in (mountings if mounting_given else Mounting)
    ]
    misfits = rotation_misfits(
        [hand_poses(mounting, reading.poses) for mounting, reading in hands],
        [reading.poses for reading in target],
    )
    best = np.sort(misfits, axis=None)[:_MOST_EXAMINED]
    limit = max(best[-1], min(_CLEARLY_WORSE * best[0], _STILL) + _ROTATION_SLACK)
    own = [reading.deviations + (mounting not in mountings) for mounting, reading in hands]
    departures = np.add.outer(own, [reading.deviations for reading in target])
    documented = departures == 0
    too_few = len(robot[0].poses) < _LEAST_SAMPLES
    for i, j in np.argwhere((misfits <= limit) | (documented & (too_few | (documented.sum() == 1)))):
        mounting, reading = hands[i]
        still = stillness(hand_poses(mounting, reading.poses), target[j].poses)
        yield _Candidate(mounting, reading, target[j], int(departures[i, j]), still)
