"""Masks and cameras by the network, on recordings that it was not trained on.

Run: ``python benchmarks/perception_figures.py masks|cameras RECORDING... --name NAME --out FILE.json``. The recordings
need joints, a robot model, intrinsics, images and a true camera; ``--lab SEED`` draws the virtual lab's 18 instead. A
run replaces the figures of its name in FILE.
"""

from __future__ import annotations

import argparse
import json
import sys
import time
from dataclasses import replace
from pathlib import Path

import figures_file
import msgspec
import numpy as np
from hecbench_plugins.perception.card import ModelCard, read_network, write_card
from hecbench_plugins.perception.card_text import PERCEPTION, write_page
from hecbench_plugins.regression.card import WORDS, RegressionCard

from hecbench import registry, se3
from hecbench.estimate import Status
from hecbench.preparation import load_recording, prepare, segmented
from hecbench.report.maskless import RIGHT_DEG, RIGHT_MM
from hecbench.running import solving
from hecbench.specs import Kind, SolverSpec
from hecbench.statistics import bootstrap, wilson

HELD_MARGIN = 0.22
"""Of the board's extent, around board and flange: what a robot holds is not in its model."""


WITHOUT_MASKS = ("keypoints", "regression")
"""Solvers that need neither masks nor a start."""


def laboratory(seed):
    """The virtual lab's 18 cells as `hecbench run lab --level photographs` draws them, 10 views each."""
    from hecbench_hardware.lab.recordings import photograph_recording

    return [photograph_recording(calibration, seed) for calibration in range(18)]


def truth_masks(recording):
    """The robot drawn at the true camera, for each sample."""
    from hecbench_plugins.views.silhouettes import Silhouettes

    silhouettes = Silhouettes(recording)
    return {int(i): silhouettes.draw(int(i), recording.truth_parent_T_camera) for i in silhouettes.samples}


def counted(recording, sample):
    """Where masks are compared: everywhere but around a board that is held."""
    area = np.ones((recording.camera.height, recording.camera.width), bool)
    corners = None if recording.corners_px is None else recording.corners_px[sample]
    if corners is not None and np.isfinite(corners).any():
        import cv2

        corners = corners[np.isfinite(corners).all(1)]
        camera_T_flange = (
            se3.inverse(recording.truth_parent_T_camera) @ prepare(recording).base_T_flange[sample]
        )
        p = camera_T_flange[:3, 3]
        K = recording.camera.K
        flange, _ = cv2.projectPoints(p[None], np.zeros(3), np.zeros(3), K, recording.camera.distortion)
        points = np.vstack([corners, flange.reshape(1, 2)])
        margin = HELD_MARGIN * (corners.max(0) - corners.min(0)).max()
        x0, y0, x1, y1 = np.r_[points.min(0) - margin, points.max(0) + margin].clip(0, 1e5).astype(int)
        area[y0:y1, x0:x1] = False
    return area


def masks(recording, segmenter):
    """Overlaps with the truth, outside of what is held and everywhere, and CPU seconds per picture."""
    began = time.process_time()
    found = segmented(recording, segmenter)
    seconds = (time.process_time() - began) / len(recording)
    if found.refusal:
        return {"refused": found.refusal}
    outside, everywhere = [], []
    for sample, truth in truth_masks(recording).items():
        mask, area = found.recording.mask(sample), counted(recording, sample)
        everywhere.append((mask & truth).sum() / (mask | truth).sum())
        outside.append((mask & truth & area).sum() / max(1, ((mask | truth) & area).sum()))
    return {"outside": outside, "everywhere": everywhere, "seconds": seconds}


def summary(values):
    interval = bootstrap(values)
    return {
        "n": len(values),
        "mean": round(interval.value, 4),
        "interval": [round(interval.low, 4), round(interval.high, 4)],
        "median": round(float(np.median(values)), 4),
        "percentile_5": round(float(np.percentile(values, 5)), 4),
        "least": round(float(np.min(values)), 4),
    }


def away(truth, metres, degrees, rng):
    """A start that is off by exactly so much, in random directions."""
    turn, shift = rng.normal(size=(2, 3))
    moved = truth @ se3.from_rotvec(np.deg2rad(degrees) * turn / np.linalg.norm(turn), np.zeros(3))
    moved[:3, 3] += metres * shift / np.linalg.norm(shift)
    return moved


def cameras(recording, name, options):
    """Errors in mm and deg of each draw of some views; None where there is no answer."""
    known = {}
    if options.keep and options.keep.exists():
        lines = map(json.loads, options.keep.read_text().splitlines())
        known = {line["draw"]: line["row"] for line in lines if line["of"] == [name, recording.name]}
    for draw in range(options.draws):
        if draw not in known:
            known[draw] = camera(recording, draw, options)
            if options.keep:
                line = json.dumps({"of": [name, recording.name], "draw": draw, "row": known[draw]})
                with options.keep.open("a") as kept:
                    kept.write(line + "\n")
    return [known[draw] for draw in range(options.draws)]


