"""Which network sees the robot of a recording: one that is installed, or one by its folder."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

from hecbench import registry
from hecbench.errors import InputError, Refusal
from hecbench.recording import Recording
from hecbench.specs import Kind, Perceiver, PerceptionSpec
from hecbench_plugins.perception.model import PerceptionModel


def robot_of(recording: Recording) -> str:
    """The name by which networks know a recording's robot: without its tool, a URDF by its file's name.

    Raises:
        Refusal: the recording names no robot.
    """
    robot = recording.robot
    if robot is None or robot.source is None:
        raise Refusal(f"{recording.name}: names no robot model: give robot.model or robot.urdf")
    return Path(robot.urdf).stem if robot.urdf else str(robot.model).partition("+")[0]


def perceiver_for(recording: Recording, model: str | None) -> Perceiver:
    """The network for a recording's robot.

    Raises:
        Refusal: the network of this name, or every installed one, is for other robots.
        InputError: the folder holds no network that can be run.
    """
    robot = robot_of(recording)
    installed = registry.load().ready(Kind.PERCEPTION, PerceptionSpec)
    named = [spec for spec in installed if model in (None, spec.name)]
    if model is not None and not named:
        perceiver = by_folder(Path(model))
        perceiver.card.require(robot, recording.name)
        return perceiver
    fitting = [spec for spec in named if robot in spec.robots]
    if not fitting:
        known = sorted({name for spec in named for name in spec.robots})
        raise Refusal(
            f"{recording.name}: no network for {robot} is installed ({', '.join(known) or 'none'}): train one by"
            " 'hecbench train perception' and give it as [model=FOLDER]"
        )
    return _by_name(fitting[0].name)


def perceiver_by_option(model: str | None) -> Perceiver:
    """The network of a name or folder, or the first that is installed, whatever the robot.

    Raises:
        InputError: there is none.
    """
    installed = registry.load().ready(Kind.PERCEPTION, PerceptionSpec)
    names = [spec.name for spec in installed if model in (None, spec.name)]
    if names:
        return _by_name(names[0])
    if model is None:
        raise InputError("no perception network is installed: give one as [model=FOLDER]")
    return by_folder(Path(model))


def installed_folder(name: str) -> Path | None:
    """Where an installed network of this name lies; None when there is none, or it is no `PerceptionModel`."""
    known = {spec.name for spec in registry.load().ready(Kind.PERCEPTION, PerceptionSpec)}
    perceiver = _by_name(name) if name in known else None
    return perceiver.folder if isinstance(perceiver, PerceptionModel) else None


@lru_cache(maxsize=4)
def _by_name(name: str) -> Perceiver:
    return registry.load().get(Kind.PERCEPTION, name, PerceptionSpec).factory()


@lru_cache(maxsize=4)
def by_folder(folder: Path) -> PerceptionModel:
    """The network in a folder.

    Raises:
        InputError: there is none that can be run.
    """
    return PerceptionModel(folder)
