"""Robots by name: known arms, those of the entry-point group `hecbench.robots`, and URDFs of installed packages."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cache
from importlib import metadata, util
from pathlib import Path, PurePosixPath
from typing import Any

from hecbench.errors import InputError

GROUP = "hecbench.robots"
"""Entry points whose name is the robot's and whose object is its URDF's path, or a function that returns it."""
_MOST_SHOWN = 5


@dataclass(frozen=True)
class InstalledRobot:
    """A URDF that an installed distribution brings, or the reason why its entry point gives none."""

    name: str
    distribution: str
    version: str
    path: Path | None
    detail: str

    def row(self) -> dict[str, Any]:
        """As `hecbench plugins --json` prints a plugin."""
        return {
            "name": self.name,
            "kind": "robot",
            "status": "broken" if self.path is None else "ready",
            "needs": [],
            "detail": self.detail,
            "distribution": self.distribution,
            "version": self.version,
        }


def of_entry_points() -> Iterator[InstalledRobot]:
    """The robots that packages declare; one that cannot be loaded is listed with its reason."""
    for entry in metadata.entry_points(group=GROUP):
        owner = entry.dist
        about = (entry.name, owner.metadata["Name"] if owner else "?", owner.version if owner else "")
        try:
            found = entry.load()
            path = Path(found() if callable(found) else found)
        except Exception as error:  # a stranger's code
            reason = (str(error) or type(error).__name__).splitlines()[0]
            yield InstalledRobot(*about, None, f"{entry.value}: {reason}")
            continue
        yield InstalledRobot(*about, path if path.is_file() else None, str(path))


@cache
def of_distributions() -> tuple[InstalledRobot, ...]:
    """Every URDF that an installed distribution lists; its name is the file's without suffix."""
    found = []
    for distribution in metadata.distributions():
        owner = distribution.metadata["Name"]
        for file in distribution.files or ():
            if file.suffix == ".urdf":
                path = Path(str(distribution.locate_file(file)))
                found.append(InstalledRobot(file.stem, owner, distribution.version, path, f"{owner}:{file}"))
    return tuple(sorted(found, key=lambda robot: (robot.name, robot.detail)))


def find(name: str) -> Path | None:
    """The URDF of a name: an entry point's, PACKAGE:PATH, or the one URDF of that name in an installed package.

    Raises:
        InputError: the entry point is broken, the package is not installed or has no such file, or several
            packages have a URDF of that name.
    """
    package, colon, inside = name.partition(":")
    if colon:
        return _in_package(package, inside)
    for robot in of_entry_points():
        if robot.name == name:
            if robot.path is None:
                raise InputError(f"robot '{name}' of {robot.distribution} is broken: {robot.detail}")
            return robot.path
    there = [
        robot for robot in of_distributions() if robot.name == name and robot.path and robot.path.is_file()
    ]
    if len({robot.path for robot in there}) > 1:
        raise InputError(f"robot '{name}' is there more than once: {_shown(there)}: choose one of these")
    return there[0].path if there else None


def _in_package(package: str, inside: str) -> Path:
    """The URDF at a path, or at the one path that ends so, of an import package or a distribution."""
    try:
        spec = util.find_spec(package) if package.isidentifier() else None
    except (ImportError, ValueError):
        spec = None
    for folder in (spec.submodule_search_locations or ()) if spec else ():
        if (path := Path(folder) / inside).is_file():
            return path
    of_package = [robot for robot in of_distributions() if _same(robot.distribution, package)]
    tail = PurePosixPath(inside).parts
    there = [robot for robot in of_package if robot.path and robot.path.parts[-len(tail) :] == tail]
    if len(there) == 1 and there[0].path is not None:
        return there[0].path
    if spec is None and not of_package and not _is_installed(package):
        raise InputError(
            f"robot '{package}:{inside}': the package {package} is not installed: pip install {package}"
        )
    choices = _shown(there or of_package)
    raise InputError(
        f"robot '{package}:{inside}': {'several files end so' if there else 'there is no such file'}"
        + (f"; choose among {choices}" if choices else f": {package} holds no URDF")
    )


def _is_installed(package: str) -> bool:
    try:
        metadata.distribution(package)
    except (metadata.PackageNotFoundError, ValueError):
        return False
    return True


def _same(one: str, other: str) -> bool:
    return one.lower().replace("_", "-") == other.lower().replace("_", "-")


def _shown(robots: list[InstalledRobot]) -> str:
    names = [robot.detail for robot in robots]
    more = f", and {len(names) - _MOST_SHOWN} more" if len(names) > _MOST_SHOWN else ""
    return ", ".join(names[:_MOST_SHOWN]) + more
