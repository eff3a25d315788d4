"""The checks that every solver passes that looks at the robot itself.

An answer on exact pictures must lie near the truth, or there must be none; refusing all of them fails.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import numpy as np

from hecbench import se3
from hecbench.conformance.photographs import photographs
from hecbench.conformance.solvers import answer, difference, global_states
from hecbench.recording import Recording
from hecbench.specs import Solver

TOLERANCE_M, TOLERANCE_RAD = 0.03, np.deg2rad(2)
"""What counts as right on four pictures of 320 x 240 px from a start 3 cm and 3 deg off."""
SAME = 1e-3
"""Metres and radians between two runs that see the same in another order."""


def right(solver: Solver) -> Iterator[str]:
    """Exact pictures and masks give the truth."""
    recording = photographs()
    found = answer(solver, recording)
    if isinstance(found, str):
        yield f"four exact pictures with masks and a near start are refused: {found}"
        return
    truth = recording.present.truth_parent_T_camera
    off_m = float(se3.translation_error_m(found.pose, truth))
    off_rad = float(se3.rotation_error_rad(found.pose, truth))
    if off_m > TOLERANCE_M or off_rad > TOLERANCE_RAD:
        yield f"exact pictures: off by {1e3 * off_m:.0f} mm and {np.rad2deg(off_rad):.1f} deg"


def order(solver: Solver) -> Iterator[str]:
    """The order of the samples does not matter."""
    recording = photographs()
    yield from _same(solver, recording, recording.subset(np.arange(len(recording))[::-1]), SAME)


def blind(solver: Solver) -> Iterator[str]:
    """Truth, ids and paths do not reach the answer."""
    recording = photographs()
    renamed = replace(
        recording,
        name="another name",
        sample_ids=tuple(f"other {i}" for i in range(len(recording))),
        truth_parent_T_camera=np.eye(4),
        folder=Path("elsewhere"),
    )
    yield from _same(solver, recording, renamed, 0.0)


def refuses_an_empty_scene(solver: Solver) -> Iterator[str]:
    """Pictures without a robot give no answer."""
    recording = photographs()
    wall = np.full_like(np.asarray(recording.image(0)), 128)
    nothing = np.zeros(wall.shape[:2], np.uint8)
    far = np.full(wall.shape[:2], 3000, np.uint16)
    views = len(recording)
    empty = replace(recording, images=(wall,) * views, masks=(nothing,) * views, depths=(far,) * views)
    if not isinstance(answer(solver, empty), str):
        yield "pictures without a robot are answered instead of refused"


def no_side_effects(solver: Solver) -> Iterator[str]:
    """The recording and the global random generators stay as they were."""
    seen = photographs().without_truth()
    digest, states = seen.sha256, global_states()
    answer(solver, seen)
    if global_states() != states:
        yield "a global random generator was used; use the one that is passed"
    if replace(seen).sha256 != digest:
        yield "the recording was changed; copy an array before writing to it"


def _same(solver: Solver, recording: Recording, changed: Recording, tolerance: float) -> Iterator[str]:
    first, second = answer(solver, recording), answer(solver, changed)
    if isinstance(first, str) or isinstance(second, str):
        if type(first) is not type(second):
            yield f"answered once, refused once: {first if isinstance(first, str) else second}"
        return
    off = difference(first.parent_T_camera, second.parent_T_camera)
    if not off <= tolerance:
        yield f"the answers differ by {off:.3g} m or rad"


CHECKS = {
    "exact pictures": right,
    "order of samples": order,
    "truth, ids and paths": blind,
    "no robot in the pictures": refuses_an_empty_scene,
    "no side effects": no_side_effects,
}
