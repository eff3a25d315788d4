"""The figures of docs/trials.md: contact sweep, tag accuracy, sweeps of what decides the ranking, pictures.

python benchmarks/bench_trials.py contact | tag | conditions | pictures OUT | vs060 URDF OUT
"""

from __future__ import annotations

import sys
import time
from dataclasses import replace
from itertools import product
from pathlib import Path

import numpy as np
from hecbench_hardware import tag_edges, tags
from hecbench_hardware.lab import cells, recordings
from hecbench_hardware.lab.recordings import MarkerSet
from hecbench_hardware.lab.scene import FlangeTag
from hecbench_hardware.trials import solids, sweep, tasks
from hecbench_hardware.trials.calibrations import predicted
from hecbench_hardware.trials.cell import Calibration
from hecbench_hardware.trials.tasks import Task

from hecbench import preparation, registry, se3
from hecbench.recording import Recording
from hecbench.running import solving
from hecbench.specs import Kind, SolverSpec
from hecbench.storage import store
from hecbench.targets import AprilTagTarget

GRIPPER = solids.GRIPPERS["robotiq_2f_85"]
SPREAD = {Task.GRASP: (0.02, [0, 0, 0.05]), Task.INSERTION: (0.0012, [0.012] * 3)}


def contact(count: int = 400) -> None:
    """Milliseconds of one core per trial, and agreement with the formula."""
    rng = np.random.default_rng(0)
    for task in Task:
        shift, turn = SPREAD[task]
        seconds, agree, successes, near = [], 0, 0, []
        for _ in range(count):
            end = tasks.workpiece_T_tool(task)
            error = se3.from_rotvec(rng.normal(0, turn), rng.normal(0, shift, 3))
            end[:3, :3], end[:3, 3] = error[:3, :3] @ end[:3, :3], error[:3, 3] + end[:3, 3]
            path = np.array([tasks.above(end, tasks.stroke_m(task)), end])
            begun = time.process_time()
            found = sweep.judge(task, path, GRIPPER)
            seconds.append(time.process_time() - begun)
            formula = tasks.closed_form(task, end, GRIPPER)
            agree += found.success == formula.success
            successes += found.success
            if found.success != formula.success:
                near.append(abs(formula.margin_mm))
        print(
            f"{task}: {1e3 * np.median(seconds):.2f} ms of one core, median, formula agrees {agree}/{count}, "
            f"success {successes}/{count}, largest margin where they differ {max(near, default=0):.2f} mm"
        )


def tag(count: int = 10) -> None:
    """Error of the workpiece's tag by distance, size of picture, supersampling and noise."""
    from hecbench_hardware.lab.eye import Eye, Sensor
    from hecbench_hardware.lab.trial_cell import lab_camera

    station = cells.ur5e()
    for (width, height), sample, noise in (
        ((640, 480), 2, 0.0),
        ((2448, 2048), 1, 0.0),
        ((2448, 2048), 2, 0.0),
        ((2448, 2048), 2, 2.0),
    ):
        camera = cells.camera_model(width, height)
        eye: Eye = lab_camera(station, camera, Sensor(sample, noise), 0).eye
        for distance_m in (1.0, 2.0):
            rng = np.random.default_rng(1)
            errors, turns = [], []
            for _ in range(count):
                base_T_workpiece = station.workpiece_pose(int(rng.integers(3)))
                eye.scene.place(station.home_rad, base_T_workpiece)
                base_T_tag = base_T_workpiece @ solids.workpiece_T_tag()
                azimuth, elevation = rng.uniform(-0.5, 0.5), rng.uniform(0.1, 0.6)
                away = [
                    np.cos(azimuth) * np.cos(elevation),
                    np.sin(azimuth) * np.cos(elevation),
                    np.sin(elevation),
                ]
                place = base_T_tag[:3, 3] + distance_m * station.base_T_room[:3, :3] @ np.array(away)
                base_T_camera = cells.looking_at(place, base_T_tag[:3, 3] + rng.uniform(-0.1, 0.1, 3))
                points = se3.transform_points(base_T_tag, solids.TAG.points_m)
                found = tags.locate(eye.image(base_T_camera, rng, points), camera, solids.TAG)
                truth = se3.inverse(base_T_camera) @ base_T_tag
                errors.append(1e3 * float(se3.translation_error_m(found.camera_T_tag, truth)))
                turns.append(np.degrees(float(se3.rotation_error_rad(found.camera_T_tag, truth))))
            print(
                f"{width}x{height} supersampled {sample}x noise {noise:g}/255, {distance_m:g} m: median "
                f"{np.median(errors):.2f} mm, largest {max(errors):.2f} mm, {np.median(turns):.3f} deg"
            )
        eye.close()


