"""Nothing dies with a neighbour: killed workers, killed parents, SIGTERM, a full disk."""

import json
import resource
import signal
import subprocess
import sys
import time

import psutil
import pytest

COMMAND = [sys.executable, "-m", "hecbench", "run", "markers", "--level", "tag_2m", "--seed", "3"]
SOLVERS = ["--solver", "bundle", "--solver", "park"]
ITEMS = 60
DEADLINE_S = 120
"""Generous: the machine may be busy."""


def start(out, *more):
    """A run that Ctrl-C ends, also where these tests run in the background, with that signal ignored."""
    return subprocess.Popen(
        [*COMMAND, *SOLVERS, "--samples", str(ITEMS), "--jobs", "2", "--out", str(out), *more],
        stdout=subprocess.PIPE, stderr=subprocess.PIPE,
        preexec_fn=lambda: signal.signal(signal.SIGINT, signal.SIG_DFL),
    )  # fmt: skip


def until(happened):
    end = time.monotonic() + DEADLINE_S
    while not (found := happened()):
        assert time.monotonic() < end, "it did not happen in time"
        time.sleep(0.05)
    return found


def lines(out):
    path = out / "estimates.jsonl"
    return path.read_bytes().splitlines() if path.exists() else []


def results(out):
    found = [json.loads(line) for line in lines(out)]
    return sorted((r["item"], r["solver"]) for r in found if r["status"] == "ok")


def working(run):
    """The workers, once both have begun."""
    children = psutil.Process(run.pid).children()
    return children if len(children) == 2 else None


EXPECTED = sorted((f"{i:06d}", solver) for i in range(ITEMS) for solver in ("bundle", "park"))


def test_a_killed_worker_costs_nothing(tmp_path):
    run = start(tmp_path / "out")
    workers = until(lambda: working(run))
    until(lambda: lines(tmp_path / "out"))
    workers[0].send_signal(signal.SIGKILL)
    _, errors = run.communicate(timeout=DEADLINE_S)
    assert run.returncode == 0, errors.decode()
    assert b"Traceback" not in errors
    assert results(tmp_path / "out") == EXPECTED


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGTERM, signal.SIGINT])
def test_a_run_that_is_ended_leaves_no_worker_and_goes_on_with_resume(tmp_path, number):
    run = start(tmp_path / "out")
    workers = until(lambda: working(run))
    until(lambda: len(lines(tmp_path / "out")) > 2)
    run.send_signal(number)
    _, errors = run.communicate(timeout=DEADLINE_S)
    assert b"Traceback" not in errors
    assert run.returncode == (-signal.SIGKILL if number is signal.SIGKILL else 130)
    gone, alive = psutil.wait_procs(workers, timeout=5)
    assert not alive
    assert len(gone) == 2
    again = start(tmp_path / "out", "--resume")
    _, errors = again.communicate(timeout=DEADLINE_S)
    assert again.returncode == 0, errors.decode()
    assert results(tmp_path / "out") == EXPECTED


@pytest.mark.parametrize("jobs", ["1", "2"])
def test_a_full_disk_is_one_line_and_the_store_can_be_resumed(tmp_path, jobs):
    out = tmp_path / "out"

    def small_disk():
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (12_000, 12_000))

    command = [*COMMAND, "--solver", "park", "--samples", "20", "--jobs", jobs, "--out", str(out)]
    done = subprocess.run(
        command, capture_output=True, preexec_fn=small_disk, check=False, timeout=DEADLINE_S
    )
    message = done.stderr.decode().strip().splitlines()
    assert done.returncode == 1
    assert not [line for line in message if "Traceback" in line]
    assert "estimates.jsonl" in message[-1]
    subprocess.run([*command, "--resume"], capture_output=True, check=True, timeout=DEADLINE_S)
    assert len(results(out)) == 20


def test_the_demo_deletes_nothing(tmp_path):
    out = tmp_path / "mine"
    subprocess.run(
        [*COMMAND[:4], "synthetic", "--level", "LP", "--samples", "1", "--solver", "render_gn",
         "--out", str(out)], capture_output=True, check=True, timeout=DEADLINE_S,
    )  # fmt: skip
    store = out / "estimates.jsonl"
    before = store.read_bytes()
    done = subprocess.run(
        [sys.executable, "-m", "hecbench", "demo", "--out", str(out), "--samples", "1"],
        capture_output=True, check=False, timeout=DEADLINE_S,
    )  # fmt: skip
    assert done.returncode == 2
    assert store.read_bytes() == before
