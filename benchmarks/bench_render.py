"""The renderer and `render_gn`: the figures of docs/rendering.md, each printed beside its bar.

Run: ``make bench TEST_ARGS=benchmarks/bench_render.py`` (about an hour on one core at full size);
``HECBENCH_BENCH_SCALE=0.05`` draws 5 % of the samples.
"""

import os
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hecbench_datasets.suites import synthetic
from hecbench_plugins.second_order.descent import Trace
from hecbench_plugins.second_order.photometry import Photometry
from hecbench_plugins.solvers.render_gn import render_gn
from hecbench_plugins.views.pyramid import prepare

from hecbench import se3
from hecbench.errors import SolverFailure
from hecbench.rendering import Renderer, RenderMesh
from hecbench.robots.model import load_robot
from hecbench.storage.recording_io import load

SCALE = float(os.environ.get("HECBENCH_BENCH_SCALE", "1"))
SHARED = Path(__file__).resolve().parents[2] / "shared" / "data"
ROBOTS = ("ur5e", "ur3e", SHARED / "robots" / "denso_vs060" / "vs060_description" / "vs060.urdf")
CHI2_6_95 = 12.5916


def count(full):
    return max(3, round(SCALE * full))


@pytest.fixture(scope="module")
def scene():
    """A renderer of the full UR5e at 640 x 480, f = 772 px, 2 m away, and its link poses."""
    model = load_robot("ur5e")
    K = np.array([[772, 0, 319.5], [0, 772, 239.5], [0, 0, 1]])
    camera_T_base = synthetic.scene("LP", 0, 0).camera_T_base
    poses = camera_T_base @ model.link_poses(np.deg2rad(synthetic.CENTRE_JOINTS_DEG), frame="base_link")
    renderer = Renderer(RenderMesh.of(model), K, 640, 480)
    renderer.draw(poses)
    renderer.image()
    return renderer, poses


def cpu_median_ms(call, rounds=400):
    """Median CPU time: what the call takes on a core of its own."""
    times = []
    for _ in range(rounds):
        start = time.thread_time_ns()
        call()
        times.append(time.thread_time_ns() - start)
    return np.median(times) / 1e6


def test_bench_forward(benchmark, scene):
    renderer, poses = scene

    def call():
        renderer.draw(poses)
        renderer.image()

    benchmark.pedantic(call, rounds=100, warmup_rounds=20)
    print(f"\nforward, anti-aliased: {cpu_median_ms(call):.2f} ms of CPU (2)")


def test_bench_forward_with_jacobian(benchmark, scene):
    renderer, poses = scene

    def call():
        renderer.draw(poses)
        renderer.image()
        renderer.crossings.pose_columns()

    benchmark.pedantic(call, rounds=100, warmup_rounds=20)
    print(f"\nwith Jacobian: {cpu_median_ms(call):.2f} ms of CPU (3.5)")


def random_pose(model, rng):
    joints = rng.uniform(-1, 1, len(model.joint_names)) + np.deg2rad([0, -90, 90, -90, -90, 0])
    lower, upper = model.limits().T
    camera_T_base = synthetic.scene("LP", int(rng.integers(1 << 30)), 1).camera_T_base
    return camera_T_base @ model.link_poses(np.clip(joints, lower, upper))


@pytest.mark.parametrize("robot", ROBOTS, ids=lambda robot: Path(robot).stem)
def test_bench_coverage(benchmark, robot):
    """Against 16 x 16 samples per pixel: mean of edge pixels 0.04, 99th percentile 0.15, area 0.2 %."""
    model, rng = load_robot(robot), np.random.default_rng(0)
    mesh = RenderMesh.of(model)
    K = np.array([[640, 0, 319.5], [0, 640, 239.5], [0, 0, 1]])
    fine_K = np.array([[10240, 0, 5119.5], [0, 10240, 3839.5], [0, 0, 1]])
    coarse, fine = Renderer(mesh, K, 640, 480), Renderer(mesh, fine_K, 16 * 640, 16 * 480)
    errors, areas = [], []

    def compare():
        for _ in range(count(100)):
            poses = random_pose(model, rng)
            coarse.draw(poses)
            fine.draw(poses)
            coverage = coarse.image()[..., 3]
            sampled = (fine.face >= 0).reshape(480, 16, 640, 16).mean((1, 3))
            edge = (sampled > 0) & (sampled < 1)
            errors.append(np.abs(coverage - sampled)[edge])
            areas.append(abs(coverage.sum() / sampled.sum() - 1))

    benchmark.pedantic(compare, rounds=1)
    error = np.concatenate(errors)
    print(
        f"\n{model.name}: edge pixels mean {error.mean():.4f} (0.04), 99th percentile"
        f" {np.percentile(error, 99):.3f} (0.15), area {100 * np.mean(areas):.3f} % (0.2)"
    )


