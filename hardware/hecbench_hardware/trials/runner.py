"""All trials of a plan into one append-only file: resumable, each trial counted once."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from hecbench import registry
from hecbench.errors import InputError
from hecbench.registry import TrialObserver
from hecbench.storage import trial_record
from hecbench.storage.journal import Writer
from hecbench.storage.trial_record import Contents, Outcome, TrialRecord
from hecbench_hardware.devices import DeviceFault
from hecbench_hardware.trials import solids
from hecbench_hardware.trials.cell import Calibration, TrialCell
from hecbench_hardware.trials.tasks import Task
from hecbench_hardware.trials.trial import Trial

_ATTEMPTS = 3


@dataclass(frozen=True)
class Plan:
    """Every calibration at every place.

    Attributes:
        task: What is tried.
        calibrations: With which.
        clearance_m: Of the hole.
        most: Trials of each method at most; None for all.
        seed: For the records.
        provenance: For the records.
    """

    task: Task
    calibrations: Sequence[Calibration]
    clearance_m: float = solids.CLEARANCE_M
    most: int | None = None
    seed: int = 0
    provenance: dict[str, Any] = field(default_factory=dict)

    def pairs(self, places: int) -> list[tuple[Calibration, int]]:
        """Calibration and place of every trial, in order."""
        count: dict[str, int] = {}
        chosen = []
        for calibration in self.calibrations:
            for place in range(places):
                count[calibration.method] = count.get(calibration.method, 0) + 1
                if self.most is None or count[calibration.method] <= self.most:
                    chosen.append((calibration, place))
        return chosen


def run(
    plan: Plan,
    cell: TrialCell,
    out: Path,
    *,
    resume: bool = False,
    acknowledge: Callable[[str], bool] = lambda line: False,
    report: Callable[[TrialRecord], object] = lambda trial: None,
    warn: Callable[[str], object] = lambda line: None,
) -> Contents:
    """Carry out what is not there yet; a trial is on disk before the next one begins.

    Each trial goes to `report` and to the plugins that observe trials; `warn` hears of those that fail.

    Raises:
        InputError: The folder holds other trials, or is in use.
        DeviceFault: A device failed and was not made ready; the trials so far are kept, `resume` goes on.
    """
    if not plan.calibrations:
        raise InputError("there is no calibration to try: give --estimate or --offset-mm")
    observers = dict(registry.load().trial_observers)

    def tell(trial: TrialRecord) -> None:
        report(trial)
        _observe(trial, observers, warn)

    with trial_record.writing(out, resume=resume) as writer:
        done = {trial.key for trial in trial_record.read(out).trials}
        for calibration, place in plan.pairs(cell.places):
            trial = Trial(cell, plan.task, calibration, place, plan.clearance_m, plan.seed, acknowledge)
            if _key(trial) not in done:
                _until_decided(trial, writer, plan.provenance, tell)
    return trial_record.read(out)


def _observe(trial: TrialRecord, observers: dict[str, TrialObserver], warn: Callable[[str], object]) -> None:
    """Call every observer; one that fails is named, once, and not called again."""
    for name, observer in list(observers.items()):
        try:
            observer(trial=trial)
        except Exception as error:  # a stranger's function may raise anything
            del observers[name]
            what = f"{type(error).__name__}: {error}".splitlines()[0]
            warn(f"{name}: its hecbench_trial_finished failed ({what}) and is not called again")


def _key(trial: Trial) -> trial_record.Key:
    calibration = trial.calibration
    clearance_mm = 1e3 * trial.clearance_m
    return (
        trial.task,
        trial.cell.name,
        calibration.method,
        calibration.name,
        trial.place,
        clearance_mm,
        trial.seed,
    )


def _until_decided(
    trial: Trial,
    writer: Writer[TrialRecord],
    provenance: dict[str, Any],
    report: Callable[[TrialRecord], object],
) -> None:
    """Repeat an aborted trial; every attempt leaves a line."""
    for attempt in range(1, _ATTEMPTS + 1):
        record, fault = trial.run(attempt)
        record.provenance = provenance
        writer.append([record])
        report(record)
        if fault is not None:
            raise _kept(fault)
        if record.outcome is not Outcome.ABORTED:
            return


def _kept(fault: DeviceFault) -> DeviceFault:
    fault.args = (f"{fault}; the trials so far are kept, --resume goes on",)
    return fault
