"""The verdict on a recording in the making, in a process of its own so that the live picture goes on."""

from __future__ import annotations

from pathlib import Path

from hecbench import preparation
from hecbench.recording import Recording
from hecbench.running import calibrating, planning
from hecbench.running.solving import Options
from hecbench.specs import SolverSpec
from hecbench.verdict import Verdict

_GUESS_FREE = "render_gn_free"


def quick_solvers(recording: Recording) -> list[SolverSpec]:
    """Those that answer at once; where only the robot itself is seen, the one that needs neither start nor masks."""
    able = planning.solvers_for((), recording)
    return [spec for spec in able if not spec.slow] or [spec for spec in able if spec.name == _GUESS_FREE]


def judge(folder: Path, tolerance_mm: float) -> Verdict | None:
    """The verdict of the quick methods on the recording in a folder; None when none of them can use it."""
    recording = preparation.load_recording(folder).without_truth()
    if not (specs := quick_solvers(recording)):
        return None
    examined = calibrating.examine(recording)
    estimates = calibrating.solved(examined, specs, Options())
    return calibrating.judged(examined, specs, estimates, tolerance_mm)
