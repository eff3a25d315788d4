"""One self-contained HTML page."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from hecbench import files, store
from hecbench.estimate import Estimate
from hecbench.report.figures import figures
from hecbench.report.tables import groups, table

FILE_NAME = "report.html"


def write(folder: Path) -> tuple[Path, store.Contents]:
    """Read the store in a folder and write ``report.html`` beside it.

    Returns:
        The path of the page, and what the store held.

    Raises:
        InputError: the folder holds no store, or no whole result.
    """
    from hecbench.errors import InputError

    contents = store.read(folder)
    if not contents.estimates:
        raise InputError(f"{folder}: its store holds no whole result; run again with `hecbench run --resume`")
    path = folder / FILE_NAME
    files.write_text(path, page(contents.estimates, contents.damage, f"hecbench report {folder}"))
    return path, contents


def page(estimates: Sequence[Estimate], damage: Sequence[str], command: str) -> str:
    """The HTML text of a report on these estimates."""
    from jinja2 import Environment, PackageLoader, StrictUndefined

    environment = Environment(
        loader=PackageLoader("hecbench.report"), autoescape=True, undefined=StrictUndefined, trim_blocks=True
    )
    sections = [
        {"table": table(group), "figures": figures(group), "commands": _values(group.estimates, "command")}
        for group in groups(estimates)
    ]
    return environment.get_template("report.html.j2").render(
        sections=sections,
        damage=damage,
        command=command,
        runs=len(estimates),
        recordings=len({e.provenance.get("recording_sha256") for e in estimates}),
        solvers=sorted({e.solver for e in estimates}),
        seeds=_values(estimates, "seed"),
        versions=_values(estimates, "hecbench"),
        libraries=_values(estimates, "versions"),
    )


def _values(estimates: Sequence[Estimate], name: str) -> list[str]:
    """The different values of one entry of the provenance, as text."""

    def text(value: Any) -> str:
        return (
            ", ".join(f"{key} {item}" for key, item in value.items())
            if isinstance(value, dict)
            else str(value)
        )

    return sorted({text(e.provenance[name]) for e in estimates if e.provenance.get(name) not in (None, "")})
