"""Marker methods on generated rigs: accuracy, Cramer-Rao bound, coverage, times, and the recall of `check`.

Run: ``python benchmarks/bench_markers.py accuracy|coverage|times|check|misreadings|good|good_pictures
[--rigs 200]``
(minutes each, one core).
"""

import argparse
import os
import time
from collections import Counter
from dataclasses import replace

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")

import cv2
import numpy as np
from hecbench_datasets.suites.synthetic_markers import PRESETS, generate, make
from hecbench_datasets.synthetic_faults import FAULTS, arm_recording
from hecbench_datasets.synthetic_misreadings import MISREADINGS, near_board
from hecbench_plugins.markers.reprojection import corner_problem
from hecbench_plugins.printing.seen import seen
from hecbench_plugins.solvers.bundle import Bundle

from hecbench import preparation, registry, se3
from hecbench.bundle.adjustment import adjust
from hecbench.bundle.model import Noise, State, predict
from hecbench.diagnose import Severity, check
from hecbench.errors import HecbenchError
from hecbench.recording import Mounting
from hecbench.robots.model import load_robot
from hecbench.specs import Kind, SolverSpec
from hecbench.targets import AprilTagTarget, CharucoTarget, ChessboardTarget
from hecbench.workspace import apart_m, points_in_parent

cv2.setNumThreads(1)

SOLVERS = (
    "tsai", "park", "horaud", "andreff", "daniilidis", "wang2024_reconstructed", "shah", "li",
    "single3d_closed", "single3d_iterative", "bundle_fixed", "bundle",
)  # fmt: skip
LEVELS = ("tag_2m", "small_tag_2m", "board_2m")
CHI2_6_AT_95 = 12.5916
SEED = 0


def known_bundle(level):
    setting = PRESETS[level]
    return Bundle(setting.pixel_noise_px, setting.robot_noise_deg, setting.robot_noise_mm)


def errors_mm(X, recording):
    truth, moves = recording.truth_parent_T_camera, recording.mounting is Mounting.EYE_IN_HAND
    return (
        1e3 * float(se3.translation_error_m(X, truth)),
        1e3 * float(apart_m(X, truth, points_in_parent(recording.base_T_flange, moves))),
    )


def cramer_rao_covariance(level, recording):
    """Of X: the inverse Fisher information of corners and robot poses without residuals, true X and noise."""
    setting = PRESETS[level]
    noise = Noise(setting.pixel_noise_px, np.deg2rad(setting.robot_noise_deg), setting.robot_noise_mm / 1e3)
    problem = corner_problem(recording.without_truth())
    answer = known_bundle(level)(recording.without_truth(), rng=np.random.default_rng(0))
    X = recording.truth_parent_T_camera
    state = State(X, answer.carrier_T_target, problem.base_T_flange, problem.parameters)
    expected, _, _ = predict(problem, state)
    without_residuals = replace(problem, observed=np.where(problem.seen[..., None], expected, np.nan))
    return adjust(without_residuals, state, noise).covariance[:6, :6]


def accuracy(rigs):
    for level in LEVELS:
        solvers = {name: registry.load().get(Kind.SOLVER, name, SolverSpec).factory() for name in SOLVERS} | {
            "bundle, known noise": known_bundle(level)
        }
        found = {name: [] for name in solvers}
        bound = []
        for index in range(rigs):
            recording = make(level, index, SEED)
            for name, solver in solvers.items():
                try:
                    answer = solver(recording.without_truth(), rng=np.random.default_rng(0))
                    found[name].append(errors_mm(answer.parent_T_camera, recording))
                except HecbenchError:
                    found[name].append((np.nan, np.nan))
            covariance = cramer_rao_covariance(level, recording)
            rng = np.random.default_rng(index)
            for twist in rng.multivariate_normal(np.zeros(6), covariance, 20):
                bound.append(errors_mm(se3.exp(twist) @ recording.truth_parent_T_camera, recording))
        print(
            f"\n{level}: medians over {rigs} rigs\n{'solver':24} {'camera mm':>10} {'TRE mm':>8} {'no answer':>10}"
        )
        for name, values in found.items():
            camera, tre = np.nanmedian(values, axis=0)
            print(f"{name:24} {camera:10.2f} {tre:8.2f} {np.isnan(values)[:, 0].sum():10}")
        camera, tre = np.median(bound, axis=0)
        print(f"{'Cramer-Rao bound':24} {camera:10.2f} {tre:8.2f}")
        ratio = np.nanmedian(found["bundle, known noise"], axis=0)[1] / tre
        print(f"TRE of bundle with known noise over the bound: {ratio:.3f}")


