"""What every plugin declares: its kind, its name, one sentence, and its settings."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from enum import StrEnum
from functools import partial
from typing import Any, ClassVar, Self

from hecbench.errors import InputError


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
        given = ",".join(f"{name}={settings[name]}" for name in sorted(settings))
        return replace(
            self, name=f"{self.name}[{given}]", factory=partial(self.factory, **values), options=()
        )
