"""From arrays to a recording folder that every verb reads, and back."""

import tempfile
from pathlib import Path

import numpy as np

from hecbench import se3
from hecbench.recording import CameraModel, Mounting, Recording
from hecbench.storage import recording_io
from hecbench.targets import ChessboardTarget

rng = np.random.default_rng(0)
K = np.array([[900.0, 0, 639.5], [0, 900, 359.5], [0, 0, 1]])
board = ChessboardTarget(columns=9, rows=6, square_m=0.025)
base_T_camera = se3.from_rotvec([-2.2, 0.1, 0.1], [0.4, -0.9, 0.7])  # what a calibration will have to find
flange_T_target = se3.from_rotvec([0, 0, 0.3], [-0.1, -0.06, 0.02])
camera_T_target = se3.from_rotvec(
    rng.uniform(-0.4, 0.4, (12, 3)), rng.uniform([-0.2, -0.1, 0.7], [0, 0.1, 1], (12, 3))
)
pixels = se3.transform_points(camera_T_target, board.points_m) @ K.T

recording = Recording(
    name="my_cell",
    mounting=Mounting.EYE_TO_HAND,  # the camera stands beside the robot; EYE_IN_HAND: it sits on the flange
    sample_ids=tuple(f"{i:06d}" for i in range(12)),
    camera=CameraModel(1280, 720, K),
    target=board,
    base_T_flange=base_T_camera @ camera_T_target @ se3.inverse(flange_T_target),  # from the controller
    corners_px=pixels[..., :2] / pixels[..., 2:],  # from a detector; NaN where a corner was not seen
)
folder = Path(tempfile.mkdtemp()) / "my_cell"
recording_io.save(recording, folder)
print(f"{folder}: {len(recording_io.load(folder))} samples; try: hecbench solve {folder}")
