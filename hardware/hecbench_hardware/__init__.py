"""Robots, grippers, cameras, the simulated controller and the virtual lab."""

from hecbench.registry import submodules

plugin_modules = (
    *submodules(__name__, "robots"),
    *submodules(__name__, "grippers"),
    *submodules(__name__, "cameras"),
)
"""Modules whose hooks belong to this package, imported one by one when plugins are listed."""
