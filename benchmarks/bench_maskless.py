"""Calibration from raw photographs: the figures of docs/maskless.md, each printed beside its bar.

Run: ``HECBENCH_RECORDINGS=../shared/data make bench TEST_ARGS=benchmarks/bench_maskless.py`` (about forty minutes on
two cores at full size); ``HECBENCH_BENCH_SCALE=0.1`` draws a tenth of the samples. ``hecbench run maskless_real`` and
``hecbench report`` give the same figures with intervals.
"""

import os

import numpy as np
import pytest
from hecbench_datasets.suites import maskless as suites

from hecbench import registry
from hecbench.errors import InputError
from hecbench.estimate import Status
from hecbench.report.maskless import Outcome, outcome
from hecbench.running import solving
from hecbench.specs import Kind, SolverSpec

SCALE = float(os.environ.get("HECBENCH_BENCH_SCALE", "1"))
BARS = [
    ("maskless_real", "5_views_0.1m_10deg", "render_gn", 20, "19 of 20 right, median 7 mm, 4 s"),
    ("maskless_real", "5_views_0.2m_20deg", "render_gn", 20, "19 of 20 right, median 7 mm, 4 s"),
    ("maskless_real", "5_views_0.1m_10deg", "render_gn[unknown=joints]", 20, "median 5 mm"),
    ("maskless_real", "5_views_0.2m_20deg", "render_gn[unknown=joints]", 20, "median 5 mm"),
    ("maskless_real", "40_views_0.2m_20deg", "render_gn", 5, "median 5 mm, 10 s"),
    ("maskless_real", "40_views_0.2m_20deg", "render_gn[unknown=joints]", 5, "median 3 mm"),
    ("maskless_real", "5_views_0.1m_10deg", "render_gn_free", 20, "90 % right"),
    ("maskless_lit", "5_views_0.1m_10deg", "render_gn", 18, "all right, mean 1.5 mm"),
    ("maskless_lit", "5_views_0.2m_20deg", "render_gn", 18, "all right, mean 1.5 mm"),
    ("maskless_lit", "1_views_0.1m_10deg", "render_gn", 20, "95 % right or refused"),
    ("maskless_lit", "5_views_0.1m_10deg", "render_gn_free", 18, "90 % right"),
    *((suite, trap, "render_gn", 10, "none wrong") for suite in suites.VIEWS for trap in suites.TRAPS),
]


@pytest.mark.parametrize(("suite", "level", "solver", "full", "bar"), BARS, ids=lambda value: str(value))
def test_bench_photographs(benchmark, suite, level, solver, full, bar):
    try:
        suites.folder()
    except InputError as error:
        pytest.skip(str(error))
    spec = registry.load().get(Kind.SOLVER, solver, SolverSpec)
    count = max(2, round(SCALE * full))

    def campaign():
        recordings = (suites.make(suite, level, index, 0) for index in range(count))
        return [estimate for recording in recordings for estimate in solving.solve(recording, [spec])]

    estimates = benchmark.pedantic(campaign, rounds=1)
    mm = np.array([e.errors["translation_error_mm"] for e in estimates if e.status is Status.OK])
    ends = [outcome(e) for e in estimates]
    ended = f"median {np.median(mm):.1f} mm, mean {mm.mean():.1f}" if len(mm) else "no answer"
    print(
        f"\n{suite} {level} {solver}: {ends.count(Outcome.RIGHT)} of {count} right, {ends.count(Outcome.WRONG)} wrong,"
        f" {count - len(mm)} without an answer; {ended}; {np.median([e.seconds for e in estimates]):.1f} s ({bar})"
    )
