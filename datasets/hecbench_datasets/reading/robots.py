"""Robot models for recordings whose format names none."""

from __future__ import annotations

from pathlib import Path

NO_START = "{}: holds no start; methods that need one get it by --init FILE"


def urdf_beside(folder: Path, robot: str) -> tuple[Path | None, tuple[str, ...]]:
    """The only URDF in a folder or one below it, and what to tell the user."""
    found = sorted({*folder.glob("*.urdf"), *folder.glob("*/*.urdf")})
    if len(found) == 1:
        return found[0], (f"{found[0]}: taken as the model of {robot}",)
    cure = f"give one of {robot} to `hecbench import SRC DEST --urdf FILE`, or put it with its meshes into {folder}"
    reason = f"holds {len(found)} URDF files" if found else "names no robot model"
    return None, (f"{folder}: {reason}; methods that draw the robot need one: {cure}",)
