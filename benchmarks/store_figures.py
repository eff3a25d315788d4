"""Sum up stores of `hecbench run` and `hecbench trial` into JSON that docs pages are written from.

Run: ``python benchmarks/store_figures.py NAME STORE... --out docs/data/FILE.json``. The figures of NAME in FILE are
replaced. Of runs, for each level and solver: how many answered, how many were right and wrong, the errors of the
camera, and seconds. Of trials, for each task and method: successes, of all that were to be made. Rates have 95 %
intervals, medians and means those of the bootstrap.
"""

from __future__ import annotations

from pathlib import Path

import click
import figures_file
import numpy as np

from hecbench import statistics
from hecbench.estimate import Status
from hecbench.report import maskless, scores
from hecbench.storage import store, trial_record
from hecbench.storage.trial_record import Outcome


def rate(flags, of=None):
    """Successes, out of how many, and the interval of the share."""
    count = of or len(flags)
    found = statistics.wilson(sum(flags), count)
    return {"successes": int(sum(flags)), "n": count, "interval": [round(found.low, 4), round(found.high, 4)]}


def spread(values):
    """Median and mean with their intervals, quartiles, and the largest."""
    values = np.asarray(values, float)
    if not len(values):
        return None
    middle, mean = statistics.bootstrap(values, np.median), statistics.bootstrap(values)
    quartiles = np.percentile(values, [25, 75])
    return {
        "median": [float(f"{number:.4g}") for number in (middle.value, middle.low, middle.high)],
        "mean": [float(f"{number:.4g}") for number in (mean.value, mean.low, mean.high)],
        "quartiles": [float(f"{number:.4g}") for number in quartiles],
        "largest": float(f"{values.max():.4g}"),
    }


def of_runs(runs):
    """The figures of the runs of one solver on one level."""
    answered = scores.answered(runs)
    right = [maskless.outcome(run) is maskless.Outcome.RIGHT for run in answered]
    return {
        "answered": rate([run.status is Status.OK for run in runs]),
        "right": rate(right, len(runs)),
        "wrong": len(answered) - sum(right),
        "near": rate([scores.within(run, *scores.SUCCESSES[0]) for run in runs]),
        "base_in_camera_mm": spread([run.errors[scores.ERROR] for run in answered]),
        "camera_centre_mm": spread([run.errors["translation_error_mm"] for run in answered]),
        "rotation_rad": spread([np.deg2rad(run.errors["rotation_error_deg"]) for run in answered]),
        "seconds_median": round(float(np.median([run.seconds for run in runs])), 3),
    }


def of_trials(trials, planned):
    """The figures of the trials of one method at one task; a calibration without an answer makes none."""
    successes = [trial.outcome is Outcome.SUCCESS for trial in trials]
    calibrations = [trial.calibration for trial in trials]
    cluster = statistics.cluster_bootstrap(successes, calibrations)
    return {
        "success": rate(successes, max(planned, len(trials))),
        "trials": len(trials),
        "calibrations": len(set(calibrations)),
        "interval_by_calibration": [round(cluster.low, 4), round(cluster.high, 4)],
        "margin_mm": spread([trial.margin_mm for trial in trials if trial.margin_mm is not None]),
    }


def grouped(items, key):
    """Items by the words that `key` gives, joined."""
    found = {}
    for item in items:
        found.setdefault(", ".join(key(item)), []).append(item)
    return dict(sorted(found.items()))


def figures(folders, planned):
    """The figures of all stores, and where they come from."""
    found, sources = {}, []
    for folder in folders:
        if (folder / "trials.jsonl").exists():
            items = trial_record.read(folder).trials
            for name, group in grouped(items, lambda t: (t.robot, t.task, t.method)).items():
                found[name] = of_trials(group, planned)
        else:
            items = store.read(folder).estimates
            for name, group in grouped(items, lambda run: (run.level or run.recording, run.solver)).items():
                found[name] = of_runs(group)
        sources += [item.provenance for item in items]
    said = {
        key: sorted({str(source[key]) for source in sources if source.get(key) is not None})
        for key in ("command", "seed")
    }
    return {"figures": found, "from": {**said, **figures_file.version()}}


@click.command(help=__doc__.splitlines()[0])
@click.argument("name")
@click.argument(
    "stores", nargs=-1, required=True, type=click.Path(path_type=Path, exists=True, file_okay=False)
)
@click.option("--out", required=True, type=click.Path(path_type=Path, dir_okay=False))
@click.option("--planned", default=0, help="Trials of each task that were to be made.")
def main(name, stores, out, planned):
    figures_file.replace(out, {name: figures(stores, planned)})


if __name__ == "__main__":
    main()
