"""A thousand random faults: every one ends in a named state in time, leaves no process and no torn file.

Run: ``.venv/bin/python benchmarks/bench_robot_faults.py [COUNT] [SEED]``.
"""

import sys
import tempfile
from collections import Counter
from pathlib import Path

import numpy as np
from hecbench_hardware import campaign


def main(count=1000, seed=1):
    states, faults, late_s, bad = Counter(), Counter(), [], 0
    with tempfile.TemporaryDirectory() as folder:
        for outcome in campaign.run(count, seed, Path(folder)):
            states[outcome.state] += 1
            faults[outcome.fault.split()[0]] += 1
            late_s.append(outcome.elapsed_s - outcome.allowed_s + campaign.PAST_EXPECTED_S)
            if not outcome.fine:
                bad += 1
                print(outcome, flush=True)
    print(f"{count} faults, {bad} ended badly")
    print("injected:", dict(faults.most_common()))
    print("ended as:", dict(states.most_common()))
    print(f"past the expected time: median {np.median(late_s):.2f} s, worst {max(late_s):.2f} s")
    return bad


if __name__ == "__main__":
    sys.exit(1 if main(*map(int, sys.argv[1:])) else 0)
