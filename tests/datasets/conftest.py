"""Fixtures of the adapters' tests."""

import numpy as np
import pytest

from hecbench import registry, se3
from hecbench.specs import DatasetSpec, Kind


@pytest.fixture(scope="session")
def data(shared):
    """The folder of real recordings."""
    return shared / "data"


@pytest.fixture(scope="session")
def sniffers():
    """Names of the formats that recognise a path, without the last resort, which takes any folder."""
    specs = [s for s in registry.load().ready(Kind.DATASET, DatasetSpec) if not s.last_resort]
    return lambda path: [spec.name for spec in specs if spec.sniff(path)]


@pytest.fixture(scope="session")
def spread():
    """Spread of the constant target pose (deg, mm) by a method of OpenCV, and its answer."""

    def measure(recording, method="PARK"):
        import cv2

        flange_T_base = se3.inverse(recording.hand_poses())
        target = recording.camera_T_target
        R, t = cv2.calibrateHandEye(
            flange_T_base[:, :3, :3],
            flange_T_base[:, :3, 3],
            target[:, :3, :3],
            target[:, :3, 3],
            method=getattr(cv2, f"CALIB_HAND_EYE_{method}"),
        )
        parent_T_camera = se3.make(R, t[:, 0])
        constant = flange_T_base @ parent_T_camera @ target
        mean = se3.mean(constant)
        angles, distances = se3.rotation_error_rad(mean, constant), se3.translation_error_m(mean, constant)
        return np.rad2deg(np.sqrt(np.mean(angles**2))), 1e3 * np.sqrt(np.mean(distances**2)), parent_T_camera

    return measure


@pytest.fixture(scope="session")
def cell():
    """Generated pose pairs of a mounting: base_T_flange and camera_T_target (N, 4, 4), and parent_T_camera."""

    def make(eye_in_hand, count=10, seed=3):
        rng = np.random.default_rng(seed)
        X = se3.from_rotvec([0.3, -2.0, 1.1], [0.09, 0.02, 0.06] if eye_in_hand else [0.9, 0.2, 0.6])
        target = se3.from_rotvec(rng.normal(0, 0.5, (count, 3)), rng.normal([0, 0, 0.8], 0.1, (count, 3)))
        Y = se3.from_rotvec([0.1, 0.4, -0.2], [0.7, 0.02, 0.1] if eye_in_hand else [0.05, 0.02, 0.1])
        hand = X @ target @ se3.inverse(Y)
        return (se3.inverse(hand) if eye_in_hand else hand), target, X

    return make
