"""A method of your own against ours, on the same recordings: no package is needed to try one."""

import numpy as np

from hecbench import registry, se3, statistics
from hecbench.estimate import Estimate
from hecbench.running.solving import solve
from hecbench.specs import Kind, Need, SolverSpec, SuiteSpec


def mean_of_samples(recording, *, rng):
    """X from the assumption that the target sits exactly on the flange: what a first attempt often does."""
    hand, target = recording.hand_poses(), recording.camera_T_target
    return Estimate(se3.mean(hand @ se3.inverse(target)))


mine = SolverSpec(
    name="mean_of_samples",
    summary="no unknown between flange and target",
    factory=lambda: mean_of_samples,
    needs=frozenset({Need.TARGET_POSES}),
    reference="nobody",
)
park = registry.load().get(Kind.SOLVER, "park", SolverSpec)
suite = registry.load().get(Kind.SUITE, "markers", SuiteSpec)
errors_mm = {"mean_of_samples": [], "park": []}
for index in range(10):
    for estimate in solve(suite.make("board_2m", index, 0), [mine, park]):
        errors_mm[estimate.solver].append(estimate.errors["tre_mm"])
for name, values in errors_mm.items():
    median = statistics.bootstrap(values, np.median)
    print(
        f"{name:16} median TRE {median.value:.1f} mm [{median.low:.1f}, {median.high:.1f}], n = {len(values)}"
    )
