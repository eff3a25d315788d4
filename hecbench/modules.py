"""Names of the modules in a package, found without importing them."""

from __future__ import annotations

import pkgutil
from importlib import import_module


def submodules(package_name: str, folder: str = "") -> tuple[str, ...]:
    """Full names of the modules in a package (or in its sub-package `folder`); only the package is imported."""
    package = import_module(f"{package_name}.{folder}" if folder else package_name)
    found = pkgutil.iter_modules(package.__path__, prefix=f"{package.__name__}.")
    return tuple(module.name for module in found if not module.ispkg)
