"""Recordings: one file per format or generator."""

from hecbench.registry import submodules

plugin_modules = submodules(__name__)
"""Modules whose hooks belong to this package, imported one by one when plugins are listed."""
