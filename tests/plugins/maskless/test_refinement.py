"""Moves that shrink like a geometric series are lengthened to its sum; others are left as they are."""

import numpy as np
import pytest
from hecbench_plugins.maskless.refinement import relaxed
from hecbench_plugins.maskless.settings import CONTOUR

INFORMATION = np.diag([4.0, 1.0, 9.0])


@pytest.mark.parametrize("ratio", [0.1, 0.3, 0.45])
def test_a_geometric_series_is_summed_at_once(ratio):
    error, relaxation, before = np.array([1.0, -2.0, 0.5]), 1.0, None
    for _ in range(2):
        move = -(1 - ratio) * error
        relaxation, before = relaxed(relaxation, before, move, INFORMATION), move
        error = error + relaxation * move
    assert np.abs(error).max() < 1e-12


def test_a_move_that_turns_back_or_aside_is_not_lengthened():
    before = np.array([1.0, 0.0, 0.0])
    for move in (-0.5 * before, np.array([0.0, 0.5, 0.0])):
        assert relaxed(1.7, before, move, INFORMATION) == 1.0
    assert relaxed(1.7, None, before, INFORMATION) == 1.0


def test_a_move_as_long_as_the_one_before_is_lengthened_within_bounds():
    before = np.array([1.0, 2.0, 3.0])
    assert relaxed(1.0, before, 0.999 * before, INFORMATION) == CONTOUR.most_relaxation
    assert relaxed(1.0, before, 1.5 * before, INFORMATION) == CONTOUR.most_relaxation
