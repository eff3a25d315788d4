"""The checks that every solver of marker recordings passes: each is a law that holds for any correct method.

A check of a solver on exact data passes when the answer is right or the solver refuses; refusing too often
fails.
"""

from __future__ import annotations

import random
from collections.abc import Callable, Iterator
from dataclasses import replace
from itertools import product
from pathlib import Path

import numpy as np

from hecbench import se3
from hecbench.errors import Refusal, SolverFailure
from hecbench.estimate import Estimate
from hecbench.recording import CameraModel, Mounting, Recording
from hecbench.se3 import Array
from hecbench.specs import Need, Solver
from hecbench.targets import ChessboardTarget

TOLERANCE = 1e-6
"""Metres and radians on exact data."""
NOISY_TOLERANCE = 1e-7
"""Metres and radians between two runs that must give the same answer on noisy data."""

_RIGS = 5
_TARGET = ChessboardTarget(6, 5, 0.03)
_K = np.array([[1200.0, 0, 639.5], [0, 1200.0, 479.5], [0, 0, 1]])
_CAMERA = CameraModel(1280, 960, _K)
SUPPORTED = frozenset({Need.TARGET_POSES, Need.CORNERS, Need.INTRINSICS, Need.INITIAL})


def rig(
    rng: np.random.Generator,
    mounting: Mounting,
    *,
    noise: float = 0.0,
    rotations: Array | None = None,
) -> Recording:
    """A random rig whose camera sees the target, with poses, corners and a start 5 cm and 3 deg off.

    Args:
        rng: source of every draw.
        mounting: of the camera.
        noise: standard deviation of a left perturbation of camera_T_target, m and rad; corners follow it.
        rotations: (N, 3) rotation vectors, rad, of the target in the camera; None: 12, up to 0.6 rad per
            axis.
    """
    parent_T_camera = se3.from_rotvec(rng.uniform(-2, 2, 3), rng.uniform(-1, 1, 3))
    carrier_T_target = se3.from_rotvec(rng.uniform(-2, 2, 3), rng.uniform(-0.2, 0.2, 3))
    if rotations is None:
        rotations = rng.uniform(-0.6, 0.6, (12, 3))
    samples = len(rotations)
    positions = rng.uniform([-0.15, -0.1, 0.8], [0.15, 0.1, 1.3], (samples, 3))
    camera_T_target = se3.from_rotvec(rotations, positions)
    hand = parent_T_camera @ camera_T_target @ se3.inverse(carrier_T_target)
    camera_T_target = se3.exp(rng.normal(0, noise, (samples, 6))) @ camera_T_target
    points = se3.transform_points(camera_T_target, _TARGET.points_m) @ _K.T
    start = se3.exp(rng.normal(0, [0.03] * 6)) @ parent_T_camera
    return Recording(
        name="rig",
        mounting=mounting,
        sample_ids=tuple(f"{i:06d}" for i in range(samples)),
        camera=_CAMERA,
        target=_TARGET,
        initial_parent_T_camera=start,
        truth_parent_T_camera=parent_T_camera,
        base_T_flange=hand if mounting is Mounting.EYE_TO_HAND else se3.inverse(hand),
        camera_T_target=camera_T_target,
        corners_px=points[..., :2] / points[..., 2:],
    )


def answer(solver: Solver, recording: Recording) -> Estimate | str:
    """The estimate, or why there is none."""
    try:
        return solver(recording.without_truth(), rng=np.random.default_rng(0))
    except (Refusal, SolverFailure) as error:
        return str(error)


def difference(first: Array | None, second: Array | None) -> float:
    """The larger of the distances of two poses (4, 4) in m and in rad."""
    assert first is not None
    assert second is not None
    return max(float(se3.translation_error_m(first, second)), float(se3.rotation_error_rad(first, second)))


def _exact(mounting: Mounting) -> Callable[[Solver], Iterator[str]]:
    def check(solver: Solver) -> Iterator[str]:
        for seed in range(_RIGS):
            recording = rig(np.random.default_rng(seed), mounting)
            found = answer(solver, recording)
            if isinstance(found, str):
                yield f"exact data of rig {seed} is refused: {found}"
                continue
            error = difference(found.parent_T_camera, recording.truth_parent_T_camera)
            if not error <= TOLERANCE:
                yield f"exact data of rig {seed}: off by {error:.3g} m or rad, allowed is {TOLERANCE:g}"

    return check


