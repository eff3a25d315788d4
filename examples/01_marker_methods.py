"""Every marker method on one recording, ranked by samples that it has not seen."""

from hecbench import registry
from hecbench.estimate import best_first
from hecbench.running.planning import solvers_for
from hecbench.running.solving import Options, solve
from hecbench.specs import Kind, SuiteSpec

suite = registry.load().get(Kind.SUITE, "markers", SuiteSpec)
recording = suite.make("board_2m", 0, 0)  # or hecbench.preparation.load_recording(Path("my_cell"))
estimates = solve(recording, solvers_for((), recording), Options(held_out=True))
for estimate in best_first(estimates):
    if estimate.parent_T_camera is None:
        print(f"{estimate.solver:20} {estimate.status}: {estimate.reason}")
    else:
        x, y, z = estimate.parent_T_camera[:3, 3]
        print(f"{estimate.solver:20} camera at {x:.4f} {y:.4f} {z:.4f} m, {estimate.seconds:.2f} s")
