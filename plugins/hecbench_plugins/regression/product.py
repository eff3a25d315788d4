"""What a training run leaves: a model's folder with weights, card, curve and sample pictures."""

from __future__ import annotations

import hashlib
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from hecbench import se3
from hecbench.lens import CameraModel
from hecbench.system import files
from hecbench_plugins.perception.card import FORMAT, write_card
from hecbench_plugins.perception.card_text import write_page
from hecbench_plugins.perception.pictures import PictureMaker
from hecbench_plugins.perception.product import SAMPLE_SEED, SAMPLES, facts, write_curve, write_picture
from hecbench_plugins.regression.card import WEIGHTS, WORDS, RegressionCard
from hecbench_plugins.regression.model import RegressionModel
from hecbench_plugins.regression.onnx_export import to_onnx
from hecbench_plugins.regression.plan import CROP_PX
from hecbench_plugins.regression.reference import posture, reference_link
from hecbench_plugins.regression.training import Training

_ROWS, _COLUMNS = 2, 6
_TRUE, _ANSWERED = (0, 255, 0), (255, 0, 0)


def write_model(training: Training) -> Path:
    """Write `training.plan.out`/model and return it."""
    folder, arm = training.plan.out / "model", training.family.arms[0]
    joints = arm.model.joint_names
    weights = to_onnx(training.averaged_network(), posture(np.zeros(len(joints))).size)
    files.write_bytes(folder / WEIGHTS, weights)
    card = RegressionCard(
        format=FORMAT,
        robots=training.family.names,
        weights=WEIGHTS,
        sha256=hashlib.sha256(weights).hexdigest(),
        joints=joints,
        reference=reference_link(arm.model),
        keypoints=arm.keypoints,
        size=CROP_PX,
        training=facts(training),
    )
    write_card(folder, card)
    write_page(folder, card, WORDS)
    write_curve(folder, training)
    maker = PictureMaker(training.family, 2 * CROP_PX, SAMPLE_SEED, training.plan.backgrounds, empty=0.0)
    write_picture(folder / SAMPLES, _samples(RegressionModel(folder), maker))
    return folder


def _samples(model: RegressionModel, maker: PictureMaker) -> NDArray[np.uint8]:
    """New pictures with the robot's skeleton where it is (green) and where the network's camera sees it (red)."""
    arm, tiles = maker.family.arms[0], []
    for _ in range(_ROWS * _COLUMNS):
        example = maker.example()
        truth = example.truth
        assert truth is not None
        root_T_link = arm.model.link_poses(truth.joints_rad)
        root_T_reference = root_T_link[arm.model.link_index(model.card.reference)]
        points = arm.keypoint_positions(se3.inverse(root_T_reference) @ root_T_link)
        camera = CameraModel(maker.size, maker.size, truth.K)
        answer, _ = model.camera_T_reference(example.image, camera, truth.joints_rad, points)
        tile = np.ascontiguousarray(example.image)
        for pose, colour in ((truth.camera_T_root @ root_T_reference, _TRUE), (answer, _ANSWERED)):
            p = se3.transform_points(pose, points)
            pixels = p[:, :2] / np.maximum(p[:, 2:], 0.05) * np.diag(truth.K)[:2] + truth.K[:2, 2]
            corners = np.clip(np.rint(pixels), -maker.size, 2 * maker.size).astype(np.int32)
            cv2.polylines(tile, [corners], False, colour, 1, cv2.LINE_AA)
        tiles.append(tile)
    rows = [np.hstack(tiles[i : i + _COLUMNS]) for i in range(0, len(tiles), _COLUMNS)]
    return np.vstack(rows)
