"""What a camera of any intrinsics sees of a scene: supersampled, distorted, noisy; with the robot's mask."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from hecbench import se3
from hecbench.errors import InputError
from hecbench.lens import normalised
from hecbench.recording import CameraModel
from hecbench.se3 import Array
from hecbench_hardware.lab.gl import Canvas
from hecbench_hardware.lab.scene import FAR_M, NEAR_M, Scene

Image = NDArray[np.uint8]

_AROUND_PX = 40


@dataclass(frozen=True)
class Sensor:
    """How good the pictures are.

    Attributes:
        supersample: pictures are drawn this much larger in each direction, then averaged.
        noise: standard deviation of the grey levels, of 255, the same in the three colours of a pixel.
    """

    supersample: int = 2
    noise: float = 0.0


class Eye:
    """Draws one scene with one camera."""

    def __init__(
        self, scene: Scene, camera: CameraModel, sensor: Sensor = Sensor(), *, whole: bool = True
    ) -> None:
        """Open the graphics; raises `HecbenchError` with the cure where there are none.

        Args:
            scene: What there is to see.
            camera: Its optics.
            sensor: How good the pictures are.
            whole: Supersample whole pictures. False: only around the points that `image` is given, which is
                several times faster; a camera with distortion is always drawn whole.
        """
        self.scene, self.camera, self.sensor = scene, camera, sensor
        self._pinhole, self._map = _without_distortion(camera, sensor.supersample)
        self._fine_only = not whole and self._map is None
        largest = camera if self._fine_only else self._pinhole
        self._canvas = Canvas(scene.model, largest.width, largest.height)

    def image(
        self, base_T_camera: Array, rng: np.random.Generator | None = None, fine_m: Array | None = None
    ) -> Image:
        """(H, W, 3) RGB from a pose (4, 4).

        Args:
            base_T_camera: Where the camera is.
            rng: Draws the noise of the sensor.
            fine_m: (P, 3) points in the base around which an eye that is not `whole` supersamples.
        """
        if self._fine_only:
            image = self._drawn(self.camera, base_T_camera)
            if fine_m is not None:
                self._refine(image, base_T_camera, fine_m)
        else:
            image = self._reduced(self._drawn(self._pinhole, base_T_camera))
        if self.sensor.noise and rng is not None:
            levels = rng.standard_normal((*image.shape[:2], 1), np.float32) * np.float32(self.sensor.noise)
            noisy = image + np.rint(levels).astype(np.int16)
            image = np.clip(noisy, 0, 255, out=noisy).astype(np.uint8)
        return image

    def mask(self, base_T_camera: Array) -> NDArray[np.bool_]:
        """(H, W) True where the robot covers more than half of the pixel."""
        drawn = self._drawn(self._pinhole, base_T_camera, segmented=True)
        covered = self.scene.is_robot(drawn).astype(np.uint8) * np.uint8(255)
        return np.asarray(self._reduced(covered) > 127)

    def depth(self, base_T_camera: Array) -> NDArray[np.float32]:
        """(H, W) m along the optical axis, without noise, at the pixels' centres; for cameras without distortion.

        Raises:
            InputError: the camera has distortion.
        """
        if self._map is not None:
            raise InputError("the lab draws depth for cameras without distortion only")
        size = self.camera.width, self.camera.height
        return self._canvas.depth(self.scene.view(self.camera, base_T_camera), *size, NEAR_M, FAR_M)

    def _drawn(self, pinhole: CameraModel, base_T_camera: Array, *, segmented: bool = False) -> Image:
        view = self.scene.view(pinhole, base_T_camera, segmented=segmented)
        return self._canvas.draw(view, pinhole.width, pinhole.height)

    def _refine(self, image: Image, base_T_camera: Array, fine_m: Array) -> None:
        """Draw the surroundings of points again, supersampled, into the picture."""
        import cv2

        points = se3.transform_points(se3.inverse(base_T_camera), fine_m)
        if (points[:, 2] <= 0).any():
            return
        pixels = (points @ self._K.T)[:, :2] / points[:, 2:]
        size = np.array([self.camera.width, self.camera.height])
        low = np.clip(np.floor(pixels.min(0)) - _AROUND_PX, 0, size).astype(int)
        high = np.clip(np.ceil(pixels.max(0)) + _AROUND_PX, 0, size).astype(int)
        factor = self.sensor.supersample
        if (high <= low).any() or ((high - low) * factor > size).any():
            return
        K = self._K.copy()
        K[:2, 2] -= low
        width, height = (int(side) for side in high - low)
        fine = self._drawn(_enlarged(CameraModel(width, height, K), factor), base_T_camera)
        image[low[1] : high[1], low[0] : high[0]] = cv2.resize(
            fine, (width, height), interpolation=cv2.INTER_AREA
        )

    @property
    def _K(self) -> Array:
        return self.camera.intrinsics

    def _reduced(self, drawn: Image) -> Image:
        """From the drawn pinhole picture to the sensor's pixels."""
        import cv2

        if self._map is not None:
            drawn = cv2.remap(np.ascontiguousarray(drawn), *self._map, cv2.INTER_LINEAR)
        size = self.camera.width, self.camera.height
        if drawn.shape[1::-1] == size:
            return np.ascontiguousarray(drawn)
        return np.asarray(cv2.resize(drawn, size, interpolation=cv2.INTER_AREA), np.uint8)

    def close(self) -> None:
        """Give the graphics back. May be called twice."""
        self._canvas.close()


def _without_distortion(
    camera: CameraModel, supersample: int
) -> tuple[CameraModel, tuple[NDArray[np.float32], NDArray[np.float32]] | None]:
    """The pinhole camera to draw with, and where each supersampled pixel of the real one lies in its picture."""
    skewed = camera.intrinsics[0, 1] != 0
    if camera.is_pinhole and not skewed:
        return _enlarged(camera, supersample), None
    import cv2

    u, v = np.meshgrid(np.arange(camera.width, dtype=float), np.arange(camera.height, dtype=float))
    pixels = np.column_stack([u.ravel(), v.ravel()])
    rays = normalised(camera, pixels)
    low, high = rays.min(0), rays.max(0)
    focal = supersample * camera.intrinsics[[0, 1], [0, 1]]
    width, height = (int(side) for side in np.ceil((high - low) * focal) + 3)
    centre = 1 - low * focal
    K = np.array([[focal[0], 0, centre[0]], [0, focal[1], centre[1]], [0, 0, 1]])
    places = (rays * focal + centre).reshape(camera.height, camera.width, 2).astype(np.float32)
    size = supersample * camera.width, supersample * camera.height
    fine = cv2.resize(places, size, interpolation=cv2.INTER_LINEAR)
    return CameraModel(width, height, K), (fine[..., 0], fine[..., 1])


def _enlarged(camera: CameraModel, factor: int) -> CameraModel:
    """The same view with more pixels; pixel centres are at integers in both."""
    K = camera.intrinsics.copy()
    K[:2] *= factor
    K[:2, 2] += (factor - 1) / 2
    return replace(camera, width=camera.width * factor, height=camera.height * factor, K=K)
