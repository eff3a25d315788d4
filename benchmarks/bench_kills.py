"""Long commands ended at a random moment by a random signal, then resumed: nothing lost, doubled, torn or left running.

    python benchmarks/bench_kills.py [--verb NAME]... [--kills 40] [--seed 0]

Each of `run`, `trial`, `record`, `calibrate` and `train` is ended `--kills` times by SIGKILL, SIGTERM or SIGINT while
it works. After each, every file of results must be whole, none of its processes may be alive 5 s later, and the same
command must then end with the results of one that nobody ended. Exits with 1 when something was wrong.
"""

from __future__ import annotations

import contextlib
import json
import random
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

import click
import msgspec
import numpy as np
import psutil
from bench_robot_unattended import cell

from hecbench import conformance
from hecbench.recording import Mounting
from hecbench.storage import journal, recording_io, store, trial_record

SIGNALS = (signal.SIGKILL, signal.SIGTERM, signal.SIGINT)
ORPHANS_AFTER_S, LONGEST_S = 5.0, 300.0
T = TypeVar("T")


@dataclass(frozen=True)
class Verb:
    """A command without its ``--out``, what resumes it, and what it leaves: sorted, without what may differ."""

    command: tuple[str, ...]
    resume: tuple[str, ...]
    results: Callable[[Path], object]

    def line(self, out: Path, *more: str) -> list[str]:
        return [sys.executable, "-m", "hecbench", *self.command, "--out", str(out), *more]


def whole_lines(path: Path, kind: type[T]) -> list[T]:
    """The lines of a journal, each as often as it stands there; the torn ones that a resumed run made again are not."""
    found = []
    for _, line in journal.lines(path):
        with contextlib.suppress(msgspec.DecodeError, UnicodeDecodeError):
            found.append(msgspec.json.decode(line, type=kind))
    return found


def run_results(out: Path) -> object:
    lines = whole_lines(out / store.FILE_NAME, dict)
    return sorted((one["level"], one["item"], one["solver"]) for one in lines if one["status"] == "ok")


def trial_results(out: Path) -> object:
    return sorted(trial.key for trial in whole_lines(out / trial_record.FILE_NAME, trial_record.TrialRecord))


def record_results(out: Path) -> object:
    found = recording_io.load(out)
    return found.sample_ids, np.round(found.present.joints_rad, 3).tolist()


def calibrate_results(out: Path) -> object:
    verdict = json.loads((out / "verdict.json").read_text())
    page = (out / "report.html").read_text()
    return verdict["parent_T_camera"], verdict["grade"], page.rstrip().endswith("</html>")


def train_results(out: Path) -> object:
    import cv2

    cv2.dnn.readNetFromONNX(str(out / "model" / "generator.onnx"))
    return json.loads((out / "model" / "model.json").read_text())["steps"]


def verbs(scratch: Path) -> dict[str, Verb]:
    cell(scratch / "cell")
    rig = conformance.rig(np.random.default_rng(1), Mounting.EYE_TO_HAND, noise=1e-4)
    recording_io.save(rig, scratch / "rig")
    return {
        "run": Verb(
            ("run", "markers", "--level", "tag_2m", "--solver", "bundle", "--solver", "park",
             "--samples", "60", "--jobs", "2"), ("--resume",), run_results,
        ),
        "trial": Verb(
            ("trial", "grasp", "--offset-mm", "3", "--no-render"), ("--resume",), trial_results
        ),
        "record": Verb(
            ("record", str(scratch / "cell"), "--robot", "sim_ur5e", "--set", "robot.time_scale=5", "--yes"),
            (), record_results,
        ),
        "calibrate": Verb(("calibrate", str(scratch / "rig"), "--tolerance-mm", "20"), (), calibrate_results),
        "train": Verb(
            ("train", "translation", "--method", "cut", "--robot", "ur3e", "--steps", "6", "--size", "64"),
            (), train_results,
        ),
    }  # fmt: skip


def torn(out: Path) -> list[str]:
    """Files of whole results that cannot be read."""
    found = []
    for path in out.rglob("*.json"):
        try:
            json.loads(path.read_text())
        except ValueError:
            found.append(str(path))
    return found


def ended_at_random(line: list[str], longest_s: float, rng: random.Random) -> list[str]:
    """Start a command and end it; returns what was wrong with its end."""
    number, moment_s = rng.choice(SIGNALS), rng.uniform(0.3, longest_s)
    process = subprocess.Popen(line, stdout=subprocess.PIPE, stderr=subprocess.PIPE)
    time.sleep(moment_s)
    family = psutil.Process(process.pid).children(recursive=True) if process.poll() is None else []
    process.send_signal(number)
    try:
        _, errors = process.communicate(timeout=LONGEST_S)
    except subprocess.TimeoutExpired:
        process.kill()
        return [f"{number.name} after {moment_s:.1f} s: did not end in {LONGEST_S:.0f} s"]
    wrong = []
    if b"Traceback" in errors:
        wrong.append(f"{number.name} after {moment_s:.1f} s: a traceback: {errors.decode()[-300:]}")
    _, alive = psutil.wait_procs(family, timeout=ORPHANS_AFTER_S)
    if alive:
        wrong.append(f"{number.name} after {moment_s:.1f} s: {len(alive)} processes are left")
    return wrong


def complete(line: list[str]) -> float:
    """Run a command to its end; returns how long it took.

    Raises:
        RuntimeError: it fails.
    """
    start = time.monotonic()
    done = subprocess.run(line, capture_output=True, check=False, timeout=LONGEST_S)
    if done.returncode not in (0, 1) or b"Traceback" in done.stderr:
        raise RuntimeError(
            f"{' '.join(line[2:])}: ended with {done.returncode}: {done.stderr.decode()[-300:]}"
        )
    return time.monotonic() - start


def tried(verb: Verb, kills: int, scratch: Path, rng: random.Random) -> list[str]:
    """What was wrong in so many kills of a command."""
    whole = scratch / "whole"
    longest_s = complete(verb.line(whole))
    expected, wrong = verb.results(whole), []
    for number in range(kills):
        out = scratch / f"{number:03d}"
        found = ended_at_random(verb.line(out), longest_s, rng)
        found += [f"{path} is torn" for path in torn(out)]
        try:
            complete(verb.line(out, *verb.resume))
            if verb.results(out) != expected:
                found.append(f"{out}: other results than without a kill")
        except (RuntimeError, subprocess.TimeoutExpired, OSError, ValueError) as error:
            found.append(f"{out}: {error}")
        wrong += found
        for line in found:
            click.echo(line)
    return wrong


@click.command()
@click.option("--verb", "chosen", multiple=True, help="Repeatable; default: all.")
@click.option("--kills", default=40, show_default=True, help="Of each verb.")
@click.option("--seed", default=0, show_default=True)
def main(chosen: tuple[str, ...], kills: int, seed: int) -> None:
    """End commands at random moments and resume them."""
    total = 0
    with tempfile.TemporaryDirectory() as folder:
        for name, verb in verbs(Path(folder)).items():
            if not chosen or name in chosen:
                scratch = Path(folder) / name
                scratch.mkdir()
                wrong = tried(verb, kills, scratch, random.Random(f"{seed} {name}"))
                click.echo(f"{name}: {kills} kills, {len(wrong)} wrong")
                total += len(wrong)
    sys.exit(total > 0)


if __name__ == "__main__":
    main()
