"""Calibration methods and rulers, one per file."""

from hecbench.registry import submodules

plugin_modules = (
    *submodules(__name__, "solvers"),
    *submodules(__name__, "observers"),
    *submodules(__name__, "evaluators"),
    *submodules(__name__, "segmenters"),
    *submodules(__name__, "translators"),
)
"""Modules whose hooks belong to this package, imported one by one when plugins are listed."""
