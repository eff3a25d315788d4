"""Drawn pictures show a target's points where its pose puts them."""

import numpy as np
import pytest
from hecbench_plugins.printing.seen import seen

from hecbench import preparation, se3
from hecbench.errors import InputError
from hecbench.lens import CameraModel, project
from hecbench.recording import Mounting, Recording
from hecbench.targets import AprilTagTarget, CharucoTarget, ChessboardTarget, PointsTarget

CAMERA = CameraModel(480, 360, np.array([[450.0, 0, 239.3], [0, 455.0, 181.7], [0, 0, 1]]))


@pytest.mark.parametrize(
    "target",
    [
        AprilTagTarget("tag36h11", 3, 0.1),
        ChessboardTarget(8, 5, 0.02),
        CharucoTarget(7, 5, 0.03, 0.022, "DICT_4X4_50"),
    ],
    ids=lambda target: target.kind,
)
def test_points_are_where_the_pose_puts_them(target):
    middle = target.points_m.mean(0)
    pose = se3.from_rotvec([0.2, -0.3, 0.4], [0.02, 0.01, 0.45]) @ se3.make(np.eye(3), -middle)
    picture = seen(target, CAMERA.K, pose, (CAMERA.width, CAMERA.height))
    recording = Recording(
        name="drawn",
        mounting=Mounting.EYE_TO_HAND,
        sample_ids=("0",),
        base_T_flange=np.eye(4)[None],
        camera=CAMERA,
        target=target,
        images=(np.repeat(picture[..., None], 3, 2),),
    )
    found = preparation.prepare(recording).corners_px[0]
    expected = project(CAMERA, se3.transform_points(pose, target.points_m))
    assert np.isfinite(found).all()
    assert np.sqrt(((found - expected) ** 2).sum(1).mean()) < 0.2


def test_dots_are_refused():
    points = 0.02 * np.mgrid[:4, :3, :1].reshape(3, -1).T
    dots = PointsTarget(tuple(map(tuple, points.tolist())))
    with pytest.raises(InputError, match="points"):
        seen(dots, CAMERA.K, np.eye(4), (480, 360))
