"""Seeded bugs that the tests must catch: each of `mutants.toml` is put into a copy of the tree, and its tests are run.

    python benchmarks/mutants.py [--only WORD]

Prints a line per bug and the share caught; exits with 1 below 95 %. A bug whose original text is not found exactly
once is an error: the list follows the code.
"""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
import tempfile
import tomllib
from dataclasses import dataclass
from pathlib import Path

import click

ROOT = Path(__file__).parents[1]
PACKAGES = ("hecbench", "plugins", "hardware", "datasets", "tests")
LEAST_CAUGHT = 0.95
_TIMEOUT_S = 600


@dataclass(frozen=True)
class Mutant:
    """One change of a file, and the tests that should fail by it."""

    name: str
    file: str
    old: str
    new: str
    tests: str

    def planted(self, tree: Path) -> str:
        """Plant it and return the original text of the file."""
        path = tree / self.file
        original = path.read_text()
        if original.count(self.old) != 1:
            raise click.ClickException(
                f"{self.name}: its text stands {original.count(self.old)} times in {self.file}"
            )
        path.write_text(original.replace(self.old, self.new))
        return original


def mutants(word: str) -> list[Mutant]:
    """Those of the list whose name, file or tests hold a word."""
    with (ROOT / "benchmarks" / "mutants.toml").open("rb") as stream:
        found = [Mutant(**entry) for entry in tomllib.load(stream)["mutant"]]
    return [m for m in found if word in f"{m.name} {m.file} {m.tests}"]


def caught(mutant: Mutant, tree: Path) -> bool:
    """Whether a test fails with the bug in place."""
    original = mutant.planted(tree)
    places = os.pathsep.join(str(tree / p) for p in (".", "plugins", "hardware", "datasets"))
    # every run compiles its own kernels: a cache would hide a bug in one
    environment = os.environ | {"PYTHONPATH": places, "NUMBA_CACHE_DIR": str(tree / "numba" / mutant.name)}
    command = [sys.executable, "-m", "pytest", "-q", "-x", "-p", "no:cacheprovider", *mutant.tests.split()]
    try:
        done = subprocess.run(
            command, cwd=tree, env=environment, capture_output=True, timeout=_TIMEOUT_S, check=False
        )
    except subprocess.TimeoutExpired:
        return True
    finally:
        (tree / mutant.file).write_text(original)
    if done.returncode not in (0, 1):
        raise click.ClickException(f"{mutant.name}: the tests do not run: {done.stdout.decode()[-500:]}")
    return done.returncode == 1


@click.command()
@click.option("--only", default="", help="Only bugs whose name, file or tests hold this word.")
def main(only: str) -> None:
    """Run the bugs one after the other."""
    chosen, survivors = mutants(only), []
    with tempfile.TemporaryDirectory() as folder:
        tree = Path(folder) / "tree"
        for package in PACKAGES:
            shutil.copytree(ROOT / package, tree / package, ignore=shutil.ignore_patterns("__pycache__"))
        shutil.copy(ROOT / "pyproject.toml", tree)
        if (ROOT.parent / "shared").exists():
            (tree.parent / "shared").symlink_to(ROOT.parent / "shared")
        for mutant in chosen:
            found = caught(mutant, tree)
            survivors += [] if found else [mutant.name]
            click.echo(f"{'caught' if found else 'SURVIVED'}  {mutant.name}")
    share = 1 - len(survivors) / max(len(chosen), 1)
    click.echo(f"{len(chosen) - len(survivors)} of {len(chosen)} caught, {share:.1%}")
    sys.exit(share < LEAST_CAUGHT)


if __name__ == "__main__":
    main()
