"""Calibration methods and evaluators, one per file."""

plugin_folders = ("solvers", "observers", "evaluators", "segmenters", "translators")
"""Folders whose modules are plugins, imported one by one when plugins are listed."""
