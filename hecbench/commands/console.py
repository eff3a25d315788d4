"""What verbs print: JSON, tables and the answer on stdout, progress on stderr."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any

import click

from hecbench.system.wording import significant

if TYPE_CHECKING:
    from hecbench.estimate import Estimate
    from hecbench.report.tables import Table
    from hecbench.specs import SolverSpec
    from hecbench.verdict import Verdict

_PIPE_WIDTH = 200


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
    shown = RichTable(title=Text(table.title), title_justify="left", header_style="bold")
    for number, name in enumerate(table.header):
        shown.add_column(Text(name), justify="left" if number < table.left else "right", overflow="fold")
    for row in table.rows:
        shown.add_row(*map(Text, row))
    console.print(shown)
    for note in table.notes:
        console.print(Text(note, style="dim"))
    console.print()


def print_answer(estimate: Estimate, do_not_use: bool = False) -> None:
    """The transform with its frames named; marked where the data do not allow an answer."""
    import numpy as np

    from hecbench import se3

    if estimate.parent_T_camera is None:
        return
    translation = ", ".join(f"{value:.5f}" for value in estimate.parent_T_camera[:3, 3])
    quaternion = ", ".join(f"{value:.6f}" for value in se3.to_quat_xyzw(estimate.parent_T_camera))
    rpy = ", ".join(f"{value:.6f}" for value in se3.to_rpy(estimate.parent_T_camera[:3, :3]))
    matrix = np.array2string(estimate.parent_T_camera, precision=6, suppress_small=True, prefix="  ")
    mark = "DO NOT USE " if do_not_use else ""
    click.echo(f"{mark}{estimate.parent_link}_T_camera by {estimate.solver}:")
    click.echo(
        f"  translation m: [{translation}]   quaternion x y z w: [{quaternion}]   roll pitch yaw rad: [{rpy}]"
    )
    click.echo(f"  {matrix}")


def print_verdict(verdict: Verdict) -> None:
    """The answer, what to expect of it, why, and what to do next."""
    best = verdict.recommended
    click.echo(f"{verdict.recording}: {verdict.grade.words.upper()} ({verdict.rule})")
    if best is not None and best.parent_T_camera is not None:
        click.echo()
        print_answer(best, do_not_use=verdict.grade == "do_not_use")
        for line in camera_lines(best):
            click.echo(f"  {line}")
    if verdict.expected is not None:
        click.echo(f"\nExpected error in the workspace: {verdict.expected} (95 %)")
    if verdict.at is not None:
        click.echo(f"Expected error at that place: {verdict.at} (95 %)")
    _print_list("Why", verdict.reasons)
    _print_list(
        "Agree",
        [f"{a.solver} ({a.evidence}) within {significant(a.distance_mm)} mm" for a in verdict.agreement],
    )
    _print_list(
        "Disagree", [f"{r.solver} by {significant(r.distance_mm)} mm: {r.reason}" for r in verdict.rivals]
    )
    _print_list("Next", verdict.next)


def camera_lines(estimate: Estimate) -> list[str]:
    """The camera that belongs to an answer, where the method changed it."""
    camera = estimate.camera
    if camera is None or camera.K is None or not estimate.diagnostics.get("camera_changed"):
        return []
    (fx, _, cx), (_, fy, cy) = camera.K[:2]
    lens = ", ".join(f"{value:.5g}" for value in camera.distortion)
    return [
        "this pose belongs to a camera of its own, not to the recording's:",
        f"fx {fx:.3f}, fy {fy:.3f}, cx {cx:.3f}, cy {cy:.3f} px; distortion [{lens}]",
    ]


def _print_list(title: str, sentences: Sequence[str]) -> None:
    if sentences:
        click.echo(f"\n{title}:")
    for sentence in sentences:
        click.echo(f"  - {sentence}")


def print_critical(findings: Iterable[Mapping[str, Any]], of: str) -> bool:
    """The critical findings on stderr, and whether there are any."""
    critical = [finding for finding in findings if finding["severity"] == "critical"]
    for finding in critical:
        action = f" -> {finding['action']}" if finding["action"] else ""
        say(f"CRITICAL {finding['id']}: {finding['summary']}{action}")
    if critical:
        say(f"{of}: do not use an answer from these data before this is mended; see `hecbench check`")
    return bool(critical)


_SLOW_WEIGHT = 30
"""How many times as long as a closed form a slow method takes, roughly, for the time that is left."""


class Progress:
    """A bar on stderr with the method at work; where stderr is no terminal, a line for each slow method."""

    def __init__(self, specs: Sequence[SolverSpec]) -> None:
        from rich.console import Console
        from rich.progress import BarColumn, SpinnerColumn, TextColumn, TimeElapsedColumn, TimeRemainingColumn
        from rich.progress import Progress as Bar

        console = Console(stderr=True)
        columns = (
            SpinnerColumn(),
            TextColumn("{task.description}", markup=False),
            BarColumn(),
            TimeElapsedColumn(),
            TextColumn("left"),
            TimeRemainingColumn(),
        )
        self._shown = console.is_terminal
        self._bar = Bar(*columns, console=console, transient=True, disable=not self._shown)
        self._task = self._bar.add_task("reading", total=sum(map(self._weight, specs)))
        self._at_work: SolverSpec | None = None

    @staticmethod
    def _weight(spec: SolverSpec) -> int:
        return _SLOW_WEIGHT if spec.slow else 1

    def __enter__(self) -> Progress:
        self._bar.start()
        return self

    def __exit__(self, *error: object) -> None:
        self._bar.stop()

    def start(self, spec: SolverSpec) -> None:
        """A method begins."""
        self._at_work = spec
        self._bar.update(self._task, description=spec.name)
        if spec.slow and not self._shown:
            say(f"{spec.name} is at work; it may take minutes")

    def writing(self) -> None:
        """All methods have ended."""
        self._bar.update(self._task, description="writing")

    def done(self, estimate: Estimate) -> None:
        """The method at work has ended."""
        if self._at_work is not None:
            self._bar.advance(self._task, self._weight(self._at_work))
        if self._shown:
            self._bar.console.print(
                f"{estimate.solver}: {estimate.status}, {significant(estimate.seconds)} s",
                style="dim",
                markup=False,
            )


@contextmanager
def progress(total: int) -> Iterator[Callable[[int], None]]:
    """A bar on stderr when that is a terminal; yields the function that advances it."""
    from rich.console import Console
    from rich.progress import BarColumn, MofNCompleteColumn, TextColumn, TimeRemainingColumn
    from rich.progress import Progress as Bar

    columns = TextColumn("calibrations"), BarColumn(), MofNCompleteColumn(), TimeRemainingColumn()
    console = Console(stderr=True)
    with Bar(*columns, console=console, transient=True, disable=not console.is_terminal) as bar:
        task = bar.add_task("", total=total)
        yield lambda count: bar.advance(task, count)
