"""`render_gn_free`: how often, how well and how fast a camera is found without a start; docs/guess-free.md.

Run: ``make bench TEST_ARGS=benchmarks/bench_guess_free.py`` (about 15 minutes on one core at full size);
``HECBENCH_BENCH_SCALE=0.05`` draws 5 % of the samples. Seconds are CPU time.
"""

import os
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hecbench_datasets.suites import guess_free
from hecbench_plugins.solvers.render_gn_free import render_gn_free

from hecbench import se3, statistics
from hecbench.errors import Refusal, SolverFailure
from hecbench.storage.recording_io import load

SCALE = float(os.environ.get("HECBENCH_BENCH_SCALE", "1"))
SHARED = Path(__file__).resolve().parents[2] / "shared" / "data"
SUCCESS_M, SUCCESS_RAD = 0.005, 0.01


def run(recordings):
    """Success, translation m and seconds of each; prints every one that is not within the bounds."""
    solver, good, off_m, seconds = render_gn_free(), [], [], []
    for recording in recordings:
        truth = recording.truth_parent_T_camera
        blind = replace(recording.without_truth(), initial_parent_T_camera=None)
        start = time.thread_time()
        try:
            found = solver(blind, rng=np.random.default_rng(0)).parent_T_camera
        except (Refusal, SolverFailure) as reason:
            off_m.append(np.inf)
            good.append(False)
            print(f"{recording.name}: {reason}")
        else:
            off_m.append(float(se3.translation_error_m(found, truth)))
            good.append(off_m[-1] <= SUCCESS_M and se3.rotation_error_rad(found, truth) <= SUCCESS_RAD)
            if not good[-1]:
                print(f"{recording.name}: off by {1e3 * off_m[-1]:.1f} mm")
        seconds.append(time.thread_time() - start)
    return np.array(good), np.array(off_m), np.array(seconds)


def told(what, good, off_m, seconds):
    interval = statistics.wilson(int(good.sum()), len(good))
    print(
        f"\n{what}: {good.sum()} of {len(good)} within 5 mm and 0.01 rad"
        f" [{100 * interval.low:.1f}, {100 * interval.high:.1f}] %, camera centre median {1e3 * np.median(off_m):.3f},"
        f" mean {1e3 * off_m.mean():.3f}, largest {1e3 * off_m.max():.2f} mm;"
        f" {np.median(seconds):.2f} s median, {seconds.max():.2f} s largest"
    )


@pytest.mark.parametrize(
    ("level", "full", "images"),
    [("free", 200, True), ("free", 50, False), ("free_3", 20, True), ("free_5", 20, True)],
)
def test_bench_suite(benchmark, level, full, images):
    def call():
        made = (guess_free.make(level, index, 0) for index in range(max(3, round(SCALE * full))))
        return run(recording if images else replace(recording, images=None) for recording in made)

    good, off_m, seconds = benchmark.pedantic(call, rounds=1)
    told(f"{level}, {'pictures and masks' if images else 'masks alone'}", good, off_m, seconds)
    assert good.mean() >= 0.99
    assert np.median(seconds) < 5


@pytest.mark.skipif(not SHARED.is_dir(), reason="the lit recordings (../shared) are not beside this checkout")
def test_bench_lit(benchmark):
    lit = [load(path) for path in sorted(SHARED.glob("lit_ur5e_1_*"))]

    def call():
        single = [recording.subset([i]) for recording in lit for i in range(len(recording))]
        return run(single[:: max(1, round(1 / SCALE))]), run(lit)

    one, five = benchmark.pedantic(call, rounds=1)
    told("lit recordings, single view", *one)
    told("lit recordings, five views", *five)
    assert one[0].all()
    assert five[0].all()
