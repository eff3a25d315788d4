"""What a plugin declares: a name, one sentence, what it needs, and how to build it when it is used."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import StrEnum
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, ClassVar, Protocol, Self

import numpy as np
from numpy.typing import NDArray

from hecbench.errors import InputError
from hecbench.recording import Need as Need

if TYPE_CHECKING:
    from hecbench.estimate import Estimate
    from hecbench.recording import Recording


class Kind(StrEnum):
    """The kinds of plugin, as the command line spells them."""

    SOLVER = "solver"
    DATASET = "dataset"
    SUITE = "suite"
    OBSERVER = "observer"
    EVALUATOR = "evaluator"
    EXPORTER = "exporter"
    SEGMENTER = "segmenter"
    TRANSLATOR = "translator"
    PERCEPTION = "perception"
    ROBOT = "robot"
    GRIPPER = "gripper"
    CAMERA = "camera"


class Solver(Protocol):
    """A calibration method: a recording without its truth goes in, an estimate with evidence comes out."""

    def __call__(self, recording: Recording, *, rng: np.random.Generator) -> Estimate:
        """Answer, or raise `Refusal` (cannot on this recording) or `SolverFailure` (tried, and failed)."""
        ...


@dataclass(frozen=True, kw_only=True)
class Spec:
    """What every plugin has. Without one of the modules `imports`, it is `missing`, not broken."""

    name: str
    summary: str
    imports: tuple[str, ...] = ()


@dataclass(frozen=True)
class Option:
    """A setting that a user may give a plugin by name, as in ``solver[name=value]``.

    `parse` turns the text of the value into what the factory takes, and raises `ValueError` for a bad one.
    """

    name: str
    parse: Callable[[str], Any]
    summary: str


@dataclass(frozen=True, kw_only=True)
class ConfigurableSpec(Spec):
    """A plugin whose factory takes settings."""

    kind: ClassVar[Kind]
    factory: Callable[..., Any]
    options: tuple[Option, ...] = ()
    """Keyword arguments that `factory` takes, all optional."""

    def configured(self, settings: Mapping[str, str]) -> Self:
        """The plugin with some options set; its name says them: ``name[option=value,...]``.

        Raises:
            InputError: there is no such option, or its value is not understood.
        """
        known = {option.name: option for option in self.options}
        values = {}
        for name, text in settings.items():
            if name not in known:
                offered = "; ".join(f"{option.name}: {option.summary}" for option in self.options) or "none"
                raise InputError(f"{self.kind} '{self.name}' has no option '{name}'. It has {offered}")
            try:
                values[name] = known[name].parse(text)
            except ValueError as error:
                raise InputError(
                    f"{self.kind} '{self.name}': option {name}={text} is not understood ({error});"
                    f" {name}: {known[name].summary}"
                ) from error
        if not values:
            return self
        told = ",".join(f"{name}={settings[name]}" for name in sorted(settings))
        return replace(self, name=f"{self.name}[{told}]", factory=partial(self.factory, **values), options=())


@dataclass(frozen=True, kw_only=True)
class SolverSpec(ConfigurableSpec):
    """A calibration method. `factory()` imports what is heavy and returns the `Solver`."""

    kind: ClassVar[Kind] = Kind.SOLVER
    factory: Callable[..., Solver]
    needs: frozenset[Need]
    reference: str
    slow: bool = False
    """Folds of the held-out ruler run only when asked for (renderer methods)."""


@dataclass(frozen=True, kw_only=True)
class DatasetSpec(Spec):
    """A reader of one format. `sniff(path)` is quick and never raises; `load(path)` decodes no image.

    A `last_resort` is asked when no other format recognises the path; it may decode images to prove a convention.
    """

    kind: ClassVar[Kind] = Kind.DATASET
    sniff: Callable[[Path], bool]
    load: Callable[[Path], Recording]
    last_resort: bool = False


@dataclass(frozen=True, kw_only=True)
class SuiteSpec(Spec):
    """Generated recordings. `make(level, index, seed)` depends on nothing else: items stream in any order.

    `solvers(level)` names those that a level is meant for; without it all take part that its recordings can feed.
    `facts(level, index, seed)` tells numbers about an item that no solver sees and reports show.
    """

    kind: ClassVar[Kind] = Kind.SUITE
    levels: tuple[str, ...]
    default_samples: int
    make: Callable[[str, int, int], Recording]
    solvers: Callable[[str], tuple[str, ...]] = lambda level: ()
    facts: Callable[[str, int, int], Mapping[str, float]] = lambda level, index, seed: {}


@dataclass(frozen=True, kw_only=True)
class ObserverSpec(Spec):
    """An observation computed from a rawer one, before any solver runs and once for all of them.

    `factory()` returns a function recording -> recording that fills what `gives` names; it may raise
    `Refusal`.
    """

    kind: ClassVar[Kind] = Kind.OBSERVER
    gives: Need
    applies: Callable[[Recording], bool]
    factory: Callable[[], Callable[[Recording], Recording]]


@dataclass(frozen=True)
class Column:
    """One number of an evaluator: its unit, and whether smaller is better (None: neither)."""

    name: str
    unit: str
    smaller_is_better: bool | None = True


class Evaluator(Protocol):
    """A ruler. `solve` calibrates another recording with the same method, for rulers that refit on folds."""

    def __call__(
        self,
        estimate: Estimate,
        recording: Recording,
        *,
        solve: Callable[[Recording], Estimate],
        rng: np.random.Generator,
    ) -> Mapping[str, Any]: ...


class ResultSection(StrEnum):
    """Where a ruler's numbers go, and when it is applied."""

    ERRORS = "errors"
    """It reads the truth, and is applied where there is one."""
    HELD_OUT = "held_out"
    """It solves again on folds, and is applied without truth or when asked for."""
    DIAGNOSTICS = "diagnostics"
    """It only needs the estimate and its recording, and is always applied."""


