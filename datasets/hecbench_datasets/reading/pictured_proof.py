"""A convention proven by the target that pictures show."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np

from hecbench import preparation, se3
from hecbench.errors import InputError
from hecbench.exchange.conventions import HINTS_NAME, Proof, prove
from hecbench.exchange.pose_numbers import PoseConvention
from hecbench.recording import Mounting, Recording
from hecbench.se3 import Array
from hecbench_datasets.reading.hints import Hints
from hecbench_datasets.reading.joint_poses import RobotReading

_MOST_LOOKED_AT = 3
"""Readings under which the pictures are searched again."""


def settled(
    path: Path, recording: Recording, ways: Sequence[RobotReading], hints: Hints, as_given: bool
) -> Recording:
    """The recording of pictures with the robot poses and the mounting that are proven, or given.

    Args:
        path: names the data in notes and errors.
        recording: with images, a target, and placeholders for the robot's poses.
        ways: every reading of these.
        hints: of the user.
        as_given: the first way and the mounting of the hints are believed without a proof.
    """
    if as_given:
        way, mounting = ways[0], recording.mounting
        note = f"{path}: read as {mounting}, {way.flange.text}, as given"
    else:
        proof = _proven(path, ways, recording, hints)
        way = next(way for way in ways if way.flange.text == proof.robot_text)
        mounting, note = proof.mounting, proof.note
    return replace(
        recording,
        mounting=mounting,
        robot=way.robot,
        base_T_flange=way.base_T_flange,
        joints_rad=way.joints_rad,
        notes=(*recording.notes, note),
    )


def _proven(path: Path, ways: Sequence[RobotReading], recording: Recording, hints: Hints) -> Proof:
    """The reading that holds the target still in the pictures that show it.

    A board that looks the same from two ends is turned as the robot's motion demands, so the pictures are looked at
    again under the readings that the angles allow.
    """
    seen = preparation.prepare(recording)
    try:
        return _held_still(path, ways, seen, hints)
    except InputError as as_first_seen:
        if seen.camera_T_target is None:
            raise
        for way in _by_angles(ways, seen.camera_T_target)[:_MOST_LOOKED_AT]:
            turned = preparation.prepare(replace(recording, base_T_flange=way.flange.poses))
            try:
                return _held_still(path, ways, turned, hints)
            except InputError:
                continue
        raise as_first_seen


def _held_still(path: Path, ways: Sequence[RobotReading], seen: Recording, hints: Hints) -> Proof:
    if seen.camera_T_target is None:
        raise InputError(
            f"{path}: {'; '.join(seen.notes) or 'the target is not seen'}; correct target in {HINTS_NAME}"
        )
    shown = np.asarray(np.isfinite(seen.camera_T_target).all((1, 2)))
    robot = [way.at(shown).flange for way in ways]
    target = [PoseConvention(seen.camera_T_target[shown], "camera_T_target seen")]
    mountings = [hints.mounting] if hints.mounting else list(Mounting)
    proof = prove(str(path), robot, target, mountings, hints.mounting is not None)
    return replace(proof, note=f"{proof.note} (target seen in {shown.sum()} of {len(shown)} pictures)")


def _by_angles(ways: Sequence[RobotReading], camera_T_target: Array) -> list[RobotReading]:
    """One reading of each set of angles, those first that the target turns by, whichever end it is read from."""
    shown = np.flatnonzero(np.isfinite(camera_T_target).all((1, 2)))
    before, after = shown[:-1], shown[1:]
    quarters = se3.so3_exp(np.outer(np.arange(4) * np.pi / 2, [0, 0, 1]))
    relative = np.swapaxes(camera_T_target[before, :3, :3], 1, 2) @ camera_T_target[after, :3, :3]
    seen = se3.rotation_angle(relative[:, None] @ quarters)
    angles = [se3.rotation_error_rad(way.flange.poses[before], way.flange.poses[after]) for way in ways]
    gaps = [float(np.abs(seen - turned[:, None]).min(1).mean()) for turned in angles]
    kept: list[int] = []
    for i in np.argsort(gaps, kind="stable"):
        if not any(np.allclose(angles[i], angles[k], atol=1e-6) for k in kept):
            kept.append(int(i))
    return [ways[i] for i in kept]
