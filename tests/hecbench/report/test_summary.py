"""Who is first is said with those that may be as good, and never from too few runs."""

import numpy as np
import pytest

from hecbench.report.summary import summary
from hecbench.report.tables import groups, table

FIRST, MEDIAN, ANSWERED, LIKE_IT = 1, 2, 3, 4


@pytest.fixture
def rows(run_of):
    """The summary's rows on one level, of errors per solver."""

    def make(errors_mm):
        runs = [
            run_of(solver, "l", item, error, suite="s")
            for solver, errors in errors_mm.items()
            for item, error in enumerate(errors)
        ]
        sections = summary(groups(runs))
        return [row for section in sections for row in section.table.rows]

    return make


def drawn(seed, factors, count):
    """Errors of solvers on recordings that are hard for all or easy for all."""
    rng = np.random.default_rng(seed)
    hardness = rng.lognormal(0, 0.8, count)
    return {name: factor * hardness * rng.lognormal(0, 0.2, count) for name, factor in factors.items()}


def test_a_paired_difference_is_found_where_intervals_overlap(rows):
    found = [rows(drawn(seed, {"a": 1.0, "b": 1.5}, 16))[0] for seed in range(20)]
    alone = sum(row[FIRST] == "a" and row[LIKE_IT] == "-" for row in found)
    assert alone >= 18


def test_equal_solvers_are_seldom_told_apart(rows):
    equal = dict.fromkeys("abcd", 1.0)
    complete = [len(rows(drawn(seed, equal, 12))[0][LIKE_IT].split(", ")) == 3 for seed in range(100)]
    assert np.mean(complete) >= 0.9


def test_the_best_of_many_equal_solvers_is_seldom_told_apart(rows):
    """The best of 13 was chosen by the same errors: a test of it against each alone finds a difference in 10 %."""
    equal = dict.fromkeys("abcdefghijklm", 1.0)
    complete = [len(rows(drawn(seed, equal, 12))[0][LIKE_IT].split(", ")) == 12 for seed in range(30)]
    assert np.mean(complete) >= 0.9


@pytest.mark.parametrize("count", [1, 4])
def test_too_few_runs_tell_nobody_apart(rows, run_of, count):
    errors = {"a": [1.0] * count, "b": [50.0] * count}
    ((_, first, median, answered, like_it),) = rows(errors)
    assert (first, median, answered) == ("a", "1", f"{count} of {count}")
    assert like_it == "not known from fewer than 5 runs"
    (group,) = groups([run_of(name, "l", i, e[i]) for name, e in errors.items() for i in range(count)])
    assert [row[1] for row in table(group).rows] == ["-", "-"]


def test_one_run_of_another_solver_leaves_the_ranks(rows):
    ((_, first, *_, like_it),) = rows({"once": [0.1], "a": [1.0] * 8, "b": [50.0] * 8})
    assert (first, like_it) == ("a", "-")


def test_runs_without_an_answer_count(rows):
    ((_, first, _, answered, like_it),) = rows({"quits": [0.1] * 3 + [None] * 7, "a": [1.0] * 10})
    assert (first, answered, like_it) == ("a", "10 of 10", "-")


def test_nobody_answered(rows):
    assert rows({"a": [None] * 6, "b": [None] * 6}) == []


def test_a_single_solver_is_not_first(rows):
    assert rows({"a": [1.0] * 6}) == []