def _same_on(
    change: Callable[[Recording], Recording],
    undo: Callable[[Array], Array],
    *,
    noise: float,
    tolerance: float,
) -> Callable[[Solver], Iterator[str]]:
    """The answer on the changed recording, undone, equals the answer on the original one."""

    def check(solver: Solver) -> Iterator[str]:
        for seed in range(_RIGS):
            for mounting in Mounting:
                recording = rig(np.random.default_rng(seed), mounting, noise=noise)
                before, after = answer(solver, recording), answer(solver, change(recording))
                if isinstance(before, str) or isinstance(after, str):
                    if type(before) is not type(after):
                        reason = before if isinstance(before, str) else after
                        yield f"{mounting}, rig {seed}: answered once, refused once: {reason}"
                    continue
                error = difference(undo(after.pose), before.parent_T_camera)
                if not error <= tolerance:
                    yield f"{mounting}, rig {seed}: the answers differ by {error:.3g} m or rad"

    return check


def _reversed(recording: Recording) -> Recording:
    return recording.subset(np.arange(len(recording))[::-1])


_MOVE = se3.from_rotvec([0.3, -0.5, 0.7], [0.4, -0.2, 0.6])


def _moved_parent(recording: Recording) -> Recording:
    """The same rig described in another parent frame."""
    base_T_flange = recording.present.base_T_flange
    eye_to_hand = recording.mounting is Mounting.EYE_TO_HAND
    start = recording.initial_parent_T_camera
    return replace(
        recording,
        base_T_flange=_MOVE @ base_T_flange if eye_to_hand else base_T_flange @ se3.inverse(_MOVE),
        initial_parent_T_camera=None if start is None else _MOVE @ start,
        truth_parent_T_camera=None,
    )


def _other_truth_ids_and_paths(recording: Recording) -> Recording:
    return replace(
        recording,
        name="another name",
        sample_ids=tuple(f"other {i}" for i in range(len(recording))),
        truth_parent_T_camera=np.eye(4),
        folder=Path("elsewhere"),
    )


def _moved_other(recording: Recording) -> Recording:
    """The same rig with the frame between hand and target described differently; X stays."""
    base_T_flange = recording.present.base_T_flange
    eye_to_hand = recording.mounting is Mounting.EYE_TO_HAND
    return replace(recording, base_T_flange=base_T_flange @ _MOVE if eye_to_hand else _MOVE @ base_T_flange)


def _degenerate_is_refused(solver: Solver) -> Iterator[str]:
    """Too few samples, no rotation, and rotation about one axis leave X undetermined."""
    axis = np.array([2.0, -1.0, 2.0]) / 3.0
    turns = np.random.default_rng(1).uniform(-0.8, 0.8, (12, 1))
    cases: dict[str, Array] = {
        "two samples": np.array([[0.3, 0.0, 0.0], [0.0, 0.4, 0.0]]),
        "pure translation": np.tile([0.2, 0.1, 0.3], (12, 1)),
        "one rotation axis": turns * axis,
        "one rotation axis, half turns": np.repeat([0.0, np.pi], 6)[:, None] * axis,
    }
    for (name, rotations), mounting, noise in product(cases.items(), Mounting, (0.0, 1e-3)):
        found = answer(solver, rig(np.random.default_rng(2), mounting, noise=noise, rotations=rotations))
        if not isinstance(found, str):
            yield f"{name}, {mounting}, noise {noise:g}: answered instead of refused"


def _leaves_the_world_alone(solver: Solver) -> Iterator[str]:
    recording = rig(np.random.default_rng(3), Mounting.EYE_TO_HAND, noise=1e-3)
    digest, states = recording.without_truth().sha256, global_states()
    blind = recording.without_truth()
    for _ in range(2):
        solver(blind, rng=np.random.default_rng(0))
    if global_states() != states:
        yield "a global random generator was used; use the one that is passed"
    if replace(blind).sha256 != digest:
        yield "the recording was changed; copy an array before writing to it"


def global_states() -> tuple[object, str]:
    """States of the global random generators, which a plugin must not use."""
    return random.getstate(), repr(np.random.get_state())  # noqa: NPY002 - checked, not used


def _identity(parent_T_camera: Array) -> Array:
    return parent_T_camera


def _undo_move(parent_T_camera: Array) -> Array:
    return np.asarray(se3.inverse(_MOVE) @ parent_T_camera)


CHECKS: dict[str, Callable[[Solver], Iterator[str]]] = {
    "exact, eye_to_hand": _exact(Mounting.EYE_TO_HAND),
    "exact, eye_in_hand": _exact(Mounting.EYE_IN_HAND),
    "order of samples": _same_on(_reversed, _identity, noise=1e-3, tolerance=NOISY_TOLERANCE),
    "frame of the parent": _same_on(_moved_parent, _undo_move, noise=0.0, tolerance=TOLERANCE),
    "frame of the target's carrier": _same_on(_moved_other, _identity, noise=0.0, tolerance=TOLERANCE),
    "truth, ids and paths": _same_on(_other_truth_ids_and_paths, _identity, noise=1e-3, tolerance=0.0),
    "degenerate data": _degenerate_is_refused,
    "no side effects": _leaves_the_world_alone,
}