def coverage(rigs):
    print(f"{'level':22} {'noise':10} {'mean of e^T C^-1 e':>20} {'95 % coverage':>14}   over {rigs} rigs")
    for level in PRESETS:
        for label, solver in (("known", known_bundle(level)), ("estimated", Bundle())):
            squares = []
            for index in range(rigs):
                recording = make(level, index, SEED + 1)
                answer = solver(recording.without_truth(), rng=np.random.default_rng(0))
                twist = se3.log(recording.truth_parent_T_camera @ se3.inverse(answer.parent_T_camera))
                squares.append(twist @ np.linalg.solve(answer.covariance, twist))
            squares = np.array(squares)
            inside = (squares < CHI2_6_AT_95).mean()
            print(f"{level:22} {label:10} {squares.mean():20.2f} {100 * inside:13.1f} %", flush=True)


def times(rigs):
    """Medians of one core; the first solve (imports) is left out."""
    small = PRESETS["tag_2m"]
    large = replace(PRESETS["board_2m"], target=ChessboardTarget(9, 6, 0.025), samples=50)
    for name, setting in (("10 samples x 4 corners", small), ("50 samples x 54 corners", large)):
        for solver_name in SOLVERS:
            solver = registry.load().get(Kind.SOLVER, solver_name, SolverSpec).factory()
            seconds = []
            for index in range(rigs):
                recording = generate(setting, np.random.default_rng(index)).without_truth()
                began = time.perf_counter()
                solver(recording, rng=np.random.default_rng(0))
                seconds.append(time.perf_counter() - began)
            print(f"{name:24} {solver_name:24} {1e3 * np.median(seconds[1:]):8.1f} ms", flush=True)


def good_recording(kind, index, robot):
    return arm_recording(robot, np.random.default_rng([7, index])) if kind == "arm" else make(kind, index, 3)