@pytest.mark.parametrize("ambient", [None, 0.3])
@pytest.mark.parametrize("robot", ROBOTS, ids=lambda robot: Path(robot).stem)
def test_bench_derivative(benchmark, robot, ambient):
    """Against central differences averaged over 8 x 8 pixel phases: correlation 0.99, ratio within 2 %."""
    model, rng = load_robot(robot), np.random.default_rng(0)
    mesh = RenderMesh.of(model)
    steps, scale = np.array([2e-4, 2e-4, 6e-4, 4e-4, 4e-4, 1.5e-3]), np.array([2, 2, 2, 1, 1, 1.0])
    found = []

    def compare():
        for _ in range(count(100)):
            poses = random_pose(model, rng)
            analytic, numeric = np.zeros((480, 640, 3, 6)), np.zeros((480, 640, 3, 6))
            for phase in np.argwhere(np.ones((8, 8))) / 8:
                K = np.array([[640, 0, 319.5 + phase[0]], [0, 640, 239.5 + phase[1]], [0, 0, 1]])
                renderer = Renderer(mesh, K, 640, 480, ambient)
                renderer.draw(poses)
                analytic += renderer.image_derivative()
                for k, step in enumerate(steps):
                    for sign in (1, -1):
                        renderer.draw(se3.exp(sign * step * np.eye(6)[k]) @ poses)
                        numeric[..., k] += sign * renderer.image()[..., :3] / (2 * step)
            a, n = (analytic / scale).ravel(), (numeric / scale).ravel()
            found.append((np.corrcoef(a, n)[0, 1], a @ n / (a @ a)))

    benchmark.pedantic(compare, rounds=1)
    (correlation, ratio), (worst, _) = np.mean(found, 0), np.min(found, 0)
    light = "flat" if ambient is None else f"lamp, ambient {ambient}"
    print(
        f"\n{model.name}, {light}: correlation {correlation:.4f} (0.99), least {worst:.4f},"
        f" ratio {ratio:.3f} (0.98 to 1.02)"
    )


def errors(estimate, recording):
    """camera_T_parent mm, camera centre mm, rad."""
    ends = estimate.parent_T_camera, recording.truth_parent_T_camera
    return (
        1e3 * se3.translation_error_m(*(se3.inverse(end) for end in ends)),
        1e3 * se3.translation_error_m(*ends),
        se3.rotation_error_rad(*ends),
    )


def solve_level(level, samples):
    """Errors of every run, NaN where it failed, and the median seconds."""
    solver, rows, seconds = render_gn(), [], []
    for index in range(samples):
        recording = synthetic.make(level, index, 0)
        start = time.perf_counter()
        try:
            rows.append(errors(solver(recording.without_truth(), rng=np.random.default_rng(0)), recording))
        except SolverFailure:
            rows.append((np.nan,) * 3)
        seconds.append(time.perf_counter() - start)
    return np.array(rows), np.median(seconds)


@pytest.mark.parametrize("level", ["LP", "MP", "HP"])
def test_bench_start_levels(benchmark, level):
    rows, seconds = benchmark.pedantic(solve_level, (level, count(200)), rounds=1)
    success = ((rows[:, 1] < 5) & (rows[:, 2] < 0.01)).sum()
    print(
        f"\n{level}: {success} of {len(rows)} (all), mean camera_T_parent {np.nanmean(rows[:, 0]):.4f} mm (0.05),"
        f" rotation {np.nanmean(rows[:, 2]):.1e} rad (1e-4), median {seconds:.2f} s (0.3)"
    )


