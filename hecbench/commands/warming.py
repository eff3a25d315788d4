"""Compile ahead what is compiled at first use: run what draws the robot once, on small photographs."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from time import perf_counter

from hecbench import preparation, registry
from hecbench.conformance.photographs import photographs
from hecbench.errors import Refusal
from hecbench.recording import Recording
from hecbench.running import solving
from hecbench.specs import Kind, Need, SegmenterSpec, SolverSpec

_SLOW_TO_RUN = "torch"
"""Solvers that import it descend for minutes; what they compile is small."""


@dataclass(frozen=True)
class Warmed:
    """What was run, and the seconds that it took."""

    subject: str
    seconds: float


def warm() -> Iterator[Warmed]:
    """Run every ready segmenter, and every solver that needs a robot model, on photographs with and without masks.

    What they compile stays on disk for this user and kind of processor, so that the first real call compiles nothing.
    How they end is not looked at: `hecbench conformance` does.
    """
    drawn = photographs()
    seen = {
        "photographs": replace(drawn, masks=None),
        "masks": replace(drawn, images=None),
        "photographs and masks": drawn,
    }
    found = registry.load()
    for segmenter in found.ready(Kind.SEGMENTER, SegmenterSpec):
        yield _timed(segmenter.name, partial(_segment, seen["photographs"], segmenter.name))
    for solver in found.ready(Kind.SOLVER, SolverSpec):
        if Need.ROBOT_MODEL in solver.needs and _SLOW_TO_RUN not in solver.imports:
            for what, recording in seen.items():
                yield _timed(f"{solver.name}, {what}", partial(solving.solve, recording, [solver]))


def _segment(recording: Recording, name: str) -> None:
    try:
        preparation.segmented(recording, name)
    except Refusal:
        return


def _timed(subject: str, call: Callable[[], object]) -> Warmed:
    start = perf_counter()
    call()
    return Warmed(subject, perf_counter() - start)