def check_recall(rigs):
    robot = load_robot("ur5e", meshes=False)
    kinds = ("tag_2m", "tag_2m_in_hand", "board_2m", "board_2m_in_hand")
    good = [(kind, i) for i in range(rigs // len(kinds)) for kind in kinds]
    alarms = Counter()
    for recordings in (good, [("arm", i) for i in range(rigs)], [("small_tag_2m", i) for i in range(rigs)]):
        alarms = Counter()
        for kind, index in recordings:
            found = {(f.id, f.severity) for f in check(good_recording(kind, index, robot))}
            alarms.update(f"{i} {s}" for i, s in found if s in (Severity.WARNING, Severity.CRITICAL))
            alarms["any critical"] += any(s is Severity.CRITICAL for _, s in found)
        print(f"{len(recordings)} good recordings ({recordings[0][0]} ...): {dict(alarms)}", flush=True)
    for name, fault in FAULTS.items():
        hits, besides = 0, Counter()
        recordings = [("arm", i) for i in range(rigs)] if fault.needs_joints else good
        for kind, index in recordings:
            recording = good_recording(kind, index, robot)
            if fault.needs_target_poses:
                recording = preparation.prepare(recording)
            faulty = fault.seed(recording, np.random.default_rng([11, index]))
            found = check(faulty)
            ids = {f.id for f in found if f.severity is Severity.CRITICAL}
            hits += fault.finding in (ids if fault.critical else {f.id for f in found})
            besides.update(ids - {fault.finding})
        share = 100 * hits / len(recordings)
        print(f"{name:34} {fault.finding:28} {share:6.1f} %  besides: {dict(besides)}", flush=True)


def misreadings(rigs):
    """How often `check` names the cause of a misread board recording, names another, and is silent on good ones."""
    sources = [near_board(np.random.default_rng([13, i]), 12 + i % 30, i % 2 == 1) for i in range(rigs)]
    alarms = Counter(f.id for r in sources for f in check(r) if f.severity is Severity.CRITICAL)
    print(f"{rigs} good recordings, critical findings: {dict(alarms)}", flush=True)
    for name, fault in MISREADINGS.items():
        hits, besides = 0, Counter()
        for index, source in enumerate(sources):
            faulty = fault.seed(source, np.random.default_rng([11, index]))
            ids = {f.id for f in check(faulty) if f.severity is Severity.CRITICAL}
            hits += fault.finding in ids
            besides.update(ids - {fault.finding})
        print(f"{name:34} {fault.finding:22} {hits} of {rigs}  besides: {dict(besides)}", flush=True)


GOOD_TARGETS = (
    AprilTagTarget("tag36h11", 0, 0.12),
    ChessboardTarget(7, 5, 0.03),
    CharucoTarget(7, 5, 0.04, 0.03, "DICT_4X4_50"),
)


def photographed(recording, rng):
    """The same recording with drawn pictures of its target in place of the corners."""
    poses = preparation.prepare(recording).camera_T_target
    size = recording.camera.width, recording.camera.height
    drawn = [
        seen(
            recording.target, recording.camera.K, pose, size, noise=2.0, rng=rng, pixels_per_mm=4.0, samples=3
        )
        for pose in poses
    ]
    images = tuple(np.repeat(picture[..., None], 3, 2) for picture in drawn)
    return replace(recording, images=images, corners_px=None, camera_T_target=None)


def good(rigs, pictures=False, first=0):
    """How often `check` finds something critical, or warns, where nothing is wrong: 8 to 60 samples, both mountings.

    Of the recordings from number `first` on, so that a long campaign can be made in parts.
    """
    critical, warned, any_critical = Counter(), Counter(), 0
    for index in range(first, first + rigs):
        rng = np.random.default_rng([17 + pictures, index])
        setting = replace(
            PRESETS["tag_2m"],
            target=GOOD_TARGETS[index % 3],
            mounting=(Mounting.EYE_TO_HAND, Mounting.EYE_IN_HAND)[index // 3 % 2],
            samples=int(rng.integers(8, 61)),
            distance_m=rng.uniform(0.8, 2.0),
            pixel_noise_px=rng.uniform(0.1, 0.4),
            robot_noise_mm=rng.uniform(0.1, 0.8),
            robot_noise_deg=rng.uniform(0.01, 0.08),
        )
        if pictures:
            small = {"width": 800, "height": 670, "focal_px": 820.0, "pixel_noise_px": 0.02}
            setting = replace(setting, distance_m=rng.uniform(0.6, 1.2), box_m=0.3, **small)
            recording = photographed(generate(setting, rng), rng)
        else:
            recording = generate(setting, rng)
        findings = check(recording)
        if pictures and any(f.severity is Severity.CRITICAL for f in findings):
            print(index, [(f.id, f.summary) for f in findings if f.severity is Severity.CRITICAL], flush=True)
        critical.update(f.id for f in findings if f.severity is Severity.CRITICAL)
        warned.update(f.id for f in findings if f.severity is Severity.WARNING)
        any_critical += any(f.severity is Severity.CRITICAL for f in findings)
    what = "with pictures" if pictures else "of corners"
    print(f"{any_critical} of {rigs} good recordings {what} have a critical finding: {dict(critical)}")
    print(f"warnings: {dict(warned)}", flush=True)


CAMPAIGNS = {
    "accuracy": accuracy,
    "coverage": coverage,
    "times": times,
    "check": check_recall,
    "misreadings": misreadings,
}

if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("campaign", choices=(*CAMPAIGNS, "good", "good_pictures"))
    parser.add_argument("--rigs", type=int, default=200)
    parser.add_argument(
        "--first", type=int, default=0, help="of good and good_pictures: the first recording's number"
    )
    arguments = parser.parse_args()
    if arguments.campaign in CAMPAIGNS:
        CAMPAIGNS[arguments.campaign](arguments.rigs)
    else:
        good(arguments.rigs, arguments.campaign == "good_pictures", arguments.first)
