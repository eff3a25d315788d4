"""Run a trained network by OpenCV alone: the whole picture first, then what lies around the robot."""

from __future__ import annotations

from functools import lru_cache
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import ArrayLike, NDArray

from hecbench import se3
from hecbench.errors import InputError
from hecbench.lens import CameraModel
from hecbench.se3 import Array
from hecbench_plugins.perception.card import read_network
from hecbench_plugins.perception.graph import runnable
from hecbench_plugins.regression.answer import NUMBERS, decode
from hecbench_plugins.regression.card import RegressionCard
from hecbench_plugins.regression.reference import posture
from hecbench_plugins.regression.virtual_camera import VirtualCamera

_SHARES = (0.7, 0.7)
"""Of the picture's side that the robot takes, by the answer before, in the passes after the first; the last counts.
Chosen between six on 50 drawn pictures of a seed of their own."""


class RegressionModel:
    """A network from its folder.

    Raises:
        InputError: the folder's files are missing or damaged, or the graph does not fit its card.
    """

    def __init__(self, folder: Path) -> None:
        self.card, weights = read_network(folder, RegressionCard)
        path, size = folder / self.card.weights, self.card.size
        with runnable(path):
            self._net = cv2.dnn.readNetFromONNX(np.frombuffer(weights, np.uint8))
            answer = self._answer(np.zeros((size, size, 3), np.uint8), np.zeros(len(self.card.joints)))
        if answer.shape != (NUMBERS + 1,):
            raise InputError(
                f"{path}: the graph answers {answer.shape}, {NUMBERS + 1} numbers are wanted: train the model again"
            )

    def camera_T_reference(
        self, image: NDArray[np.uint8], camera: CameraModel, joints_rad: ArrayLike, points: Array
    ) -> tuple[Array, float]:
        """The pose (4, 4) m of the card's link that one picture shows, and the blur of the whole picture.

        The blur is the mean spread of the keypoints' heatmaps as a share of the side: 0.41 for even ones.

        Args:
            image: (H, W, 3) RGB as the camera took it, with its distortion.
            camera: its intrinsics and lens.
            joints_rad: (J,) in the card's order.
            points: (K, 3) m, the card's keypoints in the link's frame at these joints.
        """
        found, blur = self._look(VirtualCamera.whole(camera), image, camera, joints_rad, points)
        for share in _SHARES:
            view = VirtualCamera.at(se3.transform_points(found, points), share)
            found, _ = self._look(view, image, camera, joints_rad, points)
        return found, blur

    def _look(
        self,
        view: VirtualCamera,
        image: NDArray[np.uint8],
        camera: CameraModel,
        joints_rad: ArrayLike,
        points: Array,
    ) -> tuple[Array, float]:
        numbers = self._answer(view.picture(image, camera, self.card.size), joints_rad)
        pose = decode(numbers[:NUMBERS], view.focal)
        R = view.camera_R_crop @ np.stack([pose.x, pose.y, pose.z], -1)
        t = view.camera_R_crop @ np.array(pose.middle) - R @ points.mean(0)
        return se3.make(R, t), float(numbers[-1])

    def _answer(self, picture: NDArray[np.uint8], joints_rad: ArrayLike) -> NDArray[np.float64]:
        """The graph's numbers for a picture (S, S, 3)."""
        blob = np.ascontiguousarray(picture.transpose(2, 0, 1)[None], np.float32) / 255
        self._net.setInput(blob, "image")
        self._net.setInput(posture(joints_rad)[None].astype(np.float32), "posture")
        return np.asarray(self._net.forward()[0], np.float64)


@lru_cache(maxsize=4)
def model_of(folder: Path) -> RegressionModel:
    """The network in a folder, loaded once.

    Raises:
        InputError: there is none that can be run.
    """
    return RegressionModel(folder)
