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
from hecbench_plugins.views.settings import CANVAS
from hecbench_plugins.views.spool import Spool

Images = NDArray[np.uint8]


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


@dataclass(frozen=True, eq=False)
class Rectification:
    """How a camera's pictures become those of a pinhole camera on the canvas.

    Attributes:
        maps: where each pixel of the unshrunk canvas lies in the picture, x and y.
        K: (3, 3) px of the canvas.
        valid: (H, W) where the canvas lies inside the picture.
        shrink: unshrunk pixels for one of the canvas.
    """

    maps: tuple[NDArray[np.float32], NDArray[np.float32]]
    K: Array
    valid: NDArray[np.bool_]
    shrink: int

    @staticmethod
    def of(camera: CameraModel) -> Rectification:
        """Of a camera whose K is known.

        Raises:
            InputError: K has skew.
        """
        import cv2

        pad = 0 if camera.is_pinhole else CANVAS.pad_px
        grid = CANVAS.grid_px
        width, height = (-(-(size + 2 * pad) // grid) * grid for size in (camera.width, camera.height))
        K = camera.intrinsics.copy()
        K[:2, 2] += pad
        if K[0, 1] != 0:
            raise InputError("camera.K: has skew, which the undistortion of photographs does not support")
        fisheye = camera.distortion_model == EQUIDISTANT
        rectify: Any = cv2.fisheye.initUndistortRectifyMap if fisheye else cv2.initUndistortRectifyMap
        coefficients = camera.distortion if len(camera.distortion) else np.zeros(4)
        across, down = rectify(camera.intrinsics, coefficients, np.eye(3), K, (width, height), cv2.CV_32FC1)
        valid = (across >= 0) & (down >= 0) & (across <= camera.width - 1) & (down <= camera.height - 1)
        shrink = int(np.ceil(width / CANVAS.largest_px))
        if shrink > 1:
            height, width = _shrunk_size(valid.shape, shrink)
            cut = valid[: height * shrink, : width * shrink]
            valid = np.asarray(cut.reshape(height, shrink, width, shrink).all((1, 3)))
            K = shrunk_intrinsics(K, 1 / shrink)
        return Rectification((across, down), K, valid, shrink)

    def image(self, image: Images) -> Images:
        """A picture (H, W, 3) RGB on the canvas."""
        import cv2

        flat = np.asarray(cv2.remap(image, *self.maps, cv2.INTER_LINEAR), np.uint8)
        if self.shrink == 1:
            return flat
        height, width = _shrunk_size(flat.shape, self.shrink)
        cut = flat[: height * self.shrink, : width * self.shrink]
        return np.asarray(cv2.resize(cut, (width, height), interpolation=cv2.INTER_AREA), np.uint8)


def _shrunk_size(shape: Sequence[int], by: int) -> tuple[int, int]:
    """(H, W), whole multiples of the grid."""
    grid = CANVAS.grid_px
    return shape[0] // by // grid * grid, shape[1] // by // grid * grid


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
    lens = Rectification.of(camera)
    images = Spool.of(lambda number: lens.image(recording.image(rows[number])), len(rows))
    at_flange = robot.flange_link == robot.parent_link
    flange = None if at_flange else robot.model.link_index(robot.flange_link)
    samples = tuple(recording.sample_ids[row] for row in rows)
    return Canvas(lens.K, images, lens.valid, joints[rows], robot.link_poses(joints[rows]), flange, samples)