def conditions(seed: int = 0) -> None:
    """Predicted grasps and insertions of every fast solver by tag size, pose spread and noise, without pictures."""
    station = cells.ur5e()
    specs = [spec for spec in registry.load().ready(Kind.SOLVER, SolverSpec) if not spec.slow]
    header: list[str] = []
    for tag_m, spread_deg, noise in product((0.05, 0.12), (5.0, 25.0), ((0.05, 0.0), (0.3, 0.5), (0.5, 1.0))):
        rates: dict[str, list[float]] = {}
        for number in range(station.calibrations):
            how = MarkerSet(tag_m=tag_m, spread_deg=spread_deg, box_m=0.3 if spread_deg > 10 else 0.15)
            recording = noisy(station, number, how, *noise, seed)
            offered = preparation.prepare(recording).offers()
            able = [spec for spec in specs if spec.needs <= offered]
            for answer in solving.solve(recording, able, solving.Options(seed=seed, held_out=False)):
                rates.setdefault(answer.solver, []).extend(
                    _predictions(station, number, answer.parent_T_camera)
                )
        if not header:
            header = sorted(rates)
            print("| tag mm | spread deg | corner px | robot mm |", " | ".join(header), "|")
            print("|---" * (4 + len(header)) + "|")
        cells_text = [
            f"{100 * np.mean(rates[name][0::2]):.0f}/{100 * np.mean(rates[name][1::2]):.0f}"
            for name in header
        ]
        print(
            f"| {1e3 * tag_m:g} | {spread_deg:g} | {noise[0]:g} | {noise[1]:g} |", " | ".join(cells_text), "|"
        )


def noisy(
    station: cells.Station, number: int, how: MarkerSet, corner_px: float, robot_mm: float, seed: int
) -> Recording:
    """A marker recording by projection, with noise on corners and robot poses (0.1 deg for each `robot_mm`)."""
    rng = np.random.default_rng([seed, number, 5])
    carried = station.flange_tag(number)
    carried = FlangeTag(
        AprilTagTarget(carried.target.family, carried.target.id, how.tag_m), carried.flange_T_tag
    )
    joints = np.array(recordings.tag_joints(station, number, carried, how, rng)[: how.samples])
    base_T_camera = station.camera_pose(number)
    exact = recordings.described(station, f"noisy_{number:02d}", joints, base_T_camera, how.camera)
    assert exact.base_T_flange is not None
    tag_poses = se3.inverse(base_T_camera) @ exact.base_T_flange @ carried.flange_T_tag
    corners = np.array([tag_edges.project(how.camera, pose, carried.target.points_m) for pose in tag_poses])
    count = len(joints), 3
    wobble = se3.from_rotvec(
        np.deg2rad(rng.normal(0, 0.1 * robot_mm, count)), rng.normal(0, 1e-3 * robot_mm, count)
    )
    return replace(
        exact,
        target=carried.target,
        corners_px=corners + rng.normal(0, corner_px, corners.shape),
        base_T_flange=exact.base_T_flange @ wobble,
    )


def _predictions(station: cells.Station, number: int, base_T_camera: np.ndarray | None) -> list[bool]:
    """Grasp, insertion, grasp, ... at every place; a missing answer fails."""
    if base_T_camera is None:
        return [False] * 6
    calibration = Calibration(str(number), "", number, base_T_camera)
    true_pose = station.camera_pose(number)
    return [
        predicted(task, calibration, true_pose, station.workpiece_pose(place), station.gripper)
        for place in range(3)
        for task in Task
    ]


def vs060(urdf: str, out: Path) -> None:
    """Marker calibrations of the VS060 by every fast solver, as a store for `hecbench trial --station vs060`."""
    station = cells.station("vs060", urdf)
    specs = [spec for spec in registry.load().ready(Kind.SOLVER, SolverSpec) if not spec.slow]
    with store.writing(out, resume=False) as writer:
        for number in range(station.calibrations):
            recording = recordings.marker_recording(number, station=station)
            able = [spec for spec in specs if spec.needs <= preparation.prepare(recording).offers()]
            answers = solving.solve(recording, able)
            writer.append(
                replace(answer, suite="lab", level="vs060", item=f"{number:06d}") for answer in answers
            )


def main() -> None:
    """Run what is named."""
    what = sys.argv[1] if len(sys.argv) > 1 else ""
    if what in ("contact", "tag", "conditions"):
        {"contact": contact, "tag": tag, "conditions": conditions}[what]()
    elif what == "pictures" and len(sys.argv) == 3:
        from hecbench_hardware.lab import pictures

        station = cells.ur5e()
        truth = Calibration("07", "truth", 7, station.camera_pose(7))
        for task in Task:
            pictures.write(Path(sys.argv[2]), task, truth, station, place=1)
    elif what == "vs060" and len(sys.argv) == 4:
        vs060(sys.argv[2], Path(sys.argv[3]))
    else:
        sys.exit(__doc__)


if __name__ == "__main__":
    main()
