"""The suite `photographs`: a real robot, small enough to come with the package, for `hecbench demo`."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path

from hecbench.recording import Recording
from hecbench.registry import hookimpl
from hecbench.specs import SuiteSpec
from hecbench.storage import recording_io

UR3E = "ur3e"
FOLDER = Path(__file__).parent / "ur3e_photographs"


def make(level: str, index: int, seed: int) -> Recording:
    """The recording, always the same: 12 photographs of a UR3e with a chessboard on its flange."""
    return recording_io.load(FOLDER)


@hookimpl
def hecbench_suites() -> Iterable[SuiteSpec]:
    """This file's suite."""
    yield SuiteSpec(
        name="photographs",
        summary="12 photographs of a real UR3e that come with the package",
        levels=(UR3E,),
        default_samples=1,
        make=make,
    )
