"""Robots, grippers, cameras, the simulated controller and the virtual lab."""

plugin_folders = ("robots", "grippers", "cameras")
"""Folders whose modules are plugins, imported one by one when plugins are listed."""
