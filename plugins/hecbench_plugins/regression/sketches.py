"""Postures and cameras without pictures: the dense layers learn what keypoints mean from thousands a second.

Postures and cameras are drawn by the rules of `perception.scene`, whole batches at once.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from hecbench_plugins.perception.family import Arm
from hecbench_plugins.perception.scene import (
    ALL_DEG,
    APART_M,
    DISTANCE_M,
    LOWEST_M,
    TAUGHT,
    TAUGHT_NOISE_RAD,
    USUAL,
    USUAL_DEG,
)
from hecbench_plugins.perception.skeleton import LINK_RADIUS_M
from hecbench_plugins.regression.kinematics import Kinematics
from hecbench_plugins.regression.losses import losses
from hecbench_plugins.regression.network import Dense
from hecbench_plugins.regression.plan import ASIDE, ROLL_RAD, SHARE
from hecbench_plugins.regression.reference import posture, reference_link

_BATCH, _RATE, _REPORT_STEPS = 384, 1e-3, 1000
_TRIED = 2
"""Postures drawn for each that is kept: many hit the floor or the arm itself."""
_SPREAD, _OF_PICTURE, _OF_KEYPOINT = 0.135, 0.4, 0.45
"""Median spread of a heatmap, a share of the side, and the deviations of its logarithm between pictures and within."""
_SPREADS = (0.03, 0.41)
"""The least and the largest, which an even heatmap has."""
_SHARP, _BLURRED, _BLURRED_FROM = 0.17, 0.34, 0.12
"""A keypoint's error over its spread, and how much it grows until the spread is `_BLURRED_FROM`. Measured, as the
spreads are, on 192 drawn pictures with the shipped perception network."""
_FREEDOM = 4
"""Of the t distribution of errors: some are large."""

Floats = NDArray[np.float64]


class Sketch(NamedTuple):
    """What `losses` compares, for B virtual cameras, and what the dense layers are given."""

    places: Tensor
    """(B, 3 K), as `network.places_of` has them."""
    postures: Tensor
    focal: Tensor
    crop_R_reference: Tensor
    crop_middle: Tensor
    reference_middle: Tensor


class Sketches:
    """Draws sketches of one arm."""

    def __init__(self, arm: Arm, rng: np.random.Generator) -> None:
        self.rng, self.link = rng, reference_link(arm.model)
        self.limits = np.clip(arm.model.limits(), -np.pi, np.pi)
        self.kinematics = Kinematics(arm.model, arm.keypoints)
        self.foot = len({k.link for k in arm.keypoints[:2]}) + 1

    def batch(self, count: int) -> Sketch:
        """About so many sketches."""
        joints, root_T_reference, points = self._postures(count)
        R, t = root_T_reference[:, :3, :3], root_T_reference[:, None, :3, 3]
        in_root = points @ R.swapaxes(1, 2) + t
        crop_R_root, eye, focal = self._cameras(in_root)
        seen = (in_root - eye[:, None]) @ crop_R_root.swapaxes(1, 2)
        arrays = (
            self._places(seen, focal),
            posture(joints),
            focal,
            crop_R_root @ R,
            seen.mean(1),
            points.mean(1),
        )
        return Sketch(*(torch.from_numpy(one).float() for one in arrays))

    def _postures(self, count: int) -> tuple[Floats, Floats, Floats]:
        """Joints (B, J), root_T_reference (B, 4, 4), and keypoints (B, K, 3) in the reference's frame."""
        rng, (low, high) = self.rng, self.limits.T
        joints = rng.uniform(low, high, (_TRIED * count, len(low)))
        right = np.round(joints / (np.pi / 2)) * np.pi / 2 + rng.normal(0, TAUGHT_NOISE_RAD, joints.shape)
        joints = np.where(rng.random((len(joints), 1)) < TAUGHT, np.clip(right, low, high), joints)
        poses, points = (one.numpy() for one in self.kinematics(torch.from_numpy(joints), self.link))
        first, second = np.triu_indices(points.shape[1], 3)
        apart = np.linalg.norm(points[:, first] - points[:, second], axis=2).min(1)
        lowest = (points @ poses[:, 2, :3, None])[:, self.foot :, 0].min(1) + poses[:, 2, 3]
        kept = np.flatnonzero((apart > APART_M) & (lowest > LOWEST_M))[:count]
        return joints[kept], poses[kept], points[kept]

    def _cameras(self, points: Floats) -> tuple[Floats, Floats, Floats]:
        """crop_R_root (B, 3, 3), eyes (B, 3) m and focal lengths (B,) of virtual cameras before points (B, K, 3)."""
        rng, n = self.rng, len(points)
        middle = points.mean(1)
        reach = np.linalg.norm(points - middle[:, None], axis=2).max(1)
        distance = reach + _even_logarithm(DISTANCE_M, n, rng)
        azimuth = rng.uniform(-np.pi, np.pi, n)
        usual = rng.random(n) < USUAL
        elevation = np.deg2rad(np.where(usual, rng.uniform(*USUAL_DEG, n), rng.uniform(*ALL_DEG, n)))
        level = np.cos(elevation) * np.array([np.cos(azimuth), np.sin(azimuth)])
        eye = middle + distance[:, None] * np.stack([*level, np.sin(elevation)], 1)
        share = _even_logarithm(SHARE, n, rng)
        aim = middle + rng.normal(0, ASIDE, (n, 3)) * (2 * reach / share)[:, None]
        forward = _unit(aim - eye)
        right = _unit(np.cross(forward, [0, 0, 1.0]))
        down = np.cross(forward, right)
        roll = rng.normal(0, ROLL_RAD + 0.17, n)[:, None]
        x, y = np.cos(roll) * right + np.sin(roll) * down, np.cos(roll) * down - np.sin(roll) * right
        R = np.stack([x, y, forward], 1)
        p = (points - eye[:, None]) @ R.swapaxes(1, 2)
        ends = LINK_RADIUS_M / p[..., 2:]
        flat = p[..., :2] / p[..., 2:]
        extent = ((flat + ends).max(1) - (flat - ends).min(1)).max(1)
        return R, eye, share / extent

    def _places(self, seen: Floats, focal: Floats) -> Floats:
        """(B, 3 K): where a network might find points (B, K, 3) m of the cameras' frames."""
        rng = self.rng
        true = seen[..., :2] / seen[..., 2:] * focal[:, None, None]
        n, count = true.shape[:2]
        level = _OF_PICTURE * rng.normal(size=(n, 1)) + _OF_KEYPOINT * rng.normal(size=(n, count))
        inside = np.abs(true).max(2) < 0.5
        spread = np.where(inside, np.clip(_SPREAD * np.exp(level), *_SPREADS), _SPREADS[1])
        deviation = spread * (_SHARP + _BLURRED * np.minimum(spread / _BLURRED_FROM, 1))
        place = true + deviation[..., None] * rng.standard_t(_FREEDOM, true.shape)
        place = np.where(inside[..., None], np.clip(place, -0.5, 0.5), rng.normal(0, 0.05, true.shape))
        return np.concatenate([place[..., 0], place[..., 1], spread], 1)


