"""Our solvers beside KinHEC's own on the sequences of a KinHEC dataset, in one table.

    pip install kinhec
    kinhec generate --tier smoke --out data_smoke && kinhec benchmark data_smoke
    python benchmarks/bench_kinhec.py data_smoke

KinHEC's protocol: keyframes 5 degrees or 20 mm apart, at most 200; the error is that of its X, which is
flange_T_camera for a camera on the hand and flange_T_target for a fixed one. A run without an answer counts as
infinitely wrong. Medians per track, mm over degrees.
"""

from __future__ import annotations

import csv
import sys
from collections import defaultdict
from pathlib import Path

import numpy as np
from hecbench_datasets.formats import kinhec

from hecbench import registry, se3
from hecbench.errors import InputError
from hecbench.recording import Mounting
from hecbench.running import solving
from hecbench.samples.spread import evenly
from hecbench.specs import Kind, SolverSpec

SOLVERS = ("andreff", "daniilidis", "horaud", "li", "park", "shah", "single3d_iterative", "tsai")
LEAST_TURN_RAD, LEAST_STEP_M, MOST_KEYFRAMES = np.deg2rad(5.0), 0.02, 200


def keyframes(poses):
    """Indices of poses that differ from the last kept one, thinned evenly to the most allowed."""
    kept = [0]
    for i, pose in enumerate(poses):
        last = poses[kept[-1]]
        if (
            se3.rotation_error_rad(last, pose) > LEAST_TURN_RAD
            or se3.translation_error_m(last, pose) > LEAST_STEP_M
        ):
            kept.append(i)
    return [kept[i] for i in evenly(len(kept), MOST_KEYFRAMES)]


def errors_of_X(recording, estimate, X_true):
    """(deg, mm) of KinHEC's X, infinite without an answer."""
    X_est = estimate.parent_T_camera
    if X_est is None:
        return np.inf, np.inf
    if recording.mounting is Mounting.EYE_TO_HAND:
        X_est = estimate.carrier_T_target
        if X_est is None:
            flange_T_base = se3.inverse(recording.base_T_flange)
            X_est = se3.mean(flange_T_base @ estimate.parent_T_camera @ recording.camera_T_target)
    return (
        float(np.rad2deg(se3.rotation_error_rad(X_est, X_true))),
        1e3 * float(se3.translation_error_m(X_est, X_true)),
    )


def ours(root, names):
    """Errors (deg, mm) by solver and track."""
    specs = [registry.load().get(Kind.SOLVER, name, SolverSpec) for name in names]
    found = defaultdict(list)
    for sequence, X_true in kinhec.true_X(root).items():
        track = sequence.partition("-")[0]
        try:
            recording = kinhec.load(root / sequence)
        except InputError as error:
            print(error, file=sys.stderr)
            continue
        recording = recording.subset(keyframes(recording.base_T_flange))
        for estimate in solving.solve(recording, specs, solving.Options(held_out=False)):
            found[f"hecbench {estimate.solver}", track].append(errors_of_X(recording, estimate, X_true))
    return found


def theirs(root):
    """The errors that `kinhec benchmark` wrote, with the true clock offset."""
    found = defaultdict(list)
    file = root / "benchmarks" / "results.csv"
    if not file.is_file():
        sys.exit(f"{file}: missing; run `kinhec benchmark {root}` first")
    with file.open(newline="") as stream:
        for row in csv.DictReader(stream):
            if row["eval_sync"] == "oracle":
                errors = [float(row[key] or "inf") for key in ("X_rot_err_deg", "X_trans_err_mm")]
                found[f"kinhec {row['solver']}", row["track"]].append(errors)
    return found


def main(root):
    """Print the table as Markdown."""
    found = ours(root, SOLVERS) | theirs(root)
    tracks = sorted({track for _, track in found})
    counts = {track: max(len(errors) for (_, t), errors in found.items() if t == track) for track in tracks}
    print("| solver | " + " | ".join(f"{track} ({counts[track]})" for track in tracks) + " |")
    print("|---" * (len(tracks) + 1) + "|")
    for solver in dict.fromkeys(solver for solver, _ in found):
        cells = []
        for track in tracks:
            deg, mm = np.median(found.get((solver, track), [(np.inf, np.inf)]), axis=0)
            cells.append(f"{mm:.3g} / {deg:.2g}")
        print(f"| {solver} | " + " | ".join(cells) + " |")


if __name__ == "__main__":
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    main(Path(sys.argv[1]))
