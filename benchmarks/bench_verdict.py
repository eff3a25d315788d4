"""The verdict against the truth it never sees: choice, interval and grade, on generated, real and faulty recordings.

Run: ``python benchmarks/bench_verdict.py [--recordings 200] [--seed 1000] [--keep FILE] [KIND ...]``. Kinds: the
presets of the suite `markers`, ``lab-LEVEL`` (markers or photographs of the suite `lab`), ``real-N`` (N samples drawn
from the recording given by --real), ``fault-NAME``, ``lens`` (the distortion of the camera forgotten), ``size`` (K of
another image size) and ``cameras`` (every second sample of another camera). A line for each kind: how often the
recommended answer is within 1.5 x the best method + 0.5 mm, how often the 95 % interval holds the true error, and the
grades; rates with their 95 % intervals. With ``--keep`` each recording is a line of a file, and what stands there is
not measured again. A recording costs one to four seconds of a core, one of the lab thirty, all kinds at 200 hours.
"""

import argparse
import json
import os
from collections import Counter
from dataclasses import asdict, dataclass, replace
from pathlib import Path

os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")
os.environ.setdefault("OMP_NUM_THREADS", "1")
os.environ.setdefault("HECBENCH_THREADS", "1")

import numpy as np
from hecbench_datasets.suites.synthetic_markers import make
from hecbench_datasets.synthetic_faults import FAULTS, arm_recording
from joblib import Parallel, delayed

from hecbench import preparation, registry, se3
from hecbench.recording import Mounting
from hecbench.robots.model import load_robot
from hecbench.running import calibrating, planning
from hecbench.running.solving import Options
from hecbench.specs import Kind, SuiteSpec
from hecbench.statistics import wilson
from hecbench.verdict import Grade
from hecbench.workspace import apart_m, points_in_parent

PRESETS = ("tag_2m", "small_tag_2m", "board_2m")
LAB = ("lab-markers", "lab-photographs")
REAL = tuple(f"real-{count}" for count in (8, 12, 20, 40))
SEEDED = {f"fault-{name.replace(' ', '-')}": fault for name, fault in FAULTS.items() if fault.critical}
WRONG = (*SEEDED, "lens", "size", "cameras")
DISTORTION = np.array([-0.3, 0.1, 0.001, -0.001, 0.0])
"""Of a usual 6 mm lens, forgotten in the kind ``lens``."""
TWICE_TOLERANCE_MM = 10.0
OTHER_CAMERA = 10_000
"""Added to an item's index for the camera that its samples are mixed with in the kind ``cameras``."""


@dataclass(frozen=True)
class Row:
    """One recording: what was said, and what is true."""

    grade: Grade
    error_mm: float
    best_mm: float
    covered: bool


def recording_of(kind, index, real, seed):
    """A recording with its truth."""
    rng = np.random.default_rng([seed, index])
    if kind in PRESETS:
        return make(kind, index, seed)
    if kind.startswith("real-"):
        whole = replace(preparation.load_recording(real), images=None)
        count = int(kind.removeprefix("real-"))
        return whole.subset(np.sort(rng.choice(len(whole), min(count, len(whole)), replace=False)))
    if kind in LAB:
        lab = registry.load().get(Kind.SUITE, "lab", SuiteSpec)
        return lab.make(kind.removeprefix("lab-"), index, seed)
    if kind == "cameras":
        good, other = make("board_2m", index, seed), make("board_2m", index + OTHER_CAMERA, seed)
        corners_px, poses = good.corners_px.copy(), good.base_T_flange.copy()
        corners_px[1::2], poses[1::2] = other.corners_px[1::2], other.base_T_flange[1::2]
        return replace(good, corners_px=corners_px, base_T_flange=poses, camera_T_target=None)
    if kind == "lens":
        good = make("board_2m", index, seed)
        return replace(good, corners_px=with_distortion(good), camera_T_target=None)
    if kind == "size":
        good = make("board_2m", index, seed)
        K = good.camera.K * np.array([[1.5], [1.5], [1.0]])
        return replace(good, camera=replace(good.camera, K=K), camera_T_target=None)
    fault = SEEDED[kind]
    good = arm_recording(load_robot("ur5e"), rng) if fault.needs_joints else make("board_2m", index, seed)
    good = preparation.prepare(good) if fault.needs_target_poses else good
    return fault.seed(good, rng)


