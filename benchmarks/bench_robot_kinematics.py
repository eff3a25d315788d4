"""Analytic inverse kinematics against the forward kinematics: 10,000 poses per arm, all branches, <= 1e-9 m.

Run: ``make bench TEST_ARGS=benchmarks/bench_robot_kinematics.py``.
"""

from math import pi

import numpy as np
import pytest
from hecbench_hardware.kinematics import ARMS, wrap

POSES = 10_000


@pytest.mark.parametrize("arm", ARMS.values(), ids=ARMS)
def test_all_branches_of_many_poses(arm, benchmark):
    joints = np.random.default_rng(0).uniform(-pi, pi, (POSES, 6))
    base_T_flange = arm.forward(joints)

    solutions = benchmark.pedantic(lambda: [arm.inverse(pose) for pose in base_T_flange], rounds=1)

    errors_m, errors = np.zeros(POSES), np.zeros(POSES)
    for k, rows in enumerate(solutions):
        difference = arm.forward(rows) - base_T_flange[k]
        errors_m[k] = np.linalg.norm(difference[:, :3, 3], axis=1).max()
        errors[k] = np.abs(difference).max()
        assert np.abs(wrap(rows - joints[k])).max(axis=1).min() < 1e-4, "the pose's own joints are a branch"
    branches = np.bincount([len(rows) for rows in solutions], minlength=9)
    print(f"\n{arm.name}: position error max {errors_m.max():.1e} m, matrix entry max {errors.max():.1e}")
    print(f"{arm.name}: poses with 2, 4, 6, 8 branches: {branches[[2, 4, 6, 8]].tolist()}")
    assert errors_m.max() <= 1e-9
