"""The hooks a plugin may implement. All but the last yield specs of `hecbench.specs`; importing one stays cheap."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

import pluggy

from hecbench.specs import (
    DatasetSpec,
    DeviceSpec,
    EvaluatorSpec,
    ExporterSpec,
    ObserverSpec,
    SegmenterSpec,
    SolverSpec,
    SuiteSpec,
    TranslatorSpec,
)

if TYPE_CHECKING:
    from hecbench.storage.trial_record import TrialRecord

GROUP = "hecbench"
"""The entry-point group and the prefix of every hook."""

hookspec = pluggy.HookspecMarker(GROUP)


@hookspec
def hecbench_solvers() -> Iterable[SolverSpec]:
    """Calibration methods."""
    raise NotImplementedError


@hookspec
def hecbench_datasets() -> Iterable[DatasetSpec]:
    """Readers of recordings on disk."""
    raise NotImplementedError


@hookspec
def hecbench_suites() -> Iterable[SuiteSpec]:
    """Generated recordings by name and level."""
    raise NotImplementedError


@hookspec
def hecbench_observers() -> Iterable[ObserverSpec]:
    """Observations computed from rawer ones: corners from images, poses from corners."""
    raise NotImplementedError


@hookspec
def hecbench_evaluators() -> Iterable[EvaluatorSpec]:
    """Rulers: numbers computed from an estimate and its recording."""
    raise NotImplementedError


@hookspec
def hecbench_exporters() -> Iterable[ExporterSpec]:
    """Writers of an estimate in other people's formats."""
    raise NotImplementedError


@hookspec
def hecbench_segmenters() -> Iterable[SegmenterSpec]:
    """Robot masks from images."""
    raise NotImplementedError


@hookspec
def hecbench_translators() -> Iterable[TranslatorSpec]:
    """Real-to-simulated image translation."""
    raise NotImplementedError


@hookspec
def hecbench_robots() -> Iterable[DeviceSpec]:
    """Robot arms, simulated and real."""
    raise NotImplementedError


@hookspec
def hecbench_grippers() -> Iterable[DeviceSpec]:
    """Grippers, simulated and real."""
    raise NotImplementedError


@hookspec
def hecbench_cameras() -> Iterable[DeviceSpec]:
    """Cameras, simulated and real."""
    raise NotImplementedError


@hookspec
def hecbench_trial_finished(trial: TrialRecord) -> None:
    """Called after each trial, an aborted one too, once it is on disk; what it raises does not end the run."""
    raise NotImplementedError