@pytest.mark.parametrize("level", ["mismatch_1", "mismatch_3", "mismatch_5"])
def test_bench_mismatch(benchmark, level):
    rows, _ = benchmark.pedantic(solve_level, (level, count(200)), rounds=1)
    answered = np.flatnonzero(np.isfinite(rows[:, 0]))
    floor = np.mean([synthetic.correspondence_floor_mm(level, index, 0) for index in answered.tolist()])
    mean = rows[answered, 0].mean()
    print(
        f"\n{level}: {len(answered)} of {len(rows)} answered, mean {mean:.1f} mm, floor {floor:.1f} mm,"
        f" ratio {mean / floor:.2f} (1.2)"
    )


@pytest.mark.parametrize("level", [*synthetic.CHANGES, "colours", "joint_noise", *synthetic.VIEWS])
def test_bench_appearance(benchmark, level):
    rows, _ = benchmark.pedantic(solve_level, (level, count(50)), rounds=1)
    print(
        f"\n{level}: {np.isfinite(rows[:, 0]).sum()} of {len(rows)} answered, mean {np.nanmean(rows[:, 0]):.3f} mm"
        f" (gain, gamma, blur: 0.3), largest {np.nanmax(rows[:, 0]):.2f}"
    )


def test_bench_noise_against_the_cramer_rao_bound(benchmark):
    """Noise 0.05, no mask: rms error 1.2 times the bound, the 95 % ellipsoids hold 93 to 97 %."""
    solver, by_bound, by_estimate = render_gn(), [], []

    def trials():
        for index in range(count(1000)):
            recording = synthetic.make("LP", index % 200, 0)
            rng = np.random.default_rng([1, index])
            noisy = recording.image(0) / 255 + rng.normal(0, 0.05, (480, 640, 3))
            blind = replace(recording.without_truth(), images=(noisy.astype(np.float32),), masks=None)
            estimate = solver(blind, rng=rng)
            truth = recording.truth_parent_T_camera
            _, views = prepare(recording)
            exact = Photometry(views, 1, slice(0, 3), np.inf, Trace())
            information = exact(se3.inverse(truth))[1]
            twist = se3.log(truth @ se3.inverse(estimate.parent_T_camera))
            local = np.linalg.solve(se3.adjoint(truth), twist)
            by_bound.append(local @ information @ local / 0.05**2)
            by_estimate.append(twist @ np.linalg.solve(estimate.covariance, twist))

    benchmark.pedantic(trials, rounds=1)
    held = np.mean(np.array(by_estimate) < CHI2_6_95)
    ratio = np.sqrt(np.mean(by_bound) / 6)
    print(
        f"\nnoise: rms {ratio:.3f} of the Cramer-Rao bound (1.2), 95 % ellipsoid holds {100 * held:.1f} % (93-97)"
    )


def test_bench_pictures_of_another_renderer(benchmark):
    """The lit recordings, given masks, from their starts: single views 1.0 mm, five views 0.4 mm."""
    if not SHARED.is_dir():
        pytest.skip("the lit recordings are not beside this checkout")
    solver, single, joint = render_gn(), [], []

    def trials():
        for path in sorted(SHARED.glob("lit_ur5e_1_*")):
            recording = load(path)
            for index in range(len(recording)):
                estimate = solver(recording.subset([index]).without_truth(), rng=np.random.default_rng(0))
                single.append(errors(estimate, recording)[1])
            joint.append(
                errors(solver(recording.without_truth(), rng=np.random.default_rng(0)), recording)[1]
            )

    benchmark.pedantic(trials, rounds=1)
    print(
        f"\nlit: single {np.mean(single):.2f} mm (1.0), largest {max(single):.2f}, {len(single)} of 30;"
        f" five views {np.mean(joint):.2f} mm (0.4), largest {max(joint):.2f}"
    )
