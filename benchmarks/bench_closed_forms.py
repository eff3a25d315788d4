"""The closed forms: exactness on 1,000 random rigs, time per solve, and the rate of whole runs.

Run: ``make bench TEST_ARGS=benchmarks/bench_closed_forms.py`` (the rate: 10,000 recordings, some minutes).
"""

import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from hecbench import registry, se3
from hecbench.estimate import Status
from hecbench.recording import Mounting, Recording
from hecbench.running import runner, solving
from hecbench.specs import Kind, SolverSpec

CLOSED_FORMS = ("andreff", "daniilidis", "horaud", "li", "park", "shah", "tsai")


def random_poses(rng, count, angle_deg):
    axes = rng.normal(size=(count, 3))
    axes /= np.linalg.norm(axes, axis=1, keepdims=True)
    angles = np.deg2rad(rng.uniform(0, angle_deg, (count, 1)))
    return se3.from_rotvec(axes * angles, rng.uniform(-0.5, 0.5, (count, 3)))


def exact_recording(rng, mounting, samples, angle_deg):
    X, Y = random_poses(rng, 2, 180)
    hand = random_poses(rng, 1, 180) @ random_poses(rng, samples, angle_deg)
    return Recording(
        name="exact",
        mounting=mounting,
        sample_ids=tuple(map(str, range(samples))),
        truth_parent_T_camera=X,
        base_T_flange=hand if mounting is Mounting.EYE_TO_HAND else se3.inverse(hand),
        camera_T_target=se3.inverse(X) @ hand @ Y,
    )


def specs():
    return [registry.load().get(Kind.SOLVER, name, SolverSpec) for name in CLOSED_FORMS]


def test_exact_data_on_1000_rigs(benchmark):
    """5 to 20 samples, hand rotations up to 20 to 180 deg, any X and Y, mountings in turn."""

    def campaign():
        rng = np.random.default_rng(0)
        return [
            estimate
            for i in range(1000)
            for estimate in solving.solve(
                exact_recording(rng, list(Mounting)[i % 2], rng.integers(5, 21), rng.uniform(20, 180)),
                specs(),
            )
        ]

    estimates = benchmark.pedantic(campaign, rounds=1)
    print(f"\n{'solver':12} {'ok':>5} {'refused':>8} {'worst m':>10} {'worst rad':>10}")
    for name in CLOSED_FORMS:
        mine = [e for e in estimates if e.solver == name]
        answered = [e.errors for e in mine if e.status is Status.OK]
        metres = 1e-3 * max(errors["translation_error_mm"] for errors in answered)
        radians = np.deg2rad(max(errors["rotation_error_deg"] for errors in answered))
        refused = [e for e in mine if e.status is Status.REFUSED]
        print(f"{name:12} {len(answered):5} {len(refused):8} {metres:10.1e} {radians:10.1e}")
        for reason in sorted({e.reason for e in refused})[:2]:
            print(f"             {reason}")
        assert metres <= 1e-6
        assert radians <= 1e-6
        assert len(answered) + len(refused) == len(mine)
        assert len(refused) <= 20


@pytest.mark.parametrize("spec", specs(), ids=lambda spec: spec.name)
def test_one_solve_at_20_samples(spec, benchmark):
    """One core: at most 5 ms."""
    import cv2

    cv2.setNumThreads(1)
    recording = exact_recording(np.random.default_rng(1), Mounting.EYE_TO_HAND, 20, 45)
    solver, rng = spec.factory(), np.random.default_rng(0)
    benchmark(lambda: solver(recording, rng=rng))


def test_start_up(benchmark):
    """Wall time of --help and plugins, median of 7, after one warm-up."""
    executable = Path(sys.executable).parent / "hecbench"

    def median(*arguments):
        seconds = []
        for _ in range(8):
            start = time.perf_counter()
            subprocess.run([executable, *arguments], stdout=subprocess.DEVNULL, check=True)
            seconds.append(time.perf_counter() - start)
        return float(np.median(seconds[1:]))

    help_s, plugins_s = benchmark.pedantic(lambda: (median("--help"), median("plugins")), rounds=1)
    print(f"\n--help {help_s:.3f} s, plugins {plugins_s:.3f} s")


@pytest.mark.parametrize("jobs", [1, 2])
def test_rate_of_10000_recordings(jobs, benchmark, tmp_path):
    """Generated recordings through PnP, seven solvers, rulers and the store."""
    tasks = [runner.Task(CLOSED_FORMS, suite="markers", level="tag_2m", index=i) for i in range(10_000)]
    options = solving.Options(stop_on_bad_input=False)
    start = time.perf_counter()
    contents = benchmark.pedantic(
        lambda: runner.run(tasks, options, out=tmp_path / "run", jobs=jobs), rounds=1
    )
    seconds = time.perf_counter() - start
    print(
        f"\n--jobs {jobs}: {len(contents.estimates)} calibrations, {len(contents.estimates) / seconds:.0f} per s"
    )
