"""Many small pictures, averaged over their pixels as a camera does: the covariance holds the error they share."""

from dataclasses import replace

import numpy as np
import pytest
from hecbench_datasets.suites.synthetic import BASE, CENTRE_JOINTS_DEG, robot_and_mesh
from hecbench_datasets.suites.synthetic import make as synthetic
from hecbench_plugins.second_order.render_gn import RenderGN

from hecbench import se3
from hecbench.recording import CameraModel
from hecbench.rendering import Renderer

WIDTH, HEIGHT, VIEWS, SAMPLES = 64, 48, 30, 4


def averaged_pictures(seed):
    model, mesh = robot_and_mesh()
    rng = np.random.default_rng(seed)
    scene = synthetic("LP", seed, 61)
    camera = CameraModel.centred(WIDTH, HEIGHT, float(WIDTH))
    fine = CameraModel.centred(SAMPLES * WIDTH, SAMPLES * HEIGHT, float(SAMPLES * WIDTH))
    renderer = Renderer(mesh, fine.intrinsics, fine.width, fine.height)
    joints = np.deg2rad(CENTRE_JOINTS_DEG + rng.uniform(-30, 30, (VIEWS, 6)))
    pictures = []
    for base_T_link in model.link_poses(joints, frame=BASE):
        renderer.draw(se3.inverse(scene.truth_parent_T_camera) @ base_T_link)
        drawn = renderer.image(mesh.colours).reshape(HEIGHT, SAMPLES, WIDTH, SAMPLES, 4)
        pictures.append(np.round(255 * np.clip(drawn.mean((1, 3)), 0, 1)).astype(np.uint8))
    return replace(
        scene,
        sample_ids=tuple(f"{view:06d}" for view in range(VIEWS)),
        camera=camera,
        joints_rad=joints,
        base_T_flange=None,
        images=tuple(picture[..., :3] for picture in pictures),
        masks=tuple(np.where(picture[..., 3] >= 128, 255, 0).astype(np.uint8) for picture in pictures),
    )


@pytest.mark.parametrize("seed", [0, 1, 4])
def test_more_views_do_not_average_out_what_they_share(seed):
    recording = averaged_pictures(seed)
    found = RenderGN()(recording, rng=np.random.default_rng(0))
    off = se3.log(found.parent_T_camera @ se3.inverse(recording.truth_parent_T_camera))
    squared = off @ np.linalg.solve(found.covariance, off)
    assert squared < 18.5, "chi-square of six degrees of freedom, 99.5 %"
    assert np.linalg.norm(off[3:]) > 0.5e-3, "the pictures are too good to test anything"