@dataclass(frozen=True, kw_only=True)
class EvaluatorSpec(Spec):
    """A ruler; its columns go into the part of the estimate that `into` names."""

    kind: ClassVar[Kind] = Kind.EVALUATOR
    columns: tuple[Column, ...]
    factory: Callable[[], Evaluator]
    into: ResultSection
    applies: Callable[[Recording], bool]


@dataclass(frozen=True, kw_only=True)
class ExporterSpec(Spec):
    """A writer. `write(estimate, options)` returns the text; `options` come from the command line."""

    kind: ClassVar[Kind] = Kind.EXPORTER
    suffix: str
    write: Callable[[Estimate, Mapping[str, str]], str]


@dataclass(frozen=True, kw_only=True)
class SegmenterSpec(ConfigurableSpec):
    """Robot masks. `factory()` returns a function recording -> recording with `masks`."""

    kind: ClassVar[Kind] = Kind.SEGMENTER
    factory: Callable[..., Callable[[Recording], Recording]]


class Translator(Protocol):
    """Turns a picture of the real robot into one as the renderer would draw it: flat colours on black."""

    def __call__(
        self,
        image: NDArray[np.float32],
        mask: NDArray[np.float32],
        *,
        part: NDArray[np.int32],
        colours: NDArray[np.float64],
    ) -> NDArray[np.float32]:
        """The picture (H, W, 3) in [0, 1].

        Args:
            image: (H, W, 3) in [0, 1], undistorted, not cut out.
            mask: (H, W) in [0, 1], the robot's.
            part: (H, W) of the robot drawn at the current pose, -1 where it is not.
            colours: (P, 3) of the parts in the robot's model.
        """
        ...


@dataclass(frozen=True, kw_only=True)
class TranslatorSpec(ConfigurableSpec):
    """Image translation. One that `follows_pose` reads `part`, and is asked again as the pose improves."""

    kind: ClassVar[Kind] = Kind.TRANSLATOR
    factory: Callable[..., Translator]
    follows_pose: bool = False


class RobotSight(Protocol):
    """What a network sees of the robot in one picture of H x W px."""

    @property
    def keypoints(self) -> NDArray[np.float64]:
        """(K, 2) px, of the points that `Perceiver.keypoint_positions` places."""
        ...

    @property
    def trust(self) -> NDArray[np.float64]:
        """(K,) in [0, 1]: how sure each keypoint is."""
        ...

    def visible(self) -> NDArray[np.float32]:
        """(H, W) in [0, 1]: the robot where nothing hides it; all 0 when there is none."""
        ...

    def whole(self) -> NDArray[np.float32]:
        """(H, W) in [0, 1]: the robot as if nothing hid it."""
        ...

    def colours(self) -> NDArray[np.float32]:
        """(H, W, 3) RGB in [0, 1]: the colours of the robot's model, wherever it may be."""
        ...


class Perceiver(Protocol):
    """A trained network that finds a robot in photographs."""

    def see(self, image: NDArray[np.uint8]) -> RobotSight:
        """What is in a picture (H, W, 3) RGB."""
        ...

    def keypoint_positions(
        self, robot: str, links: Sequence[str], frame_T_link: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """(..., K, 3) m of the robot's keypoints, in the frame of frame_T_link (..., L, 4, 4) of its links."""
        ...


@dataclass(frozen=True, kw_only=True)
class PerceptionSpec(Spec):
    """A trained network. `factory()` loads its weights. `robots` are those that it knows, by name or URDF's name."""

    kind: ClassVar[Kind] = Kind.PERCEPTION
    robots: tuple[str, ...]
    factory: Callable[[], Perceiver]


@dataclass(frozen=True, kw_only=True)
class DeviceSpec(Spec):
    """A robot, gripper or camera. `open(options)` imports the SDK and connects."""

    kind: Kind
    open: Callable[[Mapping[str, str]], Any]
    simulated: bool
    options: tuple[str, ...] = field(default=())


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
