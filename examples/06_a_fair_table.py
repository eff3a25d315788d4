"""Two methods on thirty recordings, with medians, intervals and a paired test."""

import tempfile
from pathlib import Path

import numpy as np

from hecbench import statistics
from hecbench.running import planning, runner
from hecbench.running.solving import Options

tasks = planning.suite_tasks("markers", ("small_tag_2m",), 30, ("tsai", "single3d_iterative"), seed=0)
out = Path(tempfile.mkdtemp()) / "fair"
contents = runner.run(tasks, Options(), out=out, jobs=1)
errors_mm = {
    name: np.array(
        [e.errors["tre_mm"] if e.errors else np.inf for e in contents.estimates if e.solver == name]
    )
    for name in ("tsai", "single3d_iterative")
}
for name, values in errors_mm.items():
    answered = np.isfinite(values)
    print(
        f"{name:20} median {np.median(values):.1f} mm, mean {values[answered].mean():.1f} mm, {answered.sum()} of 30"
    )
p = statistics.paired_error_p(errors_mm["tsai"], errors_mm["single3d_iterative"])
print(f"paired test: p = {p:.2g}; for the whole page: hecbench report {out}")
