"""A stranger's module that cannot be imported."""

raise RuntimeError("this plugin needs a licence dongle")
