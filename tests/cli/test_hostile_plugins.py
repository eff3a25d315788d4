"""A stranger's solver that misbehaves costs its own row, in every verb that runs solvers."""

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from hecbench import conformance
from hecbench.recording import Mounting
from hecbench.storage import recording_io

MODULE = """
import ctypes, os, time
import numpy as np
from hecbench.estimate import Estimate
from hecbench.registry import hookimpl
from hecbench.specs import SolverSpec

def array(recording, *, rng): return np.eye(4)
def nan(recording, *, rng): return Estimate(np.full((4, 4), np.nan))
def raises(recording, *, rng): raise KeyError("no such key")
def exits(recording, *, rng): os._exit(3)
def crashes(recording, *, rng): ctypes.string_at(0)
def hangs(recording, *, rng):
    while True: time.sleep(1)
def prints(recording, *, rng):
    print("hello from python")
    os.write(1, b"hello from below\\n")
    return Estimate(np.eye(4))
def unpicklable(recording, *, rng): return Estimate(np.eye(4), diagnostics={"f": lambda: 0})

@hookimpl
def hecbench_solvers():
    for solver in (array, nan, raises, exits, crashes, hangs, prints, unpicklable):
        yield SolverSpec(name="bad_" + solver.__name__, summary="s", factory=lambda solver=solver: solver,
                         needs=frozenset(), reference="none")
"""
REASONS = {
    "bad_array": ("failed", "returned a ndarray, not an Estimate"),
    "bad_nan": ("failed", "gave no valid answer"),
    "bad_raises": ("failed", "KeyError: 'no such key'"),
    "bad_exits": ("failed", "ended without an answer"),
    "bad_crashes": ("failed", "SIGSEGV"),
    "bad_hangs": ("timeout", "no answer within 12 s; give it more with --timeout"),
    "bad_unpicklable": ("failed", "pickle"),
}


@pytest.fixture(scope="module")
def with_strangers(tmp_path_factory):
    """Run the command line with the stranger's distribution installed beside ours."""
    site = tmp_path_factory.mktemp("site")
    (site / "bad_calibrator.py").write_text(MODULE)
    info = site / "bad_calibrator-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: bad-calibrator\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text("[hecbench]\nbad = bad_calibrator\n")

    def run(*arguments):
        return subprocess.run(
            [Path(sys.executable).parent / "hecbench", *map(str, arguments)],
            env={**os.environ, "PYTHONPATH": str(site)},
            capture_output=True,
            text=True,
            timeout=240,
            check=False,
        )

    return run


@pytest.fixture(scope="module")
def cell(tmp_path_factory):
    folder = tmp_path_factory.mktemp("cell")
    recording_io.save(conformance.rig(np.random.default_rng(1), Mounting.EYE_TO_HAND, noise=1e-3), folder)
    return folder


def named(solvers):
    return [word for solver in solvers for word in ("--solver", solver)]


def test_solve_reports_each_and_keeps_the_others(with_strangers, cell):
    done = with_strangers(
        "solve", cell, "--json", "--timeout", 12, *named(["shah", *REASONS, "bad_prints"]), "--no-check"
    )
    assert done.returncode == 1, done.stderr
    estimates = {estimate["solver"]: estimate for estimate in json.loads(done.stdout)}
    assert estimates["shah"]["status"] == "ok"
    assert estimates["bad_prints"]["status"] == "ok"
    assert "hello from python" in done.stderr
    assert "hello from below" in done.stderr
    for solver, (status, reason) in REASONS.items():
        assert estimates[solver]["status"] == status
        assert reason in estimates[solver]["reason"]
    assert "Traceback" not in done.stderr


def test_without_a_timeout_a_stranger_cannot_end_the_run(with_strangers, cell, tmp_path):
    solvers = [*(set(REASONS) - {"bad_hangs"}), "bad_prints", "shah"]
    done = with_strangers("run", cell, "--json", "--out", tmp_path / "out", *named(solvers))
    assert done.returncode == 0, done.stderr
    estimates = {estimate["solver"]: estimate for estimate in json.loads(done.stdout)}
    assert set(estimates) == set(solvers)
    assert estimates["shah"]["status"] == "ok"
    assert "SIGSEGV" in estimates["bad_crashes"]["reason"]
