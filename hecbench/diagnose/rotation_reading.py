"""Rotations that were read by another convention than they were written in, and mirrored pictures."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from functools import partial
from itertools import permutations

import numpy as np

from hecbench import se3
from hecbench.diagnose.calibrate import spread
from hecbench.diagnose.case import Examination
from hecbench.diagnose.finding import Finding, Severity
from hecbench.diagnose.fit import EXPLAINS, MUCH_BETTER
from hecbench.se3 import Array
from hecbench.system.wording import significant

ID = "rotation_convention"
MIRRORED_ID = "mirrored_images"
_ROUNDS = 5
_HALF_TURN = np.pi + 0.02
"""Longest rotation vector that a controller writes, rad, with its rounding."""
_EULER = {"xyz": "roll pitch yaw", "XYZ": "intrinsic XYZ", "zyx": "extrinsic ZYX", "ZYZ": "ZYZ", "ZXZ": "ZXZ"}
"""Orders of SciPy's `Rotation.from_euler` that controllers use."""


@dataclass(frozen=True, eq=False)
class Reading:
    """What was written, and the rotations (N, K, 3, 3) that it may stand for."""

    says: str
    candidates: Callable[[Array], Array]


def examine(case: Examination) -> tuple[Finding | None, Examination]:
    """Only when the poses as given have no common calibration: every other reading of their rotations."""
    if not case.can_be_fitted or (case.fit is not None and case.fit.relative < EXPLAINS):
        return None, case
    if (found := _mirrored(case)) is not None:
        return found
    as_given = np.inf if case.fit is None else case.fit.typical_px
    target = case.camera_T_target[:, :3, :3]
    for reading in _readings():
        poses = case.base_T_flange
        poses[:, :3, :3] = _chosen(reading.candidates(poses[:, :3, :3]), target)
        read = case.fit_of(poses, case.camera_T_target)
        if read is not None and read.cures(case.fit):
            summary = f"the rotations of base_T_flange were misread: {reading.says}: the typical sample then fits to "
            summary += f"{significant(read.typical_px)} px, as given to {significant(as_given, 3)} px"
            action = "read the robot's rotations so, and write base_T_flange anew"
            finding = Finding(ID, Severity.CRITICAL, summary, action, read.typical_px, MUCH_BETTER * as_given)
            kept = replace(case.recording.subset(case.usable), base_T_flange=poses, joints_rad=None)
            return finding, replace(case, recording=kept)
    return None, case


def _mirrored(case: Examination) -> tuple[Finding, Examination] | None:
    """Pictures flipped left to right, or upside down, which is the same but for half a turn of the camera."""
    recording = case.recording
    if recording.corners_px is None or recording.camera is None:
        return None
    corners = recording.corners_px * [-1.0, 1.0] + [recording.camera.width - 1.0, 0.0]
    flipped = replace(case, recording=replace(recording, corners_px=corners, camera_T_target=None))
    if flipped.fit is None or not flipped.fit.cures(case.fit):
        return None
    flipped_px = significant(flipped.fit.typical_px)
    summary = f"the images are mirrored: flipped back the typical sample fits to {flipped_px} px"
    action = (
        "turn off the camera driver's mirror (webcams show a mirror image), or flip the images left to right"
    )
    return Finding(MIRRORED_ID, Severity.CRITICAL, summary, action, flipped.fit.typical_px), flipped


def _readings() -> Iterator[Reading]:
    for order, name in _EULER.items():
        says = f"rotation vectors were read as Euler angles ({name})"
        yield Reading(says, partial(_vectors_read_as, order))
    for order, name in _EULER.items():
        yield Reading(
            f"Euler angles ({name}) were read as rotation vectors", partial(_angles_read_as_vectors, order)
        )
    yield Reading("quaternions w x y z were read as x y z w", partial(_reordered, [3, 0, 1, 2]))
    yield Reading("quaternions x y z w were read as w x y z", partial(_reordered, [1, 2, 3, 0]))
    yield Reading("the rotations are transposed", lambda rotations: np.swapaxes(rotations, 1, 2)[:, None])
    for read, written in permutations(_EULER, 2):
        says = f"Euler angles ({_EULER[written]}) were read as {_EULER[read]}"
        yield Reading(says, partial(_angles_read_as_angles, read, written))


def _vectors_read_as(order: str, rotations: Array) -> Array:
    return _vectors(_angles(rotations, order))


def _angles_read_as_vectors(order: str, rotations: Array) -> Array:
    return _from_euler(order, se3.so3_log(rotations)[:, None])


def _angles_read_as_angles(read: str, written: str, rotations: Array) -> Array:
    return _from_euler(written, _angles(rotations, read))


def _angles(rotations: Array, order: str) -> Array:
    """Both triples (N, 2, 3) rad of Euler angles of rotations (N, 3, 3)."""
    from scipy.spatial.transform import Rotation

    first = Rotation.from_matrix(rotations).as_euler(order)
    middle = -first[:, 1] if order[0] == order[2] else np.pi - first[:, 1]
    second = np.stack([first[:, 0] + np.pi, middle, first[:, 2] + np.pi], 1)
    both = np.stack([first, second], 1)
    return np.asarray((both + np.pi) % (2 * np.pi) - np.pi)


def _vectors(triples: Array) -> Array:
    """Rotations (N, 2, 3, 3) by rotation vectors; one too long for a controller stands for the other."""
    lengths = np.linalg.norm(triples, axis=2)
    usable = lengths <= np.maximum(_HALF_TURN, lengths.min(1, keepdims=True))
    triples = np.where(usable[..., None], triples, triples[:, ::-1])
    return np.asarray(se3.so3_exp(triples.reshape(-1, 3)).reshape(len(triples), -1, 3, 3))


def _from_euler(order: str, triples: Array) -> Array:
    from scipy.spatial.transform import Rotation

    matrices = np.asarray(Rotation.from_euler(order, triples.reshape(-1, 3)).as_matrix())
    return matrices.reshape(*triples.shape[:2], 3, 3)


def _reordered(order: list[int], rotations: Array) -> Array:
    from scipy.spatial.transform import Rotation

    quaternions = Rotation.from_matrix(rotations).as_quat()
    return np.asarray(Rotation.from_quat(quaternions[:, order]).as_matrix())[:, None]


def _chosen(candidates: Array, target: Array) -> Array:
    """Of K rotations of each sample (N, K, 3, 3) the one that turns as the target (N, 3, 3) does between samples."""
    chosen = candidates[:, 0]
    if candidates.shape[1] == 1:
        return chosen
    others = spread(len(target))
    turned = se3.rotation_angle(np.swapaxes(target, -1, -2)[:, None] @ target[others])
    for _ in range(_ROUNDS):
        between = np.swapaxes(candidates, -1, -2)[:, :, None] @ chosen[others]
        angles = se3.rotation_angle(between)
        gaps = np.abs(angles - turned[:, None])
        chosen = candidates[np.arange(len(candidates)), np.minimum(gaps, 0.2).sum(2).argmin(1)]
    return np.asarray(chosen)
