"""Calibration methods, evaluators and trained networks, one per file."""

plugin_folders = ("solvers", "observers", "evaluators", "segmenters", "translators", "networks")
"""Folders whose modules are plugins, imported one by one when plugins are listed."""
