"""Recordings: other people's formats, and generated ones."""

plugin_folders = ("formats", "suites")
"""Folders whose modules are plugins, imported one by one when plugins are listed."""
