"""The robot itself is the target: a drawn UR5e, its masks and a start that is 10 cm off."""

import numpy as np

from hecbench import registry, se3
from hecbench.running.solving import solve
from hecbench.specs import Kind, SolverSpec, SuiteSpec

recording = registry.load().get(Kind.SUITE, "synthetic", SuiteSpec).make("LP", 0, 0)
truth, start = recording.truth_parent_T_camera, recording.initial_parent_T_camera
print(f"the start is {1e3 * se3.translation_error_m(start, truth):.0f} mm off")

solver = registry.load().get(Kind.SOLVER, "render_gn", SolverSpec)
(estimate,) = solve(recording, [solver])
print(f"render_gn ends {1e3 * se3.translation_error_m(estimate.parent_T_camera, truth):.3f} mm off")
sigma_mm = 1e3 * np.sqrt(np.diag(estimate.covariance)[3:])
print(
    f"and reports standard deviations of {', '.join(f'{sigma:.4f}' for sigma in sigma_mm)} mm along x, y, z"
)
