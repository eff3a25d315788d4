"""What a trial leaves: the schema ``hecbench.trial/1`` and its append-only file ``trials.jsonl``.

Reading skips what is damaged and counts what was written twice once.
"""

from __future__ import annotations

from contextlib import AbstractContextManager
from dataclasses import dataclass
from enum import StrEnum
from pathlib import Path
from typing import Any, Literal

import msgspec

from hecbench.errors import InputError
from hecbench.storage import journal

FILE_NAME = "trials.jsonl"

TASKS = ("grasp", "insertion")

Key = tuple[str, str, str, str, int, float, int]


class Outcome(StrEnum):
    """How a trial ended. An aborted one says nothing about the calibration and is repeated."""

    SUCCESS = "success"
    FAILURE = "failure"
    ABORTED = "aborted"


class TrialRecord(msgspec.Struct, kw_only=True, forbid_unknown_fields=True):
    """One trial. Lengths are millimetres, as the names say."""

    schema: Literal["hecbench.trial/1"] = "hecbench.trial/1"
    task: str
    robot: str
    """Arm and cell."""
    method: str
    calibration: str
    """Which of the calibrations of the method: trials that share it are not independent."""
    place: int
    """Where the workpiece stood."""
    clearance_mm: float
    seed: int
    outcome: Outcome
    reason: str
    state: str
    """The state in which it ended."""
    margin_mm: float | None = None
    """What was left of the tightest tolerance; negative when exceeded, None when it was not measured."""
    closed_form_success: bool | None = None
    """What the formula says of the same end point."""
    attempt: int = 1
    seconds: dict[str, float] = {}
    """Spent in each state."""
    calibration_errors: dict[str, float] = {}
    """Of the estimate: tre_mm, translation_error_mm, rotation_error_deg, where truth is known."""
    tag_error_mm: float | None = None
    object_error_mm: float | None = None
    """How far the point to reach was from where it was believed to be."""
    provenance: dict[str, Any] = {}

    @property
    def key(self) -> Key:
        """What makes a trial the same trial."""
        return (
            self.task,
            self.robot,
            self.method,
            self.calibration,
            self.place,
            self.clearance_mm,
            self.seed,
        )


@dataclass(frozen=True)
class Contents:
    """What a file of trials holds.

    Attributes:
        trials: finished ones in the order written, each once.
        aborted: those that ended without a verdict, each time.
        damage: one sentence for each damaged line.
    """

    trials: list[TrialRecord]
    aborted: list[TrialRecord]
    damage: list[str]


def read(folder: Path) -> Contents:
    """Read every whole line.

    Raises:
        InputError: there are no trials in the folder.
    """
    path = folder / FILE_NAME
    if not path.is_file():
        raise InputError(f"{folder}: holds no trials ({FILE_NAME}); make some with `hecbench trial`")
    trials: dict[Key, TrialRecord] = {}
    aborted, damage = [], []
    decoder = msgspec.json.Decoder(TrialRecord)
    for number, line in journal.lines(path):
        try:
            trial = decoder.decode(line)
        except (msgspec.MsgspecError, UnicodeDecodeError):
            damage.append(f"{path}:{number}: damaged, {len(line)} bytes skipped; --resume makes it again")
            continue
        if trial.outcome is Outcome.ABORTED:
            aborted.append(trial)
        else:
            trials.setdefault(trial.key, trial)
    return Contents(list(trials.values()), aborted, damage)


def picture_name(robot: str, task: str, suffix: str) -> str:
    """What a picture of one of an arm's trials is called beside the file: png, what the camera saw; gif, a motion."""
    return f"{robot}_{task}.{suffix}"


def writing(folder: Path, *, resume: bool) -> AbstractContextManager[journal.Writer[TrialRecord]]:
    """Open the file of a folder for appending.

    Raises:
        InputError: it holds trials and `resume` is False, or another process writes to it.
        HecbenchError: the folder cannot be written.
    """
    return journal.writing(
        folder / FILE_NAME,
        msgspec.json.encode,
        resume=resume,
        holds="trials",
        busy="other trials are written here; wait for them",
    )
