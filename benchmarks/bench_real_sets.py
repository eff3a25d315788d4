"""The real sets as the adapters and the detector give them: spread of the constant target pose, beside references.

    python benchmarks/bench_real_sets.py ../shared/data

Spread is the rms deviation of the target's pose around its mean by OpenCV's Park on all samples; the references are
those that came with the data. rms is the reprojection of the detected points.
"""

from __future__ import annotations

import sys
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
from hecbench_plugins.detection import detect
from hecbench_plugins.markers.target_poses import project, target_poses

from hecbench import preparation, se3
from hecbench.recording import CameraModel

TUTORIAL = CameraModel(
    640,
    480,
    np.array([[601.0670, 0, 321.3921], [0, 602.4187, 236.8026], [0, 0, 1]]),
    np.array([0.056637, 0, 0, 0]),
)
SETS = {
    "camodocal_ur": ("camodocal_ur", None, (4.0, 6.8)),
    "franka_charuco": ("franka_charuco", None, (0.72, 3.4)),
    "ethz_arm_sim": ("ethz_arm_sim", None, (0.21, 1.5)),
    "visp eye in hand": ("visp_franka/data-eye-in-hand", detect, (0.45, 4.4)),
    "visp eye to hand, tutorial's K": (
        "visp_franka/data-eye-to-hand",
        lambda recording: detect(replace(recording, camera=TUTORIAL)),
        (0.51, 1.7),
    ),
    "industrial, nominal K": ("industrial_10x10/test_set_10x10", detect, (2.74, 19)),
    "industrial, K refitted": (
        "industrial_10x10/test_set_10x10",
        lambda recording: detect(recording, refit_intrinsics=True),
        (1.01, 7.3),
    ),
}


def spread(recording, method):
    """Spread (deg, mm) of the constant target pose."""
    flange_T_base, poses = se3.inverse(recording.hand_poses()), target_poses(recording)
    R, t = cv2.calibrateHandEye(
        flange_T_base[:, :3, :3], flange_T_base[:, :3, 3], poses[:, :3, :3], poses[:, :3, 3], method=method
    )
    constant = flange_T_base @ se3.make(R, t[:, 0]) @ poses
    mean = se3.mean(constant)
    angles, distances = se3.rotation_error_rad(mean, constant), se3.translation_error_m(mean, constant)
    return np.rad2deg(np.sqrt(np.mean(angles**2))), 1e3 * np.sqrt(np.mean(distances**2))


def reprojection_px(recording):
    """Rms of the detected points against their pose, or None for recordings without points."""
    if recording.corners_px is None:
        return None
    poses = target_poses(recording)
    gaps = [
        project(recording.camera, pose, recording.target.points_m) for pose in poses
    ] - recording.corners_px
    return float(np.sqrt(np.nanmean((gaps**2).sum(2))))


def main(data):
    """Print the table as Markdown."""
    print("| set | samples | Park deg / mm | reference | Daniilidis deg / mm | rms px |")
    print("|---|---|---|---|---|---|")
    for name, (folder, detector, reference) in SETS.items():
        recording = preparation.load_recording(data / folder)
        recording = detector(recording) if detector else recording
        park, daniilidis = (
            "{:.2f} / {:.2f}".format(*spread(recording, method))
            for method in (cv2.CALIB_HAND_EYE_PARK, cv2.CALIB_HAND_EYE_DANIILIDIS)
        )
        rms_px = reprojection_px(recording)
        cells = [name, len(recording), park, "{:g} / {:g}".format(*reference), daniilidis]
        print(f"| {' | '.join(map(str, cells))} | {'' if rms_px is None else f'{rms_px:.3f}'} |")


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    main(Path(sys.argv[1]))
