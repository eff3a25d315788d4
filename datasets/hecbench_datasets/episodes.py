"""The camera of every episode of a LeRobot dataset, and in which episodes it stands elsewhere."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import msgspec
import numpy as np

from hecbench import se3
from hecbench.errors import InputError
from hecbench.estimate import Estimate, Status
from hecbench.running import runner
from hecbench.running.solving import Options
from hecbench.storage import recording_io
from hecbench.system import files
from hecbench_datasets.formats import lerobot
from hecbench_datasets.reading.lerobot_files import description

_DRIFT_MM, _DRIFT_DEG = 10.0, 1.0
"""Nearer ones may be the scatter of the estimates."""
_SIGMAS = 3.0


@dataclass(frozen=True)
class Camera:
    """Where the camera stood in one episode.

    Attributes:
        status: of the estimate.
        parent_T_camera: 4x4 m, None unless ok.
        off_mm, off_deg: from the place that most episodes agree on.
        drifted: whether that is more than 10 mm or 1 deg, and more than three standard deviations.
    """

    episode: str
    solver: str
    status: str
    reason: str | None
    parent_T_camera: list[list[float]] | None = None
    off_mm: float | None = None
    off_deg: float | None = None
    drifted: bool = False


def as_recordings(root: Path, camera: str | None, folder: Path, jobs: int) -> tuple[list[Path], list[str]]:
    """A native recording of each episode below a folder, those there kept; and why the others are none."""
    from joblib import Parallel, delayed

    info = description(root)
    key = lerobot.camera_key(root, info, camera)
    count = int(info["total_episodes"])
    done = Parallel(n_jobs=jobs)(delayed(_as_recording)(root, key, i, folder) for i in range(count))
    return [found for found in done if isinstance(found, Path)], [
        fault for fault in done if isinstance(fault, str)
    ]


def _as_recording(root: Path, key: str, index: int, folder: Path) -> Path | str:
    place = folder / f"episode_{index:06d}"
    try:
        if not recording_io.is_recording(place):
            recording_io.save(lerobot.load(root / key / place.name), place)
    except InputError as error:
        return str(error)
    return place


def calibrated(
    recordings: Sequence[Path],
    solvers: Sequence[str],
    out: Path,
    jobs: int = 1,
    executor: str | None = None,
    seed: int = 0,
    resume: bool = False,
) -> list[Camera]:
    """The camera of each recording, also written to OUT/cameras.json.

    Raises:
        InputError: there is no recording, or OUT holds results and is not to be resumed.
    """
    if not recordings:
        raise InputError(f"{out}: no episode could be read, so there is nothing to calibrate")
    tasks = [runner.Task(tuple(solvers), path=place) for place in recordings]
    options = Options(seed=seed, held_out=False)
    estimates = runner.run(tasks, options, out=out, jobs=jobs, executor=executor, resume=resume).estimates
    found = [one for solver in solvers for one in compared([e for e in estimates if e.solver == solver])]
    content = msgspec.json.encode([asdict(one) for one in found])
    files.write_bytes(out / "cameras.json", msgspec.json.format(content) + b"\n")
    return found


def compared(estimates: Sequence[Estimate]) -> list[Camera]:
    """The cameras of one solver, by the place that is nearest to all others (the medoid)."""
    ordered = sorted(estimates, key=lambda estimate: str(estimate.item))
    answered = [e for e in ordered if e.status is Status.OK and e.parent_T_camera is not None]
    poses = np.array([e.parent_T_camera for e in answered]).reshape(-1, 4, 4)
    usual = None
    if len(poses):
        distances = np.array([se3.translation_error_m(pose, poses).sum() for pose in poses])
        usual = poses[int(distances.argmin())]
    return [_camera(estimate, usual) for estimate in ordered]


def _camera(estimate: Estimate, usual: Any) -> Camera:
    name = Path(str(estimate.item)).name
    if estimate.parent_T_camera is None or estimate.status is not Status.OK:
        return Camera(name, estimate.solver, str(estimate.status), estimate.reason)
    pose = np.asarray(estimate.parent_T_camera)
    off_mm = 1e3 * float(se3.translation_error_m(usual, pose))
    off_deg = float(np.rad2deg(se3.rotation_error_rad(usual, pose)))
    limit_mm, limit_deg = _DRIFT_MM, _DRIFT_DEG
    if estimate.covariance is not None:
        variances = np.diag(np.asarray(estimate.covariance))
        limit_deg = max(limit_deg, _SIGMAS * float(np.rad2deg(np.sqrt(variances[:3].sum()))))
        limit_mm = max(limit_mm, _SIGMAS * 1e3 * float(np.sqrt(variances[3:].sum())))
    drifted = off_mm > limit_mm or off_deg > limit_deg
    return Camera(name, estimate.solver, str(estimate.status), None, pose.tolist(), off_mm, off_deg, drifted)


def rows(cameras: Sequence[Camera]) -> tuple[tuple[str, ...], ...]:
    """Cells of a table of cameras."""

    def cells(one: Camera) -> tuple[str, ...]:
        if one.parent_T_camera is None:
            return (one.episode, one.solver, one.status, "", "", "", one.reason or "")
        place = " ".join(f"{1e3 * row[3]:.1f}" for row in one.parent_T_camera[:3])
        return (
            *(one.episode, one.solver, one.status, place, f"{one.off_mm:.1f}", f"{one.off_deg:.2f}"),
            "moved" if one.drifted else "",
        )

    return tuple(cells(one) for one in cameras)
