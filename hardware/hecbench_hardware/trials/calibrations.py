"""The calibrations of a trial: estimate files, the store of a run, or the truth moved by a given distance."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from hecbench import estimate as estimates
from hecbench import se3
from hecbench.errors import InputError
from hecbench.estimate import Estimate, Status
from hecbench.recording import CameraModel, Mounting
from hecbench.se3 import Array
from hecbench.storage import store
from hecbench_hardware.trials import solids, tasks
from hecbench_hardware.trials.cell import Calibration
from hecbench_hardware.trials.tasks import Task

_SUITE = "lab"


def load(path: Path) -> list[tuple[str, Estimate]]:
    """The estimates of a file, or of the store in a folder, each with the words that name it in errors.

    Raises:
        InputError: Nothing readable there.
    """
    if path.is_dir():
        return [
            (f"{path}: {found.solver} on {found.recording}", found) for found in store.read(path).estimates
        ]
    return [(str(path), estimates.load(path))]


def from_estimates(
    paths: Sequence[Path],
    *,
    parent_link: str,
    camera: CameraModel | None,
    number: int | None,
    truth: Callable[[int], Array] | None,
) -> tuple[list[Calibration], list[str]]:
    """What the estimates say, checked against the cell.

    Args:
        paths: Files or folders of stores.
        parent_link: The cell's base.
        camera: The cell's camera; another one makes the estimate useless here.
        number: Which of the cell's calibrations all of them are; None: as their suite says.
        truth: base_T_camera by number, where it is known.

    Returns:
        The calibrations, and one sentence for each estimate without an answer.

    Raises:
        InputError: Of another mounting, parent or camera, or not of this cell.
    """
    found, unanswered = [], []
    for path in paths:
        for name, estimate in load(path):
            if estimate.status is not Status.OK:
                unanswered.append(f"{name}: {estimate.status}, {estimate.reason}")
                continue
            _refuse_foreign(name, estimate, parent_link, camera)
            place = number if number is not None else _number(name, estimate)
            errors = dict(estimate.errors or {})
            if truth is not None:
                errors |= _errors(estimate.pose, truth(place))
            found.append(
                Calibration(estimate.recording, estimate.solver, place, estimate.pose, errors, estimate)
            )
    return found, unanswered


def _refuse_foreign(name: str, estimate: Estimate, parent_link: str, camera: CameraModel | None) -> None:
    if estimate.mounting is not Mounting.EYE_TO_HAND:
        raise InputError(f"{name}: is {estimate.mounting}; trials need a camera beside the arm, eye_to_hand")
    if estimate.parent_link != parent_link:
        raise InputError(
            f"{name}: is given in '{estimate.parent_link}', the cell in '{parent_link}': convert it"
        )
    theirs = estimate.camera
    if camera is None or theirs is None or theirs.K is None or camera.K is None:
        return
    same_size = (theirs.width, theirs.height) == (camera.width, camera.height)
    if not same_size or np.abs(theirs.K - camera.K).max() > 0.05 * camera.K[0, 0]:
        raise InputError(
            f"{name}: is of another camera ({theirs.width}x{theirs.height} px, f {theirs.K[0, 0]:.0f}), the cell has"
            f" {camera.width}x{camera.height} px, f {camera.K[0, 0]:.0f}: name the right estimate or camera"
        )


def _number(name: str, estimate: Estimate) -> int:
    if estimate.suite != _SUITE or estimate.item is None or not estimate.item.isdigit():
        raise InputError(f"{name}: does not say which calibration of the lab it is: give --calibration N")
    return int(estimate.item)


def moved_truth(count: int, truth: Callable[[int], Array], offset_mm: float, seed: int) -> list[Calibration]:
    """The true calibrations, each moved by a distance in a direction drawn evenly."""
    found = []
    for number in range(count):
        direction = np.random.default_rng([seed, number, 3]).normal(size=3)
        shift = offset_mm / 1e3 * direction / np.linalg.norm(direction)
        base_T_camera = se3.make(np.eye(3), shift) @ truth(number)
        errors = _errors(base_T_camera, truth(number))
        found.append(Calibration(f"{number:02d}", f"truth + {offset_mm:g} mm", number, base_T_camera, errors))
    return found


def predicted(
    task: Task, calibration: Calibration, true_pose: Array, base_T_workpiece: Array, gripper: solids.Gripper,
    clearance_m: float = solids.CLEARANCE_M,
) -> bool:  # fmt: skip
    """Whether the formula lets a trial succeed when nothing but the calibration is wrong."""
    moved = calibration.base_T_camera @ se3.inverse(true_pose) @ base_T_workpiece
    end = se3.inverse(base_T_workpiece) @ moved @ tasks.workpiece_T_tool(task)
    return tasks.closed_form(task, end, gripper, clearance_m).success


def _errors(base_T_camera: Array, truth: Array) -> dict[str, float]:
    return {
        "translation_error_mm": 1e3 * float(se3.translation_error_m(base_T_camera, truth)),
        "rotation_error_deg": float(np.degrees(se3.rotation_error_rad(base_T_camera, truth))),
    }
