"""Thirty random faults; the long campaign is benchmarks/bench_robot_faults.py."""

import pytest
from hecbench_hardware import campaign

pytest.importorskip("rtde_receive", reason="ur-rtde has no wheel for this Python")


@pytest.mark.parametrize("seed", range(3))
def test_every_fault_ends_well(tmp_path, seed):
    outcomes = list(campaign.run(10, seed, tmp_path))
    assert len(outcomes) == 10
    assert [(o.work, o.fault, o.message, o.complaints) for o in outcomes if not o.fine] == []
    assert len({outcome.work for outcome in outcomes}) >= 3
    assert len({outcome.state for outcome in outcomes}) >= 3
    assert not list(tmp_path.iterdir())
