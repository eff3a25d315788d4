"""Pictures of any camera as one virtual camera would have taken them from the same place.

A camera that only turns about its centre and changes its focal length sees the same rays: a crop is a resampling, and
the pose of the real camera follows from that of the virtual one exactly.
"""

from __future__ import annotations

from dataclasses import dataclass

import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray

from hecbench.lens import CameraModel, distort
from hecbench.se3 import Array
from hecbench_plugins.perception.shrinking import softened
from hecbench_plugins.perception.skeleton import LINK_RADIUS_M

Bytes = NDArray[np.uint8]

_FOCAL = (0.3, 20.0)
"""Least and largest focal length of a virtual camera, as a share of its side: 118 to 3 degrees."""
_FOREMOST = 0.05
"""A ray's least z (of a unit ray): what lies farther to the side is not in any picture."""


@dataclass(frozen=True, eq=False)
class VirtualCamera:
    """A square pinhole camera at the centre of a real one.

    Attributes:
        camera_R_crop: (3, 3) from its axes to those of the real camera.
        focal: its focal length as a share of its side.
    """

    camera_R_crop: Array
    focal: float

    @staticmethod
    def whole(camera: CameraModel) -> VirtualCamera:
        """The one that shows the whole picture of a camera."""
        K = camera.intrinsics
        middle = np.array([camera.width - 1, camera.height - 1]) / 2
        ray = np.linalg.inv(K) @ [*middle, 1.0]
        return VirtualCamera(
            towards(ray), float(np.clip(K[0, 0] / max(camera.width, camera.height), *_FOCAL))
        )

    @staticmethod
    def at(
        points: ArrayLike, share: float, aside: ArrayLike = (0.0, 0.0), roll: float = 0.0
    ) -> VirtualCamera:
        """The one in whose picture points (K, 3) m of the real camera's frame take a share of the side.

        Args:
            points: those behind the camera do not count.
            share: of the picture's side, by the larger extent.
            aside: (2,) where their middle is, as a share of the side away from the picture's.
            roll: rad about the optical axis.
        """
        points = np.asarray(points, float)
        unit = points / np.linalg.norm(points, axis=1, keepdims=True)
        middle = unit.mean(0)
        R = towards(middle) @ _about_z(roll)
        for last in (False, True):
            p = points @ R
            p[:, 2] = np.maximum(p[:, 2], _FOREMOST)
            reach = LINK_RADIUS_M / p[:, 2:]
            low, high = (p[:, :2] / p[:, 2:] - reach).min(0), (p[:, :2] / p[:, 2:] + reach).max(0)
            focal = float(np.clip(share / (high - low).max(), *_FOCAL))
            off = (low + high) / 2 - (np.asarray(aside, float) / focal if last else 0.0)
            R = R @ towards(np.array([*off, 1.0]))
        return VirtualCamera(R, focal)

    def picture(self, image: Bytes, camera: CameraModel, size: int) -> Bytes:
        """Its picture (size, size, 3), from that of the real camera; what that does not show is its border's colour."""
        sides = (np.arange(size) - (size - 1) / 2) / (self.focal * size)
        rays = np.stack([*np.meshgrid(sides, sides), np.ones((size, size))], -1) @ self.camera_R_crop.T
        rays[..., 2] = np.maximum(rays[..., 2], _FOREMOST)
        K = camera.intrinsics
        seen = distort(rays[..., :2] / rays[..., 2:], camera)
        places = (seen @ K[:2, :2].T + K[:2, 2]).astype(np.float32)
        soft = softened(image, self.focal * size / float(K[0, 0]))
        return np.asarray(
            cv2.remap(soft, places, None, cv2.INTER_LINEAR, borderMode=cv2.BORDER_REPLICATE), np.uint8
        )


def towards(ray: ArrayLike) -> Array:
    """R (3, 3), the least turn that takes the z axis to a direction (3,)."""
    x, y, z = np.asarray(ray, float) / np.linalg.norm(ray)
    if z < -1 + 1e-9:
        return np.diag([1.0, -1.0, -1.0])
    a, b = 1 / (1 + z), -x * y / (1 + z)
    return np.array([[1 - x * x * a, b, x], [b, 1 - y * y * a, y], [-x, -y, z]])


def _about_z(angle: float) -> Array:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, -s, 0], [s, c, 0], [0, 0, 1.0]])
