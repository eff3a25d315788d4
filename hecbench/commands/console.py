"""What verbs print: JSON, tables and the answer on stdout, progress on stderr."""

from __future__ import annotations

import os
import sys
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import click

from hecbench import cache
from hecbench import threads as limits

if TYPE_CHECKING:
    from hecbench.estimate import Estimate
    from hecbench.report.tables import Table

_PIPE_WIDTH = 200


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
    callback=lambda context, option, value: None if value is None else limits.limit(value),
    help="At most so many threads; default: one per core. The answer is the same.",
)


def print_json(value: Any) -> None:
    """Indented JSON."""
    import msgspec

    click.echo(msgspec.json.format(msgspec.json.encode(value), indent=1))


def say(note: str) -> None:
    """A line on stderr."""
    click.echo(note, err=True)


def print_tables(estimates: Sequence[Estimate]) -> None:
    """The table of every level and recording."""
    from hecbench.report.tables import groups, table

    for group in groups(estimates):
        print_table(table(group))


def print_table(table: Table) -> None:
    """A table with its notes, as wide as the terminal."""
    from rich.console import Console
    from rich.table import Table as RichTable
    from rich.text import Text

    console = Console(width=None if sys.stdout.isatty() else _PIPE_WIDTH)
    shown = RichTable(title=table.title, title_justify="left", header_style="bold")
    for number, name in enumerate(table.header):
        shown.add_column(name, justify="left" if number < table.left else "right", overflow="fold")
    for row in table.rows:
        shown.add_row(*map(Text, row))
    console.print(shown)
    for note in table.notes:
        console.print(Text(note, style="dim"))
    console.print()


def print_answer(estimate: Estimate) -> None:
    """The transform with its frames named."""
    import numpy as np

    from hecbench import se3

    if estimate.parent_T_camera is None:
        return
    translation = ", ".join(f"{value:.5f}" for value in estimate.parent_T_camera[:3, 3])
    quaternion = ", ".join(f"{value:.6f}" for value in se3.to_quat_xyzw(estimate.parent_T_camera))
    matrix = np.array2string(estimate.parent_T_camera, precision=6, suppress_small=True, prefix="  ")
    click.echo(f"{estimate.parent_link}_T_camera by {estimate.solver}:")
    click.echo(f"  translation m: [{translation}]   quaternion x y z w: [{quaternion}]")
    click.echo(f"  {matrix}")


@contextmanager
def progress(total: int) -> Iterator[Callable[[int], None]]:
    """A bar on stderr when that is a terminal; yields the function that advances it."""
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeRemainingColumn

    columns = TextColumn("calibrations"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn()
    console = Console(stderr=True)
    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as bar:
        task = bar.add_task("", total=total)
        yield lambda count: bar.advance(task, count)
