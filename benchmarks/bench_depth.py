"""`depth_icp` on the lab's stereo depth: TRE, success and CPU seconds, from starts and without one.

    python benchmarks/bench_depth.py [--cells 18] [--starts 6] [--seed 100] [--out FILE.json]

A cell has nine configurations before a camera 1.3 m away, 640x480 px, with the noise of `lab.stereo`. Each is solved
from starts off by exactly 0.1 m and 10 deg in random directions, and once without a start. Right is a TRE of 5 mm.
"""

from __future__ import annotations

import argparse
import json
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
from hecbench_hardware.lab import recordings
from hecbench_plugins.solvers.depth_icp import depth_icp

from hecbench import se3
from hecbench.errors import HecbenchError
from hecbench.statistics import bootstrap, wilson
from hecbench.workspace import apart_m, points_in_parent

RIGHT_MM, OFF_M, OFF_RAD = 5.0, 0.1, np.deg2rad(10.0)


def off(truth, rng):
    """A start 0.1 m and 10 deg away."""
    shift, axis = rng.normal(size=(2, 3))
    R = truth[:3, :3] @ se3.so3_exp(OFF_RAD * axis / np.linalg.norm(axis))
    return se3.make(R, truth[:3, 3] + OFF_M * shift / np.linalg.norm(shift))


def run(solve, item, start, seed):
    """TRE in mm (None without an answer), CPU s, standardised squared error, and the reason."""
    workspace = points_in_parent(item.base_T_flange, camera_moves=False)
    given = replace(item.without_truth(), initial_parent_T_camera=start)
    began = time.process_time()
    try:
        found = solve(given, rng=np.random.default_rng(seed))
    except HecbenchError as error:
        return {"tre_mm": None, "cpu_s": time.process_time() - began, "reason": str(error)[:80]}
    twist = se3.log(item.truth_parent_T_camera @ se3.inverse(found.parent_T_camera))
    return {
        "tre_mm": 1e3 * float(apart_m(found.parent_T_camera, item.truth_parent_T_camera, workspace)),
        "cpu_s": time.process_time() - began,
        "squares": float(twist @ np.linalg.solve(found.covariance, twist)) / 6,
    }


def summed(name, rows):
    """A line: right of all with its interval, wrong answers, median and mean TRE, CPU seconds."""
    errors = [row["tre_mm"] for row in rows if row["tre_mm"] is not None]
    right = sum(error <= RIGHT_MM for error in errors)
    rate, median = wilson(right, len(rows)), bootstrap(np.array(errors), np.median)
    seconds = [row["cpu_s"] for row in rows]
    squares = [row["squares"] for row in rows if "squares" in row]
    print(
        f"{name}: right {right} of {len(rows)} [{rate.low:.3f}, {rate.high:.3f}], wrong {len(errors) - right},"
        f" TRE median {median.value:.2f} [{median.low:.2f}, {median.high:.2f}] mean {np.mean(errors):.2f}"
        f" largest {max(errors):.2f} mm, CPU median {np.median(seconds):.2f} largest {max(seconds):.2f} s,"
        f" squared error over its variance {np.median(squares):.2f}",
        flush=True,
    )


def main():
    """Run all cells."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--cells", type=int, default=18)
    parser.add_argument("--starts", type=int, default=6)
    parser.add_argument("--seed", type=int, default=100)
    parser.add_argument("--out", type=Path)
    options = parser.parse_args()
    solve, started, free, masked = depth_icp(), [], [], []
    for cell in range(options.cells):
        item = recordings.depth_recording(cell % 18, options.seed + cell // 18)
        rng = np.random.default_rng([options.seed, cell])
        if cell == 0:
            run(solve, item, item.initial_parent_T_camera, 0)  # compiles
        starts = [off(item.truth_parent_T_camera, rng) for _ in range(options.starts)]
        started += [run(solve, item, start, number) for number, start in enumerate(starts)]
        masked.append(run(depth_icp(silhouette=True), item, starts[0], 0))
        free.append(run(solve, item, None, 0))
        if options.out:
            options.out.write_text(json.dumps({"started": started, "free": free, "masks": masked}, indent=1))
    summed("from a start", started)
    summed("with masks", masked)
    summed("without a start", free)


if __name__ == "__main__":
    main()
