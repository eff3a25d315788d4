"""What a plugin declares: a name, one sentence, what it needs, and how to build it when it is used."""

from hecbench.recording import Need
from hecbench.specs.base import ConfigurableSpec, Kind, Option, Spec
from hecbench.specs.calibration import DatasetSpec, ObserverSpec, Solver, SolverSpec, SuiteSpec
from hecbench.specs.devices import DeviceSpec
from hecbench.specs.pictures import (
    Perceiver,
    PerceptionSpec,
    RobotSight,
    SegmenterSpec,
    Translator,
    TranslatorSpec,
)
from hecbench.specs.results import Evaluator, EvaluatorSpec, ExporterSpec, ResultSection

__all__ = [
    "AnySpec",
    "ConfigurableSpec",
    "DatasetSpec",
    "DeviceSpec",
    "Evaluator",
    "EvaluatorSpec",
    "ExporterSpec",
    "Kind",
    "Need",
    "ObserverSpec",
    "Option",
    "Perceiver",
    "PerceptionSpec",
    "ResultSection",
    "RobotSight",
    "SegmenterSpec",
    "Solver",
    "SolverSpec",
    "Spec",
    "SuiteSpec",
    "Translator",
    "TranslatorSpec",
]

AnySpec = (
    SolverSpec
    | DatasetSpec
    | SuiteSpec
    | ObserverSpec
    | EvaluatorSpec
    | ExporterSpec
    | SegmenterSpec
    | TranslatorSpec
    | PerceptionSpec
    | DeviceSpec
)