def with_distortion(recording):
    """The corners as a lens with `DISTORTION` shows them."""
    import cv2

    shape = recording.corners_px.shape
    rays = (recording.corners_px.reshape(-1, 2) - recording.camera.K[:2, 2]) / np.diag(recording.camera.K)[:2]
    points = np.c_[rays, np.ones(len(rays))]
    pixels, _ = cv2.projectPoints(points, np.zeros(3), np.zeros(3), recording.camera.K, DISTORTION)
    return pixels.reshape(shape)


def measured(kind, index, real, seed):
    """The verdict on one recording against its truth."""
    recording = recording_of(kind, index, real, seed)
    blind = recording.without_truth()
    examined = calibrating.examine(blind)
    photographs = kind == "lab-photographs"
    specs = [spec for spec in planning.solvers_for((), blind) if photographs or not spec.slow]
    estimates = calibrating.solved(examined, specs, Options(stop_on_bad_input=False))
    found = calibrating.judged(examined, specs, estimates)
    poses = examined.segmented.recording.base_T_flange
    points_m = points_in_parent(poses, recording.mounting is Mounting.EYE_IN_HAND)
    errors_mm = {
        e.solver: 1e3 * float(apart_m(e.parent_T_camera, recording.truth_parent_T_camera, points_m))
        for e in estimates
        if e.parent_T_camera is not None and se3.is_transform(e.parent_T_camera)
    }
    if found.recommended is None:
        return Row(found.grade, np.inf, min(errors_mm.values(), default=np.inf), False)
    error_mm, expected = errors_mm[found.recommended.solver], found.expected
    covered = expected is not None and bool(expected.low <= error_mm <= expected.high)
    return Row(found.grade, error_mm, min(errors_mm.values()), covered)


def rate(flags):
    """A share with its interval."""
    found = wilson(sum(flags), len(flags))
    return f"{100 * found.value:.1f} % [{100 * found.low:.1f}, {100 * found.high:.1f}]"


def kept_rows(keep, kind, seed):
    """The rows of a kind and seed that a file holds, by index."""
    lines = keep.read_text().splitlines() if keep and keep.exists() else []
    known = [line for line in map(json.loads, lines) if (line["kind"], line["seed"]) == (kind, seed)]
    return {line["index"]: Row(**line["row"] | {"grade": Grade(line["row"]["grade"])}) for line in known}


def all_rows(kind, count, jobs, real, seed, keep):
    """The rows of a kind; new ones are added to the file as they come."""
    rows = kept_rows(keep, kind, seed)
    missing = [index for index in range(count) if index not in rows]
    found = Parallel(n_jobs=jobs, return_as="generator")(
        delayed(measured)(kind, index, real, seed) for index in missing
    )
    for index, row in zip(missing, found, strict=True):
        rows[index] = row
        if keep:
            line = {"kind": kind, "seed": seed, "index": index, "row": asdict(row)}
            with keep.open("a") as stream:
                stream.write(json.dumps(line, default=float) + "\n")
    return [rows[index] for index in range(count)]


def campaign(kind, rows):
    """Print the line of a kind."""
    grades = Counter(str(row.grade) for row in rows)
    if kind in WRONG:
        caught = rate([row.grade in (Grade.DOUBTFUL, Grade.DO_NOT_USE) for row in rows])
        print(f"{kind:28} n {len(rows):4}  doubtful or worse {caught}  {dict(grades)}", flush=True)
        return
    near = rate([row.error_mm <= 1.5 * row.best_mm + 0.5 for row in rows])
    covered = rate([row.covered for row in rows])
    wrongly = sum(row.grade is Grade.GOOD and row.error_mm > TWICE_TOLERANCE_MM for row in rows)
    median = np.median([row.error_mm for row in rows])
    print(
        f"{kind:28} n {len(rows):4}  near the best {near}  interval holds {covered}  median error {median:.2g} mm  "
        f"good above twice the tolerance {wrongly}  {dict(grades)}",
        flush=True,
    )


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("kinds", nargs="*", metavar="KIND")
    parser.add_argument("--recordings", type=int, default=200)
    parser.add_argument("--jobs", type=int, default=1)
    parser.add_argument("--seed", type=int, default=1000)
    parser.add_argument("--keep", type=Path)
    parser.add_argument(
        "--real", type=Path, default=Path(__file__).parents[2] / "shared" / "data" / "ur3e_cam1"
    )
    arguments = parser.parse_args()
    for each in arguments.kinds or (*PRESETS, *LAB, *REAL, *WRONG):
        counted = (arguments.recordings, arguments.jobs, arguments.real, arguments.seed, arguments.keep)
        campaign(each, all_rows(each, *counted))