def fit_dense(dense: Dense, sketches: Sketches, steps: int, say: Callable[[str], None]) -> None:
    """Fit the dense layers to sketches, with a rate that falls to 0."""
    optimiser = torch.optim.AdamW(dense.parameters(), lr=_RATE, betas=(0.9, 0.99))
    schedule = torch.optim.lr_scheduler.OneCycleLR(optimiser, _RATE, total_steps=steps + 1)
    for step in range(1, steps + 1):
        sketch = sketches.batch(_BATCH)
        terms = losses(dense(sketch.places, sketch.postures), *sketch[2:])
        optimiser.zero_grad(set_to_none=True)
        terms.total().backward()  # type: ignore[no-untyped-call]
        torch.nn.utils.clip_grad_norm_(dense.parameters(), 5.0)
        optimiser.step()
        schedule.step()
        if step % _REPORT_STEPS == 0 or step == steps:
            values = ", ".join(f"{n} {v.item():.3f}" for n, v in zip(terms._fields, terms, strict=True))
            say(f"sketches, step {step} of {steps}: {values}")


def _even_logarithm(ends: tuple[float, float], count: int, rng: np.random.Generator) -> Floats:
    low, high = np.log(ends)
    return np.exp(rng.uniform(low, high, count))


def _unit(vector: Floats) -> Floats:
    return np.asarray(vector / np.linalg.norm(vector, axis=-1, keepdims=True))
