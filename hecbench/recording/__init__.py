"""What was measured: robot poses, observations of a target or of the robot, and how they were mounted."""

from hecbench.lens import CameraModel
from hecbench.recording.present import Present
from hecbench.recording.recording import Recording
from hecbench.recording.terms import Image, ImageSource, Mounting, Need, RobotDescription, hand_poses

__all__ = [
    "CameraModel",
    "Image",
    "ImageSource",
    "Mounting",
    "Need",
    "Present",
    "Recording",
    "RobotDescription",
    "hand_poses",
]
