"""The newest drawn pictures, and batches of what virtual cameras see of them."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
import torch
from numpy.typing import NDArray
from torch import Tensor

from hecbench.lens import CameraModel
from hecbench_plugins.perception.family import Family
from hecbench_plugins.perception.pictures import Example, PictureMaker, Truth
from hecbench_plugins.regression.kinematics import Kinematics
from hecbench_plugins.regression.plan import ASIDE, CROP_PX, ROLL_RAD, SHARE, Plan
from hecbench_plugins.regression.reference import posture, reference_link
from hecbench_plugins.regression.virtual_camera import VirtualCamera


class Batch(NamedTuple):
    """What `losses` compares, for B virtual cameras."""

    pictures: Tensor
    """(B, 3, S, S) RGB in [0, 1]."""
    postures: Tensor
    focal: Tensor
    crop_R_reference: Tensor
    crop_middle: Tensor
    reference_middle: Tensor


class Shots:
    """A ring of drawn pictures. Picture i depends on the seed and i alone, so that it can be drawn again."""

    def __init__(self, plan: Plan, family: Family) -> None:
        self.plan, self.arm = plan, family.arms[0]
        self.maker = PictureMaker(family, plan.size, plan.seed, plan.backgrounds, empty=0.0)
        self.kinematics = Kinematics(self.arm.model, self.arm.keypoints)
        self.link = reference_link(self.arm.model)
        self.ring: dict[int, tuple[NDArray[np.uint8], Truth]] = {}
        self.drawn = 0

    def draw_until(self, count: int) -> None:
        """Draw the pictures before number `count`, those that are still kept."""
        self.drawn = max(self.drawn, count - self.plan.capacity)
        while self.drawn < count:
            example = self._example(self.drawn)
            assert example.truth is not None
            self.ring[self.drawn % self.plan.capacity] = example.image, example.truth
            self.drawn += 1

    def _example(self, number: int) -> Example:
        self.maker.restart((self.plan.seed, 1, number))
        return self.maker.example()

    def batch(self, rng: np.random.Generator) -> Batch:
        """The newest pictures and others at random, each by a virtual camera of its own."""
        count = min(self.plan.batch, len(self.ring))
        newest = min(self.plan.pictures_per_step, count)
        last = (self.drawn - 1 - np.arange(newest)) % self.plan.capacity
        chosen = [self.ring[i] for i in (*last, *rng.integers(0, len(self.ring), count - newest))]
        joints = np.stack([truth.joints_rad for _, truth in chosen])
        root_T_reference, points = self.kinematics(torch.from_numpy(joints), self.link)
        camera_T_root = torch.from_numpy(np.stack([truth.camera_T_root for _, truth in chosen]))
        camera_T_reference = camera_T_root @ root_T_reference
        R, t = camera_T_reference[:, :3, :3], camera_T_reference[:, None, :3, 3]
        seen = points @ R.transpose(1, 2) + t
        views = [_view(one.numpy(), rng) for one in seen]
        pictures = [
            view.picture(image, _camera(truth, len(image)), CROP_PX)
            for view, (image, truth) in zip(views, chosen, strict=True)
        ]
        crop_R_camera = torch.from_numpy(np.stack([view.camera_R_crop.T for view in views]))
        middle = (crop_R_camera @ seen.mean(1)[..., None])[..., 0]
        return Batch(
            torch.from_numpy(np.stack(pictures)).permute(0, 3, 1, 2).float() / 255,
            torch.from_numpy(posture(joints)).float(),
            torch.tensor([view.focal for view in views]),
            (crop_R_camera @ R).float(),
            middle.float(),
            points.mean(1).float(),
        )


def _view(points: NDArray[np.float64], rng: np.random.Generator) -> VirtualCamera:
    share = float(np.exp(rng.uniform(*np.log(SHARE))))
    return VirtualCamera.at(points, share, rng.normal(0, ASIDE, 2), float(rng.normal(0, ROLL_RAD)))


def _camera(truth: Truth, size: int) -> CameraModel:
    return CameraModel(size, size, truth.K)
