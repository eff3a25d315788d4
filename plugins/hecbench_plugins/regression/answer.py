"""What the nine numbers of the network mean. The same lines serve arrays of NumPy and tensors of torch.

Three say where the robot's middle is: across and down as shares of the picture's side, and the logarithm of its
distance over the focal length (as a share of the side), which is what its size shows. Six say the rotation, as two
columns that need be neither of unit length nor perpendicular (Zhou et al. 2019, "On the continuity of rotation
representations in neural networks", section 4.2).
"""

from __future__ import annotations

from math import e
from typing import Any, NamedTuple

NUMBERS = 9


class Pose(NamedTuple):
    """Arrays or tensors, for a batch of shape (...).

    Attributes:
        x, y, z: (..., 3), the columns of crop_R_reference.
        middle: three of shape (...), m: the robot's middle in the frame of the virtual camera.
    """

    x: Any
    y: Any
    z: Any
    middle: tuple[Any, Any, Any]


def decode(numbers: Any, focal: Any) -> Pose:
    """The pose that numbers (..., 9) mean in a virtual camera of focal length `focal` (...), a share of its side."""
    depth = focal * e ** numbers[..., 2]
    middle = (numbers[..., 0] / focal * depth, numbers[..., 1] / focal * depth, depth)
    return Pose(*columns(numbers[..., 3:]), middle)


def columns(six: Any) -> tuple[Any, Any, Any]:
    """The columns (..., 3) of the rotation that six numbers (..., 6) mean, by Gram and Schmidt."""
    x = _unit(six[..., :3])
    along = (x * six[..., 3:]).sum(-1)[..., None]
    y = _unit(six[..., 3:] - along * x)
    z = x[..., [1, 2, 0]] * y[..., [2, 0, 1]] - x[..., [2, 0, 1]] * y[..., [1, 2, 0]]
    return x, y, z


def _unit(vector: Any) -> Any:
    return vector / ((vector * vector).sum(-1)[..., None] + 1e-12) ** 0.5
