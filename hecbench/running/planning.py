"""From what a user names to what is run: solvers by name or by need, suites and recordings as tasks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from hecbench import preparation, registry
from hecbench.errors import InputError
from hecbench.recording import Recording, RobotDescription
from hecbench.robots.posed import PosedRobot
from hecbench.running.runner import Task
from hecbench.running.starts import start_of
from hecbench.specs import Kind, SegmenterSpec, SolverSpec, SuiteSpec


def adjusted(recording: Recording, views: int | None, init: str | None, seed: int) -> Recording:
    """The recording with fewer samples and another start, as asked for."""
    if views is not None:
        if views > len(recording):
            raise InputError(f"--views {views}: {recording.name} has {len(recording)} samples")
        chosen = np.random.default_rng(seed).choice(len(recording), views, replace=False)
        recording = recording.subset(np.sort(chosen))
    if init is not None:
        recording = replace(recording, initial_parent_T_camera=start_of(init, recording))
    return recording


def with_robot(recording: Recording, urdf: Path) -> Recording:
    """The recording with a robot model of the user's, which must have the recording's links and joints.

    Notes that ask for `--urdf` are done with.

    Raises:
        InputError: the URDF or a mesh cannot be read, or a link or joint is not in it.
    """
    if recording.joints_rad is None:
        raise InputError(f"--urdf {urdf}: {recording.name} has no joints_rad to place the robot's links by")
    described = replace(recording.robot or RobotDescription(), model=None, urdf=urdf)
    robot = PosedRobot.of(replace(recording, robot=described))
    for link in (robot.base_link, robot.flange_link):
        robot.model.link_index(link)
    notes = tuple(note for note in recording.notes if "--urdf" not in note)
    return replace(recording, robot=replace(described, joint_names=robot.joint_names), notes=notes)


def solvers_for(names: Sequence[str], recording: Recording, segmenter: str | None = None) -> list[SolverSpec]:
    """The named solvers, or all ready ones whose needs the recording will meet.

    Raises:
        InputError: no solver or segmenter is called so.
    """
    known = registry.load()
    if segmenter is not None:
        known.get(Kind.SEGMENTER, segmenter, SegmenterSpec)
    if names:
        return [known.get(Kind.SOLVER, name, SolverSpec) for name in dict.fromkeys(names)]
    offers = preparation.will_offer(recording, segmenter)
    return [spec for spec in known.ready(Kind.SOLVER, SolverSpec) if spec.needs <= offers]


def with_unknowns(specs: Sequence[SolverSpec], unknown: Sequence[str]) -> list[SolverSpec]:
    """The solvers, those with the option `unknown` told to solve for these too.

    Raises:
        InputError: none of them has the option.
    """
    able = [any(option.name == "unknown" for option in spec.options) for spec in specs]
    if not unknown:
        return list(specs)
    if not any(able):
        raise InputError(
            f"--unknown {unknown[0]}: none of these solvers can solve for it; name one that has the option `unknown`"
        )
    settings = {"unknown": "+".join(unknown)}
    return [spec.configured(settings) if can else spec for spec, can in zip(specs, able, strict=True)]


def tasks(
    sources: Sequence[str],
    solvers: Sequence[str],
    levels: Sequence[str],
    samples: int | None,
    seed: int,
    segmenter: str | None = None,
) -> list[Task]:
    """The tasks of one suite, or of recordings by path.

    Raises:
        InputError: a name that is neither, or a suite's option given for recordings.
    """
    suites = [spec.name for spec in registry.load().ready(Kind.SUITE, SuiteSpec)]
    if sources[0] in suites and len(sources) == 1:
        return suite_tasks(sources[0], levels, samples, solvers, seed, segmenter)
    if levels or samples is not None:
        raise InputError(f"--level and --samples are for a suite ({', '.join(suites)}), not for recordings")
    found = []
    for source in sources:
        if not Path(source).exists():
            hint = registry.meant(source, suites)
            raise InputError(
                f"{source}: is neither a suite ({', '.join(suites)}) nor a path that exists{hint}"
            )
        specs = solvers_for(solvers, preparation.load_recording(Path(source)), segmenter)
        found.append(Task(tuple(spec.name for spec in specs), path=Path(source)))
    return found


def suite_tasks(
    name: str,
    levels: Sequence[str],
    samples: int | None,
    solvers: Sequence[str],
    seed: int,
    segmenter: str | None = None,
) -> list[Task]:
    """The tasks of a suite: each level's recordings with the solvers that its recordings can feed."""
    suite = registry.load().get(Kind.SUITE, name, SuiteSpec)
    for level in levels:
        if level not in suite.levels:
            hint = registry.meant(level, suite.levels)
            raise InputError(f"--level {level}: the suite '{name}' has {', '.join(suite.levels)}{hint}")
    found = []
    for level in levels or suite.levels:
        meant = solvers or suite.solvers(level)
        names = tuple(spec.name for spec in solvers_for(meant, suite.make(level, 0, seed), segmenter))
        indices = range(samples or suite.default_samples)
        found += [Task(names, suite=name, level=level, index=index) for index in indices]
    return found
