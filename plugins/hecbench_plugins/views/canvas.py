"""What the maskless stages look at: undistorted photographs on one padded canvas, and the robot in each of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hecbench.errors import InputError, Refusal
from hecbench.lens import EQUIDISTANT, CameraModel
from hecbench.recording import Recording
from hecbench.rendering.undistort import shrunk_intrinsics
from hecbench.robots.posed import PosedRobot
from hecbench.se3 import Array
from hecbench_plugins.views.spool import Spool

Images = NDArray[np.uint8]

PAD_PX = 60
"""By which the canvas is larger than the image on each side: a lens bends the robot's base out of the image."""
_LARGEST_PX = 1600
"""Wider canvases are shrunk: a contour is found to a fraction of a pixel anyway."""
_GRID = 8


@dataclass(frozen=True, eq=False)
class Canvas:
    """N photographs as a pinhole camera sees them.

    Attributes:
        K: (3, 3) px, pixel centres at integers.
        images: (N, H, W, 3) RGB, read one by one.
        valid: (H, W) where the photographs say something.
        joints_rad: (N, J).
        parent_T_link: (N, L, 4, 4) m.
        flange: index of the flange's link, None when the parent is the flange itself.
        sample_ids: N names.
    """

    K: Array
    images: Spool
    valid: NDArray[np.bool_]
    joints_rad: Array
    parent_T_link: Array
    flange: int | None
    sample_ids: tuple[str, ...]

    def __len__(self) -> int:
        return len(self.images)

    def subset(self, indices: Sequence[int] | NDArray[np.integer]) -> Canvas:
        """The same canvas with only these photographs."""
        chosen = np.asarray(indices, int)
        if np.array_equal(chosen, np.arange(len(self))):
            return self
        return Canvas(
            self.K,
            self.images.subset(chosen.tolist()),
            self.valid,
            self.joints_rad[chosen],
            self.parent_T_link[chosen],
            self.flange,
            tuple(self.sample_ids[i] for i in chosen.tolist()),
        )


def undistorted_canvas(recording: Recording, robot: PosedRobot) -> Canvas:
    """Read and undistort the photographs of all samples with joints.

    Raises:
        Refusal: there is none, or an image holds values that are not finite.
        InputError: an image cannot be read or is not of the camera's size; joints are outside their limits.
    """
    camera, joints = recording.present.camera, robot.joints_rad
    sources = recording.images or ()
    rows = [i for i in robot.samples.tolist() if i < len(sources) and sources[i] is not None]
    if not rows:
        raise Refusal("no sample with joints has an image")
    maps, K, valid = _lens(camera)
    shrink = int(np.ceil(valid.shape[1] / _LARGEST_PX))

    def one(number: int) -> Images:
        import cv2

        image = np.asarray(cv2.remap(recording.image(rows[number]), *maps, cv2.INTER_LINEAR), np.uint8)
        return image if shrink == 1 else _shrunk(image, shrink)

    images = Spool.of(one, len(rows))
    if shrink > 1:
        height, width = images.shape[1:3]
        cut = valid[: height * shrink, : width * shrink]
        valid = np.asarray(cut.reshape(height, shrink, width, shrink).all((1, 3)))
        K = shrunk_intrinsics(K, 1 / shrink)
    at_flange = robot.flange_link == robot.parent_link
    flange = None if at_flange else robot.model.link_index(robot.flange_link)
    samples = tuple(recording.sample_ids[row] for row in rows)
    return Canvas(K, images, valid, joints[rows], robot.link_poses(joints[rows]), flange, samples)


def _lens(
    camera: CameraModel,
) -> tuple[tuple[NDArray[np.float32], NDArray[np.float32]], Array, NDArray[np.bool_]]:
    """Where each pixel of the canvas lies in the image, the canvas' K, and where that is inside the image."""
    import cv2

    pad = 0 if camera.is_pinhole else PAD_PX
    width, height = (-(-(size + 2 * pad) // _GRID) * _GRID for size in (camera.width, camera.height))
    K = camera.intrinsics.copy()
    K[:2, 2] += pad
    if camera.intrinsics[0, 1] != 0:
        raise InputError("camera.K: has skew, which the undistortion of photographs does not support")
    fisheye = camera.distortion_model == EQUIDISTANT
    rectify: Any = cv2.fisheye.initUndistortRectifyMap if fisheye else cv2.initUndistortRectifyMap
    coefficients = camera.distortion if len(camera.distortion) else np.zeros(4)
    across, down = rectify(camera.intrinsics, coefficients, np.eye(3), K, (width, height), cv2.CV_32FC1)
    valid = (across >= 0) & (down >= 0) & (across <= camera.width - 1) & (down <= camera.height - 1)
    return (across, down), K, valid


def _shrunk(image: Images, by: int) -> Images:
    import cv2

    height, width = (size // by // _GRID * _GRID for size in image.shape[:2])
    cut = image[: height * by, : width * by]
    return np.asarray(cv2.resize(cut, (width, height), interpolation=cv2.INTER_AREA), np.uint8)
