"""What whole commands cost: wall clock, CPU time and peak memory, of this checkout and others in turn.

Run: ``python benchmarks/bench_commands.py [--checkout OTHER]... [--rounds 3] [--only NAME]...``. All checkouts are run
by this interpreter, each from its own packages, turn by turn. The recordings are those of ../shared/data; the first
round fills the caches and is not counted. ``HECBENCH_NO_CACHE=1`` detects and prepares anew each time.
"""

import argparse
import json
import os
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

HERE = Path(__file__).resolve().parents[1]
DATA = HERE.parent / "shared" / "data"
FREE = ("--solver", "render_gn_free", "--no-held-out")
COMMANDS = {
    "help": ("--help",),
    "plugins": ("plugins",),
    "check, 40 photographs": ("check", "{undetected}"),
    "park, 40 photographs": ("solve", "{undetected}", "--solver", "park"),
    "render_gn, masks, 5 views": ("solve", "{data}/lit_ur5e_1_00", "--solver", "render_gn", "--no-held-out"),
    "render_gn_free, 5 photographs": ("solve", "{data}/ur3e_cam1", *FREE, "--views", "5"),
    "render_gn_free, 40 photographs": ("solve", "{data}/ur3e_cam1", *FREE),
}


def without_corners(folder):
    """A copy of ur3e_cam1 whose target is still to be detected."""
    shutil.copytree(DATA / "ur3e_cam1", folder)
    told = json.loads((folder / "recording.json").read_text())
    for sample in told["samples"]:
        sample.pop("corners_px", None)
    (folder / "recording.json").write_text(json.dumps(told))
    return folder


def cost(checkout, arguments):
    """Wall s, CPU s, peak MB of one command."""
    start = time.perf_counter()
    places = [str(checkout / package) for package in ("", "plugins", "datasets", "hardware")]
    process = subprocess.Popen(
        [sys.executable, "-c", "from hecbench.commands.cli import main; main()", *arguments],
        env={**os.environ, "PYTHONPATH": os.pathsep.join(places)},
        cwd=checkout,
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )
    _, status, used = os.wait4(process.pid, 0)
    if os.waitstatus_to_exitcode(status) not in (0, 3):
        raise SystemExit(f"{checkout}: hecbench {' '.join(arguments)} failed")
    return time.perf_counter() - start, used.ru_utime + used.ru_stime, used.ru_maxrss / 1024


def main():
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--checkout", type=Path, action="append", default=[])
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--only", action="append", choices=COMMANDS)
    options = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        places = {"data": str(DATA), "undetected": str(without_corners(Path(folder) / "undetected"))}
        for name in options.only or COMMANDS:
            arguments = [word.format(**places) for word in COMMANDS[name]]
            checkouts = [HERE, *(checkout.resolve() for checkout in options.checkout)]
            rounds = [[cost(place, arguments) for place in checkouts] for _ in range(options.rounds + 1)][1:]
            for checkout, rows in zip(checkouts, zip(*rounds, strict=True), strict=True):
                wall, cpu, peak = (statistics.median(column) for column in zip(*rows, strict=True))
                print(
                    f"{name:32} {checkout.name:16} {wall:6.2f} s wall {cpu:6.2f} s CPU {peak:5.0f} MB",
                    flush=True,
                )


if __name__ == "__main__":
    main()
