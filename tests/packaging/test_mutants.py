"""The list of seeded bugs follows the code: each finds its text exactly once, and names tests that exist."""

import tomllib
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
MUTANTS = tomllib.loads((ROOT / "benchmarks" / "mutants.toml").read_text())["mutant"]


@pytest.mark.parametrize("mutant", MUTANTS, ids=lambda mutant: mutant["name"])
def test_a_seeded_bug_can_be_planted(mutant):
    assert (ROOT / mutant["file"]).read_text().count(mutant["old"]) == 1
    assert mutant["old"] != mutant["new"]
    assert all((ROOT / test).exists() for test in mutant["tests"].split())


def test_there_are_sixty_or_more_of_different_names():
    assert len({mutant["name"] for mutant in MUTANTS}) == len(MUTANTS) >= 60
