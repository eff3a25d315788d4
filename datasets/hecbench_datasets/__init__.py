"""Recordings: one file per format or generator."""

plugin_folders = (".",)
"""Folders whose modules are plugins, imported one by one when plugins are listed."""
