import numpy as np
import pytest

from hecbench.samples.spread import evenly


@pytest.mark.parametrize("most", [2, 3, 8, 20])
def test_a_few_of_many_reach_from_the_first_to_the_last(most):
    chosen = evenly(101, most)
    assert len(chosen) == most
    assert (chosen[0], chosen[-1]) == (0, 100)
    assert np.ptp(np.diff(chosen)) <= 1


@pytest.mark.parametrize("count", [0, 1, 7, 8])
def test_where_there_are_few_all_are_taken(count):
    assert evenly(count, 8).tolist() == list(range(count))


def test_of_one_place_the_first_is_taken():
    assert evenly(9, 1).tolist() == [0]
