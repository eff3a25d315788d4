"""What the network is punished for.

Valassakis et al. 2021 fit translation and rotation together; so do we. The weights and the norms are ours. `middle`
also asks where the robot is in the picture: a pose that is a little wrong, yet puts the robot where it is seen, is the
better one, and the translation alone does not say so.
"""

from __future__ import annotations

from typing import NamedTuple

import torch
from torch import Tensor

from hecbench_plugins.regression.answer import decode

_ROTATION, _MIDDLE = 1.0, 3.0
"""Weights: a radian counts as a metre, and an error of the whole distance as three."""
_LEAST = 1e-6
"""Added to squares, so that roots have a gradient at 0."""


class Losses(NamedTuple):
    """Terms of one batch, before their weights.

    Attributes:
        translation: mean distance m of the camera's place from the true one, in the robot's frame.
        rotation: mean chord 2 sin(angle / 2): a small angle in rad, with a gradient that stays bounded.
        middle: mean distance of the robot's middle from its true place in the camera's frame, over that to the camera.
    """

    translation: Tensor
    rotation: Tensor
    middle: Tensor

    def total(self) -> Tensor:
        """The weighed sum."""
        return self.translation + _ROTATION * self.rotation + _MIDDLE * self.middle


def losses(
    numbers: Tensor, focal: Tensor, crop_R_reference: Tensor, crop_middle: Tensor, reference_middle: Tensor
) -> Losses:
    """The terms for numbers (B, 9) of virtual cameras with focal lengths (B,), shares of the side.

    Args:
        numbers: the network's answers.
        focal: of the virtual cameras.
        crop_R_reference: (B, 3, 3), the truth.
        crop_middle: (B, 3) m of the robot's middle in the virtual camera's frame, the truth.
        reference_middle: (B, 3) m of the same in the robot's frame, by its kinematics.
    """
    pose = decode(numbers, focal)
    R = torch.stack([pose.x, pose.y, pose.z], -1)
    middle = torch.stack(pose.middle, -1)
    place = reference_middle - (R.transpose(1, 2) @ middle[..., None])[..., 0]
    true = reference_middle - (crop_R_reference.transpose(1, 2) @ crop_middle[..., None])[..., 0]
    return Losses(
        _length(place - true).mean(),
        _length((R - crop_R_reference).flatten(1)).mean() / 2**0.5,
        (_length(middle - crop_middle) / _length(crop_middle)).mean(),
    )


def _length(vector: Tensor) -> Tensor:
    """(...) of vectors (..., n), with a gradient where it is 0."""
    return ((vector**2).sum(-1) + _LEAST).sqrt()