def camera(recording, draw, options):
    """Errors in mm and deg from views and a start that are drawn; None where there is no answer."""
    spec = registry.load().get(Kind.SOLVER, options.solver, SolverSpec)
    rng = np.random.default_rng((options.seed, draw))
    views = np.sort(rng.permutation(len(recording))[: options.views])
    start = away(recording.truth_parent_T_camera, options.start[0], options.start[1], rng)
    part = replace(recording.subset(views), initial_parent_T_camera=start, corners_px=None, target=None)
    settings = solving.Options(seed=draw, segmenter=options.segmenter)
    estimate = next(iter(solving.solve(part, [spec], settings)))
    if estimate.status is not Status.OK:
        print(f"{recording.name} draw {draw}: {estimate.status} {estimate.reason}", file=sys.stderr)
        return None
    T, truth = estimate.parent_T_camera, recording.truth_parent_T_camera
    mm = 1e3 * float(se3.translation_error_m(truth, T))
    deg = float(np.rad2deg(se3.rotation_error_rad(truth, T)))
    print(
        f"{recording.name} draw {draw}: {mm:.1f} mm {deg:.2f} deg, {estimate.seconds:.0f} s", file=sys.stderr
    )
    return mm, deg


def camera_summary(rows):
    answered = [row for row in rows if row is not None]
    right = sum(mm < RIGHT_MM and deg < RIGHT_DEG for mm, deg in answered)
    rate = wilson(right, len(rows))
    found = {"n": len(rows), "answered": len(answered), "right": right}
    found["right_interval"] = [round(rate.low, 3), round(rate.high, 3)]
    if answered:
        found["median_mm"], found["median_deg"] = np.round(np.median(answered, 0), 2).tolist()
        for place, name in enumerate(("mm", "deg")):
            interval = bootstrap([row[place] for row in answered], np.median)
            if np.isfinite(interval.low):
                found[f"median_{name}_interval"] = [round(interval.low, 2), round(interval.high, 2)]
        found["worst_mm"], found["worst_deg"] = np.round(np.max(answered, 0), 2).tolist()
    return found


def main():
    options = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    options.add_argument("what", choices=("masks", "cameras"))
    options.add_argument("recordings", nargs="*", type=Path)
    options.add_argument("--lab", type=int, metavar="SEED", help="photographs of the virtual lab")
    options.add_argument("--out", type=Path, required=True)
    options.add_argument("--name", required=True, help="of the group of recordings")
    options.add_argument("--segmenter", default="learned")
    options.add_argument("--solver", default="keypoints")
    options.add_argument("--views", type=int, default=10)
    options.add_argument("--draws", type=int, default=20, help="of each recording")
    options.add_argument("--start", type=float, nargs=2, default=(0.1, 8.0), metavar=("M", "DEG"))
    options.add_argument("--seed", type=int, default=0)
    options.add_argument(
        "--keep", type=Path, help="a line for each camera; what stands there is not run again"
    )
    options.add_argument("--card", type=Path, help="folder of the network, whose card gets the figures, too")
    o = options.parse_args()
    recordings = [load_recording(path) for path in o.recordings] or laboratory(o.lab)
    if o.what == "masks":
        name = f"masks, {o.name}, {o.segmenter}"
        each = [masks(recording, o.segmenter) for recording in recordings]
        figures = {
            where: summary([v for one in each for v in one[where]])
            for where in ("outside", "everywhere")
            if all(where in one for one in each)
        }
        figures["cpu_seconds_per_picture"] = round(
            float(np.median([one.get("seconds", np.nan) for one in each])), 3
        )
    else:
        if o.solver.startswith(WITHOUT_MASKS):
            o.segmenter = None
        given = f", masks {o.segmenter}, start {o.start[0]} m {o.start[1]} deg" if o.segmenter else ""
        name = f"cameras, {o.name}, {o.solver}, {o.views} views{given}"
        figures = camera_summary([row for recording in recordings for row in cameras(recording, name, o)])
    figures |= {"command": figures_file.command(), **figures_file.version(), "seed": o.seed}
    figures_file.replace(o.out, {name: figures})
    print(name, json.dumps(figures, indent=1))
    if o.card:
        kind, words = (
            (RegressionCard, WORDS) if o.solver.startswith("regression") else (ModelCard, PERCEPTION)
        )
        card, _ = read_network(o.card, kind)
        card = msgspec.structs.replace(card, figures=card.figures | {name: figures})
        write_card(o.card, card)
        write_page(o.card, card, words)


if __name__ == "__main__":
    main()
