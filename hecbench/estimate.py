"""What a solver answers, with its evidence; the schema ``hecbench.estimate/1``."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from enum import StrEnum
from pathlib import Path
from typing import Any, Literal

import msgspec
import numpy as np

from hecbench import se3
from hecbench.errors import InputError, InvalidAnswer, SolverFailure
from hecbench.lens import OPENCV, CameraModel
from hecbench.recording import Mounting
from hecbench.se3 import Array
from hecbench.system import files

SCHEMA = "hecbench.estimate/1"


class Status(StrEnum):
    """Whether there is an answer. Only `ok` has one."""

    OK = "ok"
    REFUSED = "refused"
    FAILED = "failed"
    TIMEOUT = "timeout"


class Termination(StrEnum):
    """Why the computation ended."""

    CLOSED_FORM = "closed_form"
    CONVERGED = "converged"
    MAX_ITERATIONS = "max_iterations"
    STALLED = "stalled"
    OUT_OF_FRAME = "out_of_frame"
    NOT_RUN = "not_run"


@dataclass(frozen=True, eq=False)
class Estimate:
    """An answer. A solver fills the first block; the runner adds where it came from and what the evaluators say.

    Attributes:
        parent_T_camera: (4, 4) m; parent = base (eye_to_hand) or flange (eye_in_hand). None unless ok.
        carrier_T_target: (4, 4) m, flange_T_target or base_T_target, when the method gives it.
        covariance: (6, 6) of [phi rad, rho m] in ``X_true = exp([phi, rho]) @ X_est``, or None.
        termination: why the computation ended.
        iterations: of the main loop; 0 for closed forms.
        renders: images drawn.
        diagnostics: evidence, JSON values by name.
        extras: other unknowns solved for, JSON values by name.
        suite, item, level: where in a suite it belongs, set by `run`.
    """

    parent_T_camera: Array | None = None
    carrier_T_target: Array | None = None
    covariance: Array | None = None
    termination: Termination = Termination.CLOSED_FORM
    iterations: int = 0
    renders: int = 0
    diagnostics: Mapping[str, Any] = field(default_factory=dict)
    extras: Mapping[str, Any] = field(default_factory=dict)

    solver: str = ""
    recording: str = ""
    mounting: Mounting = Mounting.EYE_TO_HAND
    parent_link: str = "base"
    camera: CameraModel | None = None
    status: Status = Status.OK
    reason: str | None = None
    seconds: float = 0.0
    errors: Mapping[str, float] | None = None
    held_out: Mapping[str, Any] | None = None
    provenance: Mapping[str, Any] = field(default_factory=dict)
    suite: str | None = None
    item: str | None = None
    level: str | None = None

    def __post_init__(self) -> None:
        if (self.status is Status.OK) != (self.parent_T_camera is not None):
            raise InvalidAnswer(
                f"estimate: status '{self.status}' with parent_T_camera {self.parent_T_camera}"
            )
        if self.status is not Status.OK and not self.reason:
            raise InvalidAnswer(f"estimate: status '{self.status}' needs a reason")
        for name in ("parent_T_camera", "carrier_T_target"):
            if (pose := getattr(self, name)) is not None:
                pose = np.asarray(pose, float)
                if pose.shape != (4, 4) or not se3.is_transform(pose):
                    raise InvalidAnswer(f"estimate: {name} is not a rigid transform (4x4, metres)")
                object.__setattr__(self, name, pose)

    @property
    def pose(self) -> Array:
        """parent_T_camera (4, 4) m of an estimate that is ok.

        Raises:
            SolverFailure: there is no answer.
        """
        if self.parent_T_camera is None:
            raise SolverFailure(f"'{self.solver}' has no answer: {self.reason}")
        return self.parent_T_camera

    def to_json(self) -> dict[str, Any]:
        """JSON values in the order of the schema; `suite`, `item` and `level` only when set."""
        camera = self.camera and {
            "width": self.camera.width,
            "height": self.camera.height,
            "K": self.camera.K,
            "distortion": self.camera.distortion,
            "distortion_model": self.camera.distortion_model,
        }
        content = {
            "schema": SCHEMA,
            "solver": self.solver,
            "recording": self.recording,
            "mounting": self.mounting,
            "parent_link": self.parent_link,
            "camera": camera,
            "status": self.status,
            "reason": self.reason,
            "parent_T_camera": self.parent_T_camera,
            "carrier_T_target": self.carrier_T_target,
            "covariance": self.covariance,
            "termination": self.termination,
            "iterations": self.iterations,
            "renders": self.renders,
            "seconds": self.seconds,
            "diagnostics": self.diagnostics,
            "extras": self.extras,
            "errors": self.errors,
            "held_out": self.held_out,
            "provenance": self.provenance,
        }
        place = {"suite": self.suite, "item": self.item, "level": self.level}
        content |= {key: value for key, value in place.items() if value is not None}
        return {key: plain(value) for key, value in content.items()}

    def save(self, path: Path) -> None:
        """Write the JSON file, whole or not at all."""
        files.write_bytes(path, msgspec.json.format(msgspec.json.encode(self.to_json()), indent=1) + b"\n")


@dataclass(frozen=True)
class Metric:
    """A number by which estimates are ordered: where it stands, and what a reader calls it."""

    section: str
    name: str
    label: str
    smaller_is_better: bool = True

    def of(self, estimate: Estimate) -> float | None:
        """The number, or None where the estimate has no answer or was not measured so."""
        value = (getattr(estimate, self.section) or {}).get(self.name)
        return None if estimate.status is not Status.OK or value is None else float(value)


METRICS = (
    Metric("held_out", "target_mm", "held-out prediction of the target, mm"),
    Metric("held_out", "reprojection_px", "held-out prediction of the target, px"),
    Metric("held_out", "contour_px", "held-out distance of the robot's contour, px"),
    Metric("held_out", "mask_iou", "held-out mask IoU", smaller_is_better=False),
    Metric("errors", "tre_mm", "error in the workspace, mm"),
    Metric("errors", "translation_error_mm", "error of the camera centre, mm"),
    Metric("diagnostics", "target_spread_mm", "spread of the target over the samples, mm"),
    Metric("diagnostics", "mask_iou", "mask IoU", smaller_is_better=False),
    Metric("diagnostics", "confirmed_at_end", "share of the contour confirmed", smaller_is_better=False),
)
"""By what estimates are ordered, what is preferred first: predictions, errors against the truth, consistency."""


def ordering_metric(estimates: Sequence[Estimate]) -> Metric | None:
    """The one metric of a table: the first that at least half of the answers have; None when there is none."""
    answered = [estimate for estimate in estimates if estimate.status is Status.OK]
    for metric in METRICS:
        measured = sum(metric.of(estimate) is not None for estimate in answered)
        if measured and 2 * measured >= len(answered):
            return metric
    return None


def best_first(estimates: Sequence[Estimate]) -> list[Estimate]:
    """Sorted by one metric, the same for all; answers without it come next, missing answers last."""
    metric = ordering_metric(estimates)

    def place(estimate: Estimate) -> tuple[int, float]:
        value = None if metric is None else metric.of(estimate)
        if metric is None or value is None:
            return (1 if estimate.status is Status.OK else 2), 0.0
        return 0, value if metric.smaller_is_better else -value

    return sorted(estimates, key=place)


def plain(value: Any) -> Any:
    """The value with numpy types turned into JSON ones; numbers that are not finite become null."""
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    if isinstance(value, np.ndarray | np.generic):
        return plain(value.tolist())
    if isinstance(value, StrEnum):
        return str(value)
    if isinstance(value, float) and not math.isfinite(value):
        return None
    return value


class _CameraJson(msgspec.Struct, forbid_unknown_fields=True):
    width: int
    height: int
    K: list[list[float]] | None = None
    distortion: list[float] = []
    distortion_model: str = OPENCV


class _EstimateJson(msgspec.Struct, forbid_unknown_fields=True, kw_only=True):
    schema: Literal["hecbench.estimate/1"]
    solver: str
    recording: str
    mounting: Mounting
    parent_link: str
    status: Status
    camera: _CameraJson | None = None
    reason: str | None = None
    parent_T_camera: list[list[float]] | None = None
    carrier_T_target: list[list[float]] | None = None
    other_T_target: list[list[float]] | None = None  # carrier_T_target in files of version 0.1
    covariance: list[list[float]] | None = None
    termination: Termination = Termination.CLOSED_FORM
    iterations: int = 0
    renders: int = 0
    seconds: float = 0.0
    diagnostics: dict[str, Any] = {}
    extras: dict[str, Any] = {}
    errors: dict[str, float | None] | None = None
    held_out: dict[str, Any] | None = None
    provenance: dict[str, Any] = {}
    suite: str | None = None
    item: str | None = None
    level: str | None = None


_NOT_VALUES = ("schema", "other_T_target")
_DECODER = msgspec.json.Decoder(_EstimateJson)


def decode(content: bytes, source: str) -> Estimate:
    """An estimate from its JSON bytes; `source` names the file in errors.

    Raises:
        InputError: not JSON, not of the schema, or not consistent.
    """
    try:
        parsed = _DECODER.decode(content)
        values = {name: getattr(parsed, name) for name in parsed.__struct_fields__ if name not in _NOT_VALUES}
        values["carrier_T_target"] = parsed.carrier_T_target or parsed.other_T_target
        if parsed.camera:
            K = parsed.camera.K
            distortion = np.array(parsed.camera.distortion, float)
            size = parsed.camera.width, parsed.camera.height
            intrinsics = None if K is None else np.array(K, float)
            values["camera"] = CameraModel(*size, intrinsics, distortion, parsed.camera.distortion_model)
        if parsed.covariance is not None:
            values["covariance"] = np.array(parsed.covariance, float)
        return Estimate(**values)
    except (msgspec.MsgspecError, InputError, ValueError, UnicodeDecodeError) as error:
        raise InputError(
            f"{source}: is not a {SCHEMA}: {error}; write it again with `hecbench solve --out`"
        ) from error


def load(path: Path) -> Estimate:
    """Read an estimate file.

    Raises:
        InputError: missing, unreadable, or not of the schema.
    """
    return decode(files.read_bytes(path), str(path))
