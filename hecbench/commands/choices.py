"""Options that several verbs have."""

from __future__ import annotations

import os
import shlex
import sys
from pathlib import Path
from typing import TYPE_CHECKING

import click

from hecbench.commands import completion
from hecbench.system import cache
from hecbench.system import threads as most_threads

if TYPE_CHECKING:
    from hecbench.running.solving import Options

as_json = click.option("--json", "as_json", is_flag=True, help="Print JSON and nothing else.")
seed = click.option("--seed", type=click.IntRange(min=0), default=0, show_default=True)
solvers = click.option(
    "--solver",
    "solvers",
    multiple=True,
    metavar="NAME",
    shell_complete=completion.plugins("solver"),
    help="Repeatable; NAME[OPTION=VALUE,...] sets options of it; default: all that can.",
)
unknown = click.option(
    "--unknown",
    type=click.Choice(["joints", "scale", "focal"]),
    multiple=True,
    help="Solve for this too, by every solver with the option `unknown`; repeatable.",
)
segmenter = click.option(
    "--segmenter",
    metavar="NAME",
    shell_complete=completion.plugins("segmenter"),
    help="Whose masks of the robot are used; default: those of the recording.",
)
FOLDER = click.Path(path_type=Path, file_okay=False)
FILE = click.Path(path_type=Path, dir_okay=False)
ANY_PATH = click.Path(path_type=Path)
held_out = click.option(
    "--held-out/--no-held-out",
    default=None,
    help="Predict left-out samples; default: where truth is not given.",
)
check = click.option(
    "--check/--no-check",
    "check",
    default=True,
    help="Look for faults in the recording first; a critical one exits with 3.",
)
no_cache = click.option(
    "--no-cache",
    is_flag=True,
    expose_value=False,
    callback=lambda context, option, value: os.environ.update({cache.VARIABLE: "1"} if value else {}),
    help="Detect the target again, also where the cache has it.",
)
threads = click.option(
    "--jobs",
    type=click.IntRange(min=1),
    expose_value=False,
    callback=lambda context, option, value: None if value is None else most_threads.limit(value),
    help="At most so many threads; default: one per core. The answer is the same.",
)
timeout = click.option(
    "--timeout",
    "timeout_s",
    type=click.FloatRange(min=0, min_open=True),
    metavar="S",
    help="Seconds that a solver may take each time it is called; default: no limit.",
)
tolerance = click.option(
    "--tolerance-mm",
    type=click.FloatRange(min=0, min_open=True),
    default=5.0,
    show_default=True,
    help="The error in the workspace that you can live with; the grade is relative to it.",
)
memory = click.option(
    "--memory",
    "memory_mb",
    type=click.IntRange(min=100),
    metavar="MB",
    help="Memory that a solver may take each time it is called; default: no limit.",
)


def run_options(
    seed: int,
    held_out: bool | None = None,
    segmenter: str | None = None,
    timeout_s: float | None = None,
    memory_mb: int | None = None,
) -> Options:
    """What holds for a whole run, with the command line that makes it again."""
    from hecbench.running.solving import Options

    words = ["hecbench", *(word for word in sys.argv[1:] if word != "--resume")]
    command = shlex.join(words)
    return Options(
        seed, held_out, command=command, segmenter=segmenter, timeout_s=timeout_s, memory_mb=memory_mb
    )
