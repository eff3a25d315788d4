"""Planned against random further views, by the error that `render_gn` makes with them; docs/next-view.md.

Run: ``make bench TEST_ARGS=benchmarks/bench_next_view.py`` (about 15 minutes on one core at full size);
``HECBENCH_BENCH_SCALE=0.2`` takes a fifth of the scenes.
"""

import os
from dataclasses import replace

import numpy as np
import pytest
from hecbench_datasets.suites import guess_free, synthetic
from hecbench_plugins.solvers.render_gn import render_gn
from scipy import ndimage

from hecbench import next_view, se3, statistics
from hecbench.errors import Refusal, SolverFailure
from hecbench.rendering import Renderer
from hecbench.workspace import cube_corners

SCALE = float(os.environ.get("HECBENCH_BENCH_SCALE", "1"))
SCENES, CANDIDATES = 24, 200
ADDED = (1, 4)
SMOOTH_PX = 8.0
"""Sigma of the displacement of a blurred mask's contour along it: a correlation length of about 15 px."""


def recording(scene, joints, noise_px):
    """The scene with these joints; each mask's contour moved by a smooth random field."""
    model, mesh = synthetic.robot_and_mesh()
    renderer = Renderer(mesh, scene.camera.K, synthetic.WIDTH, synthetic.HEIGHT)
    masks = []
    for q, poses in zip(joints, model.link_poses(joints, frame=synthetic.BASE), strict=True):
        renderer.draw(se3.inverse(scene.truth_parent_T_camera) @ poses)
        coverage = renderer.image()[..., 3].copy()
        rng = np.random.default_rng(q.view(np.uint32))  # the same joints give the same mask in every plan
        fields = [ndimage.gaussian_filter(rng.normal(size=coverage.shape), SMOOTH_PX) for _ in range(2)]
        grid = np.mgrid[0 : coverage.shape[0], 0 : coverage.shape[1]].astype(float)
        moved = [axis + noise_px * field / field.std() for axis, field in zip(grid, fields, strict=True)]
        masks.append(
            np.where(ndimage.map_coordinates(coverage, moved, order=1) >= 0.5, 255, 0).astype(np.uint8)
        )
    return replace(
        scene,
        sample_ids=tuple(map(str, range(len(joints)))),
        joints_rad=joints,
        base_T_flange=model.forward(joints, base=synthetic.BASE, tip=synthetic.FLANGE),
        images=None,
        masks=tuple(masks),
    )


def one_scene(index, noise_px):
    """Errors and expected errors, mm: with the first view, then per plan (D-optimal, mask variance, random)."""
    scene = synthetic.make("LP", index, 0)
    model, _ = synthetic.robot_and_mesh()
    rng = np.random.default_rng([index, 1])
    candidates = np.array([guess_free.working_joints(rng) for _ in range(CANDIDATES)])
    points_m = cube_corners(model.forward(candidates, base=synthetic.BASE, tip=synthetic.FLANGE))

    def solved(joints):
        try:
            return render_gn()(recording(scene, joints, noise_px).without_truth(), rng=rng).parent_T_camera
        except (Refusal, SolverFailure) as reason:
            print(f"scene {index}, {len(joints)} views: {reason}")
            return None

    def error_mm(camera):
        if camera is None:
            return np.inf
        moved = se3.transform_points(camera @ se3.inverse(scene.truth_parent_T_camera), points_m)
        return 1e3 * float(np.sqrt(((moved - points_m) ** 2).sum(-1).mean()))

    first = scene.joints_rad
    camera = solved(first)
    errors = [error_mm(camera)]
    camera = scene.initial_parent_T_camera if camera is None else camera
    view = next_view.RobotView(scene)
    known = next_view.prior_information() + view.look(first[0], camera).information
    looks = [view.look(joints, camera) for joints in candidates]
    visible = [i for i, look in enumerate(looks) if next_view.Visible()(look)]
    plans = (
        next_view.most_informative(view, camera, candidates, known, max(ADDED)).indices,
        next_view.most_uncertain(view, camera, candidates, known, max(ADDED), rng=rng).indices,
        rng.choice(visible, max(ADDED), replace=False).tolist(),
    )
    expected = [1e3 * next_view.expected_error_m(known, camera, points_m)]
    for plan in plans:
        for count in ADDED:
            errors.append(error_mm(solved(np.concatenate([first, candidates[plan[:count]]]))))
            then = known + sum(looks[i].information for i in plan[:count])
            expected.append(1e3 * next_view.expected_error_m(then, camera, points_m))
    return errors, expected


@pytest.mark.parametrize("noise_px", [1.0, 0.0])
def test_bench_planned_views(benchmark, noise_px):
    def call():
        return [one_scene(index, noise_px) for index in range(max(3, round(SCALE * SCENES)))]

    errors, expected = np.array(benchmark.pedantic(call, rounds=1)).transpose(1, 0, 2)
    names = ["first view", *(f"{p} +{n}" for p in ("D-optimal", "mask variance", "random") for n in ADDED)]
    print(f"\ncontour noise {noise_px} px, {len(errors)} scenes, mm in the workspace:")
    for name, actual, foreseen in zip(names, errors.T, expected.T, strict=True):
        print(
            f"{name}: mean {actual.mean():.3f}, median {np.median(actual):.3f}, expected {foreseen.mean():.3f}"
        )
    for k, name in enumerate(("D-optimal", "mask variance")):
        for j, count in enumerate(ADDED):
            gain = errors[:, 1 + 2 * len(ADDED) + j] - errors[:, 1 + k * len(ADDED) + j]
            mean = statistics.bootstrap(gain, np.mean)
            print(
                f"random minus {name}, +{count}: {mean.value:.3f} [{mean.low:.3f}, {mean.high:.3f}],"
                f" better in {(gain > 0).sum()} of {len(gain)}"
            )
    assert expected[:, 1 + len(ADDED) - 1].mean() < expected[:, -1].mean()
