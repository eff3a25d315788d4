"""The suites `maskless_real` and `maskless_lit`: photographs without masks, from many starts, of recordings on disk.

They read `ur3e_cam1` (a real UR3e) and `lit_ur5e_1_00` to `_05` (drawn by MuJoCo) from the folder that the environment
variable HECBENCH_RECORDINGS names, else from `../shared/data`. One item, in this order of draws from
``default_rng([seed, crc32(level), index])``: the views, without replacement; the start, whose camera centre is off by
exactly the level's distance in a random direction and whose rotation by exactly its angle about a random axis of the
camera. Masks are taken away. Item k of `maskless_lit` is of recording k mod 6.

The other levels must not be answered; whoever answers them right or wrong shows how far the answers can be trusted.
`hopeless`: 5 views from 0.6 m and 60 deg off. `wrong_robot`: the UR5e's model for pictures of a UR3e, and vice versa.
`wrong_joints`: every picture gets the joints of another. `two_cameras`: half of the views are of another camera, or the
pictures are turned upside down where there is no other.
"""

from __future__ import annotations

import os
import zlib
from collections.abc import Iterable
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from hecbench import se3
from hecbench.errors import InputError
from hecbench.recording import Recording
from hecbench.registry import hookimpl
from hecbench.specs import SuiteSpec
from hecbench.storage import recording_io

VARIABLE = "HECBENCH_RECORDINGS"
REAL, OTHER_CAMERA = "ur3e_cam1", "ur3e_cam3"
LIT = tuple(f"lit_ur5e_1_{k:02d}" for k in range(6))
STARTS = {"0.1m_10deg": (0.1, 10.0), "0.2m_20deg": (0.2, 20.0)}
VIEWS = {"maskless_real": (1, 2, 3, 5, 10, 40), "maskless_lit": (1, 2, 3, 5)}
TRAPS = ("hopeless", "wrong_robot", "wrong_joints", "two_cameras")
_TRAP_VIEWS, _TRAP_START, _HOPELESS = 5, (0.1, 10.0), (0.6, 60.0)
_OTHER_ROBOT = {"ur3e": "ur5e", "ur5e": "ur3e"}


def levels(suite: str) -> tuple[str, ...]:
    """Of one of the two suites: views and start, then the traps."""
    return (*(f"{views}_views_{start}" for start in STARTS for views in VIEWS[suite]), *TRAPS)


def folder() -> Path:
    """Where the recordings lie.

    Raises:
        InputError: nowhere.
    """
    found = Path(os.environ.get(VARIABLE, "../shared/data"))
    if not (found / REAL).is_dir() or not (found / LIT[0]).is_dir():
        raise InputError(f"{found}: holds no {REAL} and {LIT[0]}; set {VARIABLE} to the folder that does")
    return found


def make(suite: str, level: str, index: int, seed: int) -> Recording:
    """One item; see the module's docstring."""
    rng = np.random.default_rng([seed, zlib.crc32(level.encode()), index])
    name = REAL if suite == "maskless_real" else LIT[index % len(LIT)]
    whole = recording_io.load(folder() / name)
    views, _, start = level.partition("_views_")
    count = _TRAP_VIEWS if level in TRAPS else int(views)
    rows = np.sort(rng.permutation(len(whole))[:count])
    distance_m, turn_deg = _HOPELESS if level == "hopeless" else STARTS.get(start, _TRAP_START)
    recording = replace(
        whole.subset(rows),
        name=f"{name}_{level}_{index:03d}",
        masks=None,
        initial_parent_T_camera=_off(whole, distance_m, turn_deg, rng),
    )
    return _trapped(recording, level, rows)


def _off(
    recording: Recording, distance_m: float, turn_deg: float, rng: np.random.Generator
) -> NDArray[np.float64]:
    truth = recording.present.truth_parent_T_camera
    shift, axis = rng.normal(size=(2, 3))
    turn = np.deg2rad(turn_deg) * axis / np.linalg.norm(axis)
    moved = truth[:3, 3] + distance_m * shift / np.linalg.norm(shift)
    return se3.make(truth[:3, :3] @ se3.so3_exp(turn), moved)


def _trapped(recording: Recording, level: str, rows: NDArray[np.int64]) -> Recording:
    present = recording.present
    robot, joints, images = present.robot, present.joints_rad, present.images
    if level == "wrong_robot":
        return replace(
            recording, robot=replace(robot, model=_OTHER_ROBOT[str(robot.model)]), base_T_flange=None
        )
    if level == "wrong_joints":
        return replace(recording, joints_rad=np.roll(joints, 1, 0), base_T_flange=None)
    if level == "two_cameras":
        half = len(recording) // 2
        if recording.folder is not None and recording.folder.name == REAL:
            other = recording_io.load(recording.folder.parent / OTHER_CAMERA).present.images
            strangers = tuple(other[row] for row in rows[:half])
        else:
            strangers = tuple(np.ascontiguousarray(recording.image(i)[::-1, ::-1]) for i in range(half))
        return replace(recording, images=(*strangers, *images[half:]))
    return recording


@hookimpl
def hecbench_suites() -> Iterable[SuiteSpec]:
    """This file's suites."""
    for name, summary in (
        (
            "maskless_real",
            "photographs of a real UR3e without masks, 1 to 40 views, starts decimetres off, and traps",
        ),
        ("maskless_lit", "the same of a UR5e drawn by another renderer with lights, shadows and clutter"),
    ):
        yield SuiteSpec(
            name=name,
            summary=summary,
            levels=levels(name),
            default_samples=20,
            make=partial(make, name),
            solvers=lambda level: (
                ("render_gn", "render_gn[unknown=joints]") if "views" in level else ("render_gn",)
            ),
        )
