"""CtRNet's example pictures: one image, its joints and intrinsics in a README line, the network's estimate.

A line reads ``baxter.png 2048x1536: left arm q=[...] ...; fx .. fy .. cx .. cy ..; ... [row][row][row]`` with
the rows of camera_T_base, which becomes the start.
"""

from __future__ import annotations

import re
from collections.abc import Iterable
from pathlib import Path

import numpy as np

from hecbench import se3
from hecbench.errors import InputError
from hecbench.recording import CameraModel, Mounting, Recording, RobotDescription
from hecbench.registry import hookimpl
from hecbench.se3 import Array
from hecbench.specs import DatasetSpec
from hecbench_datasets.reading.sources import finite, foreign, head, text

_LINE = re.compile(
    r"^(?P<image>\S+\.(?:png|jpg)) (?P<width>\d+)x(?P<height>\d+):"
    r".*?q=\[(?P<joints>[^\]]*)\](?P<names>[^;]*);"
    r" fx (?P<fx>\S+) fy (?P<fy>\S+) cx (?P<cx>\S+) cy (?P<cy>[\d.]+);(?P<rest>.*)$",
    re.MULTILINE,
)


def sniff(path: Path) -> bool:
    """A folder whose README has such a line for a picture that is there."""
    return any((path / match["image"]).is_file() for match in _LINE.finditer(head(path / "README.md", 20000)))


@foreign
def load(path: Path) -> Recording:
    """Read the first picture that is there."""
    readme = path / "README.md"
    for match in _LINE.finditer(text(readme)):
        if (path / match["image"]).is_file():
            return _recording(path, readme, match)
    raise InputError(f"{readme}: describes no picture that is in the folder")


def _recording(path: Path, readme: Path, match: re.Match[str]) -> Recording:
    fx, fy, cx, cy = finite([match[name] for name in ("fx", "fy", "cx", "cy")], f"{readme}: fx fy cx cy")
    joints = finite(match["joints"].split(","), f"{readme}: q")
    names = re.search(r"\(((?:\w+ ?)+)\)", match["names"])
    named = tuple(f"left_{name}" for name in names[1].split()) if names else ()
    return Recording(
        name=path.resolve().name,
        mounting=Mounting.EYE_TO_HAND,
        sample_ids=(Path(match["image"]).stem,),
        robot=RobotDescription(
            base_link="left_arm_mount" if named else "panda_link0",
            flange_link="left_gripper_base" if named else "panda_hand",
            joint_names=named if len(named) == len(joints) else (),
        ),
        camera=CameraModel(
            int(match["width"]), int(match["height"]), np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1.0]])
        ),
        joints_rad=joints[None],
        initial_parent_T_camera=_start(match["rest"], readme),
        images=(path / match["image"],),
        folder=path,
    )


def _start(rest: str, readme: Path) -> Array | None:
    rows = [row.split() for row in re.findall(r"\[([^\]]*)\]", rest)]
    if len(rows) != 3:
        return None
    camera_T_base = finite(rows, f"{readme}: estimate", (3, 4))
    return se3.inverse(se3.make(se3.nearest_rotation(camera_T_base[:, :3]), camera_T_base[:, 3]))


@hookimpl
def hecbench_datasets() -> Iterable[DatasetSpec]:
    """This file's format."""
    yield DatasetSpec(
        name="ctrnet",
        summary="CtRNet example picture of a Baxter or Panda with joints and intrinsics in its README",
        sniff=sniff,
        load=load,
    )
