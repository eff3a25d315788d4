"""Threads: the same answers for every number of them."""

import os

import pytest

from hecbench.errors import InputError
from hecbench.system import threads


@pytest.fixture(autouse=True)
def _as_before(monkeypatch):
    monkeypatch.setenv(threads.VARIABLE, "1")  # restored afterwards
    yield
    monkeypatch.undo()
    threads.count.cache_clear()


@pytest.mark.parametrize("most", [1, 2, 1000])
def test_the_order_is_that_of_the_items_and_the_count_that_of_the_machine(most):
    threads.limit(most)
    assert threads.each(lambda number: number**2, range(50)) == [number**2 for number in range(50)]
    assert threads.count() == min(most, len(os.sched_getaffinity(0)))


@pytest.mark.parametrize("said", ["0", "-1", "two", ""])
def test_what_is_no_number_of_threads_is_refused(said, monkeypatch):
    monkeypatch.setenv(threads.VARIABLE, said)
    threads.count.cache_clear()
    with pytest.raises(InputError, match="HECBENCH_THREADS"):
        threads.count()
