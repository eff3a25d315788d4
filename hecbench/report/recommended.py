"""Which estimate of a folder of results is meant when a person asks for one."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from hecbench import estimate, verdict
from hecbench.errors import InputError
from hecbench.estimate import Estimate, Status, best_first
from hecbench.recording import Recording
from hecbench.storage import results


def of(path: Path) -> Estimate:
    """The estimate of a file; of a folder what the verdict recommends, else the first answer of its one recording.

    Raises:
        InputError: there is no estimate, or there are those of several recordings.
    """
    if not path.is_dir():
        return estimate.load(path)
    judged = path / results.VERDICT_NAME
    if judged.exists():
        found = verdict.load(judged)
        if found.recommended is None:
            raise InputError(f"{judged}: recommends no answer: {found.rule}")
        return found.recommended
    estimates = results.read(path).estimates
    recordings = {each.recording for each in estimates}
    if len(recordings) > 1:
        raise InputError(
            f"{path}: holds results of {len(recordings)} recordings; export a single estimate's file"
        )
    best = best_first(estimates)[0]
    if best.status is not Status.OK:
        raise InputError(f"{path}: no method has an answer")
    return best


def all_of(paths: Sequence[Path], recording: Recording) -> list[Estimate]:
    """Every answer on a recording in files and folders, without doubles; the recommended one of a folder first.

    Raises:
        InputError: one is for another mounting or parent, or none has an answer.
    """
    found: dict[str, Estimate] = {}
    for path in paths:
        more = [of(path), *(results.read(path).estimates if path.is_dir() else ())]
        for each in more:
            if (each.mounting, each.parent_link) != (recording.mounting, recording.parent_link):
                raise InputError(
                    f"{path}: is {each.mounting} from {each.parent_link}, not of {recording.name}"
                )
            if each.status is Status.OK:
                found.setdefault(each.solver, each)
    if not found:
        raise InputError(f"{paths[0]}: has no answer to show")
    return list(found.values())
