"""`hecbench new`: a plugin package to start from, which passes the checks as it is written."""

from __future__ import annotations

import re
from pathlib import Path

import click

from hecbench.errors import InputError

_KINDS = ("solver", "dataset", "suite", "observer", "evaluator", "exporter", "segmenter", "translator")
_PYPROJECT = """[build-system]
requires = ["hatchling"]
build-backend = "hatchling.build"

[project]
name = "{project}"
version = "0.1.0"
dependencies = ["hecbench"]

[project.entry-points.hecbench]
{module} = "{module}"

[tool.hatch.build.targets.wheel]
include = ["{module}.py"]
"""


@click.command()
@click.argument("kind", type=click.Choice(_KINDS))
@click.argument("name")
@click.option(
    "--out", type=click.Path(path_type=Path), help="Folder to write; default: ./NAME. It must not exist."
)
def new(kind: str, name: str, out: Path | None) -> None:
    """Write the package of a plugin NAME: one module that works, to be changed into yours."""
    from hecbench.system import files

    if not re.fullmatch(r"[a-z][a-z0-9_]*", name):
        raise InputError(f"{name}: give a name of lower-case letters, digits and _, as my_{kind}")
    folder = out or Path(name)
    if folder.exists():
        raise InputError(f"{folder}: exists already; give another folder with --out")
    folder.mkdir(parents=True)
    files.write_text(folder / f"{name}.py", module(kind, name))
    files.write_text(
        folder / "pyproject.toml", _PYPROJECT.format(project=name.replace("_", "-"), module=name)
    )
    click.echo(f"{folder}: change {name}.py, then: pip install -e {folder} && hecbench conformance {name}")


def module(kind: str, name: str) -> str:
    """The example that the hook's documentation holds, under another name."""
    import inspect

    from hecbench import hookspecs

    documentation = inspect.getdoc(getattr(hookspecs, f"hecbench_{kind}s"))
    example = re.search(r"```python\n(.*?)```", str(documentation), re.DOTALL)
    assert example is not None
    return re.sub(r'name="\w+"', f'name="{name}"', example[1].replace("'''", '"""'), count=1)
