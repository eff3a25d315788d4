"""The suite `paper`: its solvers exist, and its items are those of `synthetic`."""

import numpy as np
import pytest
from hecbench_datasets.suites import paper, synthetic

from hecbench import registry
from hecbench.specs import Kind, SolverSpec, SuiteSpec


@pytest.mark.parametrize("level", paper.LEVELS)
def test_every_level_names_solvers_that_exist(level):
    pytest.importorskip("torch")
    names = registry.load().get(Kind.SUITE, "paper", SuiteSpec).solvers(level)
    assert len(set(names)) == len(names)
    specs = [registry.load().get(Kind.SOLVER, name, SolverSpec) for name in names]
    assert [spec.name for spec in specs] == list(names)


def test_ablations_mix_the_scenes_of_lp_and_mp():
    for index, (level, number) in enumerate([("LP", 0), ("MP", 0), ("LP", 1)]):
        ours, theirs = paper.make("threshold", index, 3), synthetic.make(level, number, 3)
        assert ours.sha256 == theirs.sha256


def test_ablations_ask_for_every_published_value_in_both_variants():
    names = paper.solvers("lambda_cen")
    assert len(names) == 10
    assert "drhec[lambda_cen=0.1,variant=literal]" in names


def test_other_levels_are_those_of_synthetic():
    ours, theirs = paper.make("LP", 1, 0), synthetic.make("LP", 1, 0)
    np.testing.assert_array_equal(ours.image(0), theirs.image(0))
