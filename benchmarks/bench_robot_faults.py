"""A thousand random faults: every one ends in a named state in time, leaves no process and no torn file.

Run: ``make bench TEST_ARGS=benchmarks/bench_robot_faults.py`` (a quarter of an hour).
"""

from collections import Counter

import numpy as np
from hecbench_hardware import campaign

FAULTS, SEED = 1000, 1


def test_fault_campaign(benchmark, tmp_path):
    def run():
        for outcome in campaign.run(FAULTS, SEED, tmp_path):
            if not outcome.fine:
                print(outcome, flush=True)
            outcomes.append(outcome)

    outcomes = []
    benchmark.pedantic(run, rounds=1)
    past_s = [o.elapsed_s - o.allowed_s + campaign.PAST_EXPECTED_S for o in outcomes]
    print("\ninjected:", dict(Counter(outcome.fault for outcome in outcomes).most_common()))
    print("during:", dict(Counter(outcome.work for outcome in outcomes).most_common()))
    print("ended as:", dict(Counter(outcome.state for outcome in outcomes).most_common()))
    print(f"past the expected time: median {np.median(past_s):.2f} s, worst {max(past_s):.2f} s")
    assert len(outcomes) == FAULTS
    assert all(outcome.fine for outcome in outcomes)
