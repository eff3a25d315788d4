"""Commands that detect tags, each many times with a heap that shows every misuse: all must end as they should.

    python benchmarks/bench_exit_codes.py [--verb NAME]... [--times 200]

`detect` and `solve` take the tag families in turn; families that cannot be drawn here are looked for in vain, which is
a refusal. `trial` looks for the lab's tag. Exits with 1 when a command ended otherwise than in an ordinary heap.
"""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from collections import Counter
from pathlib import Path

import click
import numpy as np
from hecbench_plugins.detection.apriltag import FAMILIES
from hecbench_plugins.printing.seen import seen

from hecbench import se3
from hecbench.errors import InputError
from hecbench.recording import CameraModel, Mounting, Recording
from hecbench.storage import recording_io
from hecbench.targets import AprilTagTarget

STRICT_HEAP = {
    "MALLOC_PERTURB_": "165",
    "GLIBC_TUNABLES": "glibc.malloc.mxfast=0:glibc.malloc.tcache_count=0",
}
VERBS = ("detect", "solve", "trial")
SAMPLES, SEED = 6, 0


def photographed(family: str, folder: Path) -> Path:
    """A recording of tag pictures, without corners; of noise where the family cannot be drawn."""
    rng = np.random.default_rng(SEED)
    camera = CameraModel.centred(320, 240, 320.0)
    target = AprilTagTarget(family=family, id=1, size_m=0.1)
    base_T_camera = se3.make(se3.so3_exp([0.2, 2.8, 0.1]), [1.0, 0.1, 0.6])
    images, base_T_flange = [], []
    for _ in range(SAMPLES):
        turn, shift = rng.uniform(-0.6, 0.6, 3), rng.uniform(-0.06, 0.06, 3)
        camera_T_target = se3.make(se3.so3_exp(turn), shift + np.array([0, 0, 0.4]))
        base_T_flange.append(base_T_camera @ camera_T_target @ se3.make(np.eye(3), [0, 0, -0.05]))
        try:
            images.append(seen(target, camera.intrinsics, camera_T_target, (camera.width, camera.height)))
        except InputError:
            images.append(rng.integers(0, 255, (camera.height, camera.width), dtype=np.uint8))
    recording = Recording(
        name=family,
        mounting=Mounting.EYE_TO_HAND,
        sample_ids=tuple(f"{sample:02d}" for sample in range(SAMPLES)),
        camera=camera,
        target=target,
        base_T_flange=np.array(base_T_flange),
        images=tuple(images),
    )
    recording_io.save(recording, folder)
    return folder


def command(verb: str, family: str, folder: Path, number: int) -> list[str]:
    """The one of this number, with an output of its own."""
    out = str(folder / f"{verb}_{number}")
    if verb == "trial":
        size = ("--size", "640x480", "--supersample", "1")
        return ["trial", "grasp", "--offset-mm", "0", "--trials", "1", *size, "--out", out]
    if verb == "detect":
        return ["detect", str(folder / family), out, "--no-cache"]
    return ["solve", str(folder / family), "--solver", "shah", "--no-held-out", "--no-check", "--no-cache"]


def ended(command: list[str], heap: dict[str, str]) -> int:
    """The exit code; a signal is negative."""
    line = [sys.executable, "-m", "hecbench", *command]
    return subprocess.run(line, env=os.environ | heap, capture_output=True, check=False).returncode


@click.command()
@click.option("--verb", "chosen", multiple=True, type=click.Choice(VERBS), help="Repeatable; default: all.")
@click.option("--times", default=200, show_default=True, help="Of each verb.")
def main(chosen: tuple[str, ...], times: int) -> None:
    """Count the exit codes."""
    wrong = 0
    with tempfile.TemporaryDirectory() as scratch:
        folder = Path(scratch)
        for family in FAMILIES:
            photographed(family, folder / family)
        for verb in chosen or VERBS:
            families = FAMILIES[:1] if verb == "trial" else FAMILIES
            expected = {
                family: ended(command(verb, family, folder, -1 - place), {})
                for place, family in enumerate(families)
            }
            found: Counter[tuple[str, int]] = Counter()
            for number in range(times):
                family = families[number % len(families)]
                found[family, ended(command(verb, family, folder, number), STRICT_HEAP)] += 1
            right = sum(count for (family, code), count in found.items() if code == expected[family] >= 0)
            click.echo(f"{verb}: {right} of {times} as expected; by family and code: {dict(found)}")
            wrong += times - right
    sys.exit(wrong > 0)


if __name__ == "__main__":
    main()
