"""The first-order methods: seconds of CPU per 1,000 iterations of Adam, each beside its bar and the paper's.

Run: ``make bench TEST_ARGS=benchmarks/bench_first_order.py``. One core, 640 x 480, the full UR5e, scenes of the suite
`synthetic`; preparing the recording is not counted. A figure is the median over scenes, the least stands beside it:
on a busy machine that one is nearer to what a core of its own needs.
"""

import os
import time

import numpy as np
import pytest
from hecbench_datasets.suites import synthetic

from hecbench import registry
from hecbench.specs import Kind, SolverSpec

pytest.importorskip("torch")

SCALE = float(os.environ.get("HECBENCH_BENCH_SCALE", "1"))
SHORT, LONG = 20, 520
BARS = {
    "drhec": (6, 7.19),
    "drhec[variant=literal]": (6, 7.19),
    "drhec[translator=part_colours]": (6, None),
    "drhec_rgbc": (6, None),
    "drhec_rgb": (6, None),
    "easyhec": (6, 7.18),
    "easyhec[masks=zbuffered]": (6, 7.18),
    "ipe": (8, 78.25),
}
"""Solver, its bar and the paper's figure (RTX 4090), seconds per 1,000 iterations."""


def cpu_seconds(name, iterations, recording):
    plain, _, rest = name.partition("[")
    options = ",".join(filter(None, [rest.removesuffix("]"), f"iterations={iterations}"]))
    solver = registry.load().get(Kind.SOLVER, f"{plain}[{options}]", SolverSpec).factory()
    start = time.thread_time()
    estimate = solver(recording, rng=np.random.default_rng(0))
    assert estimate.iterations == iterations, estimate.reason
    return time.thread_time() - start


@pytest.mark.parametrize("name", BARS)
def test_bench_seconds_per_thousand_iterations(name):
    recordings = [synthetic.make("LP", index, 0).without_truth() for index in range(max(3, round(5 * SCALE)))]
    cpu_seconds(name, 2, recordings[0])
    found = [
        1000 * (cpu_seconds(name, LONG, one) - cpu_seconds(name, SHORT, one)) / (LONG - SHORT)
        for one in recordings
    ]
    bar, paper = BARS[name]
    told = f"paper {paper}, RTX 4090" if paper else "not in the paper"
    print(f"\n{name}: {np.median(found):.2f} s per 1,000 iterations, least {min(found):.2f} ({bar}; {told})")
    assert np.median(found) < bar


def test_bench_guess_free_start():
    """The hemisphere of easyhecpp: seconds, and the overlap of drawing and mask that it finds."""
    from hecbench_plugins.first_order.hemisphere import Hemisphere, best_on_hemisphere
    from hecbench_plugins.views.pyramid import prepare

    seconds, overlaps = [], []
    for index in range(max(3, round(20 * SCALE))):
        recording = synthetic.make("LP", index, 0)
        views = prepare(recording)[1]
        start = time.thread_time()
        found = best_on_hemisphere(recording, views, Hemisphere())
        seconds.append(time.thread_time() - start)
        overlaps.append(found.overlap)
    print(
        f"\nhemisphere: median {np.median(seconds):.2f} s, overlap {np.median(overlaps):.2f}, least {min(overlaps):.2f}"
    )
