"""The verdict; the schema ``hecbench.verdict/1``."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import Any

import msgspec
from numpy.typing import NDArray

from hecbench import se3
from hecbench.errors import InputError
from hecbench.estimate import Estimate, decode, plain
from hecbench.system import files
from hecbench.system.wording import significant

SCHEMA = "hecbench.verdict/1"


class Grade(StrEnum):
    """The verdict in a word."""

    GOOD = "good"
    USABLE = "usable"
    DOUBTFUL = "doubtful"
    DO_NOT_USE = "do_not_use"

    @property
    def words(self) -> str:
        """As a person reads it."""
        return self.replace("_", " ")


@dataclass(frozen=True)
class Expected:
    """An expected error with its 95 % interval, mm."""

    value: float
    low: float
    high: float

    def __str__(self) -> str:
        return f"{significant(self.value)} mm [{significant(self.low)}, {significant(self.high)}]"


@dataclass(frozen=True)
class Agreement:
    """A method that agrees, how far away in the workspace, and what it looks at."""

    solver: str
    distance_mm: float
    evidence: str


@dataclass(frozen=True)
class Rival:
    """A method that does not agree, and why."""

    solver: str
    distance_mm: float
    reason: str


@dataclass(frozen=True, eq=False)
class Verdict:
    """What to use and what to expect.

    Attributes:
        recording: its name.
        grade: in a word.
        rule: why it is this grade, one sentence.
        recommended: the estimate to use; None when nothing can be said.
        expected: error in the workspace: rms over the corners of a 0.4 m cube about the mean flange position.
        at: error at the place that the user named, where one was.
        tolerance_mm: of the user.
        agreement: methods that agree, nearest first.
        rivals: methods that do not, nearest first.
        reasons: why the answer is believed or not, sentences.
        findings: of `check`, as JSON.
        next: what would make it better, sentences.
        estimates: all, best first.
    """

    recording: str
    grade: Grade
    rule: str
    recommended: Estimate | None
    expected: Expected | None
    at: Expected | None
    tolerance_mm: float
    agreement: Sequence[Agreement]
    rivals: Sequence[Rival]
    reasons: Sequence[str]
    findings: Sequence[dict[str, Any]]
    next: Sequence[str]
    estimates: Sequence[Estimate]

    def to_json(self) -> dict[str, Any]:
        """JSON values in the order of the schema."""
        best = self.recommended
        first = best or (self.estimates[0] if self.estimates else None)
        written = best.to_json() if best else {}
        content = {
            "schema": SCHEMA,
            "recording": self.recording,
            "grade": self.grade,
            "rule": self.rule,
            "recommended": best.solver if best else None,
            "mounting": first.mounting if first else None,
            "parent_link": first.parent_link if first else None,
            "parent_T_camera": written.get("parent_T_camera"),
            "camera": written.get("camera"),
            "tolerance_mm": self.tolerance_mm,
            "expected_error_mm": _numbers(self.expected),
            "expected_error_at_mm": _numbers(self.at),
            "agreement": [_fields(item) for item in self.agreement],
            "rivals": [_fields(item) for item in self.rivals],
            "reasons": list(self.reasons),
            "findings": list(self.findings),
            "next": list(self.next),
            "estimates": [estimate.to_json() for estimate in self.estimates],
        }
        return {key: plain(value) for key, value in content.items()}

    def recommended_first(self, estimates: Sequence[Estimate]) -> list[Estimate]:
        """The estimates with the recommended one moved to the front."""
        name = self.recommended.solver if self.recommended else None
        return sorted(estimates, key=lambda estimate: estimate.solver != name)

    def save(self, path: Path) -> None:
        """Write the JSON file, whole or not at all."""
        files.write_bytes(path, msgspec.json.format(msgspec.json.encode(self.to_json()), indent=1) + b"\n")


def _numbers(expected: Expected | None) -> dict[str, float] | None:
    return None if expected is None else _fields(expected)


def _fields(item: Any) -> dict[str, Any]:
    return {name: getattr(item, name) for name in item.__dataclass_fields__}


def spelled(parent_T_camera: NDArray[Any]) -> dict[str, list[float]]:
    """A transform as people copy it: translation m, quaternion xyzw, roll pitch yaw (rad, fixed axes x, y, z)."""
    return {
        "translation_m": [float(value) for value in parent_T_camera[:3, 3]],
        "quaternion_xyzw": [float(value) for value in se3.to_quat_xyzw(parent_T_camera)],
        "rpy_rad": [float(value) for value in se3.to_rpy(parent_T_camera[:3, :3])],
    }


def load(path: Path) -> Verdict:
    """Read a verdict file.

    Raises:
        InputError: missing, unreadable, or not of the schema.
    """
    try:
        content = msgspec.json.decode(files.read_bytes(path))
        if content["schema"] != SCHEMA:
            raise InputError(f"{path}: is not a {SCHEMA}")
        estimates = [decode(msgspec.json.encode(item), str(path)) for item in content["estimates"]]
        return Verdict(
            recording=content["recording"],
            grade=Grade(content["grade"]),
            rule=content["rule"],
            recommended=next((e for e in estimates if e.solver == content["recommended"]), None),
            expected=_expected(content["expected_error_mm"]),
            at=_expected(content["expected_error_at_mm"]),
            tolerance_mm=float(content["tolerance_mm"]),
            agreement=[Agreement(**item) for item in content["agreement"]],
            rivals=[Rival(**item) for item in content["rivals"]],
            reasons=content["reasons"],
            findings=content["findings"],
            next=content["next"],
            estimates=estimates,
        )
    except (msgspec.MsgspecError, KeyError, TypeError, ValueError) as error:
        again = "write it again with `hecbench calibrate --out`"
        raise InputError(f"{path}: is not a {SCHEMA} ({type(error).__name__}: {error}); {again}") from error


def _expected(numbers: dict[str, float] | None) -> Expected | None:
    return None if numbers is None else Expected(**numbers)
