"""The hooks a plugin may implement; the docstring of each holds a whole plugin that works.

All but the last yield specs of `hecbench.specs`. Importing a plugin stays cheap: its factory imports what is heavy.
"""

from hecbench.hookspecs.calibration import (
    hecbench_datasets,
    hecbench_observers,
    hecbench_solvers,
    hecbench_suites,
)
from hecbench.hookspecs.devices import (
    hecbench_cameras,
    hecbench_grippers,
    hecbench_robots,
    hecbench_trial_finished,
)
from hecbench.hookspecs.marker import GROUP
from hecbench.hookspecs.pictures import hecbench_perception, hecbench_segmenters, hecbench_translators
from hecbench.hookspecs.results import hecbench_evaluators, hecbench_exporters

__all__ = [
    "GROUP",
    "hecbench_cameras",
    "hecbench_datasets",
    "hecbench_evaluators",
    "hecbench_exporters",
    "hecbench_grippers",
    "hecbench_observers",
    "hecbench_perception",
    "hecbench_robots",
    "hecbench_segmenters",
    "hecbench_solvers",
    "hecbench_suites",
    "hecbench_translators",
    "hecbench_trial_finished",
]
