"""Images older or younger than their robot poses by a constant time, also where both carry the same stamps."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from hecbench import se3
from hecbench.diagnose.case import Examination
from hecbench.diagnose.finding import Finding, Severity
from hecbench.diagnose.fit import EXPLAINS, LEAST_SAMPLES
from hecbench.se3 import Array
from hecbench.system.wording import significant

ID = "clock_lag"
_LEAST = 12
_DENSE = 0.35
"""Step between neighbouring samples over the whole motion, below which the arm is followed along its way."""
_FARTHEST = 4.0
_STEP = 0.1
"""Of the typical interval: how far and how finely lags are tried."""
_BETTER = 0.7
"""Ratio of residuals below which a lag counts as found."""
_LEAST_S = 0.01
_UNITS = {1e17: (1e9, "ns"), 1e14: (1e6, "us"), 1e11: (1e3, "ms")}
"""Smallest stamps since 1970 in each unit, and how many of it a second has."""
_LEAST_GAPS = 4
_LONGEST_S = 600.0
"""No arm rests longer between two samples."""
_CRAWL_M_S = 1e-3
"""No arm is moved more slowly along a way that is filmed; whole numbers are asked for too."""
_USUAL_S = {True: 0.05, False: 5.0}
"""Between the samples of a film, and of poses of their own."""


def examine(case: Examination) -> tuple[Finding | None, Examination]:
    """The unit of the stamps; then the lag at which hand and target turn alike, confirmed by the calibration."""
    recording = case.recording
    stamps, poses = recording.robot_stamp_s, recording.base_T_flange
    if stamps is None or poses is None or not case.can_be_fitted:
        return None, case
    if unit := _unit(stamps, poses):
        summary = f"the stamps are in {unit[1]}, not in seconds: {unit[2]}"
        action = f"divide robot_stamp_s and camera_stamp_s by {unit[0]:g}"
        return Finding(ID, Severity.CRITICAL, summary, action, unit[0], 1.0), _in_seconds(case, unit[0])
    times, hand, seen = _stream(case, stamps)
    if len(times) < _LEAST or not _is_dense(hand):
        return None, case
    lag_s = _best_lag(times, hand, seen)
    if abs(lag_s) < _LEAST_S:
        return Finding(
            ID, Severity.OK, f"hand and target turn at the same time, to {_LEAST_S:g} s", value=0.0
        ), case
    return _confirmed(case, stamps, lag_s)


def _unit(stamps: Array, poses: Array) -> tuple[float, str, str] | None:
    """How many of their unit a second has, its name and what shows it; None for stamps in seconds.

    Stamps since 1970 show it by their size, those from a start of their own by how long one sample lasts.
    """
    known = np.isfinite(stamps) & np.isfinite(poses).all((1, 2))
    order = np.flatnonzero(known)[np.argsort(stamps[known], kind="stable")]
    if not len(order):
        return None
    for least, (per_second, name) in _UNITS.items():
        if np.median(stamps[order]) > least:
            return per_second, name, f"the first is {stamps[order[0]]:.6g}"
    order = order[np.append(True, np.diff(stamps[order]) > 0)]
    if len(order) < _LEAST_GAPS:
        return None
    gap, way = float(np.median(np.diff(stamps[order]))), poses[order]
    dense = _is_dense(way)
    crawls = dense and not np.mod(stamps[order], 1).any() and _speed_m_s(way, stamps[order]) < _CRAWL_M_S
    if gap < _LONGEST_S and not crawls:
        return None
    usual_s = _USUAL_S[dense]
    per_second, name = min(_UNITS.values(), key=lambda unit: abs(np.log(gap / unit[0] / usual_s)))
    return per_second, name, f"one sample would last {gap:.6g} s"


def _speed_m_s(way: Array, times: Array) -> float:
    return float(np.median(se3.translation_error_m(way[1:], way[:-1]) / np.diff(times)))


def _in_seconds(case: Examination, per_second: float) -> Examination:
    recording = case.recording
    changes = {
        name: values / per_second
        for name in ("robot_stamp_s", "camera_stamp_s")
        if (values := getattr(recording, name)) is not None
    }
    return replace(case, recording=replace(recording, **changes))


def _stream(case: Examination, stamps: Array) -> tuple[Array, Array, Array]:
    """Times (M,) s, base_T_flange and camera_T_target (M, 4, 4) m of the usable samples in the order of time."""
    known = np.flatnonzero(np.isfinite(stamps[case.usable]))
    order = known[np.argsort(stamps[case.usable][known], kind="stable")]
    order = order[np.append(True, np.diff(stamps[case.usable][order]) > 0)] if len(order) else order
    return stamps[case.usable][order], case.base_T_flange[order], case.camera_T_target[order]


def _is_dense(hand: Array) -> bool:
    """Whether neighbouring samples lie on one way, not at poses of their own."""
    turned = se3.rotation_angle(np.swapaxes(hand[:, :3, :3], 1, 2)[:, None] @ hand[:, :3, :3])
    steps = np.diagonal(turned, 1)
    return bool(np.median(steps) < _DENSE * np.median(turned))


def interpolated(times: Array, hand: Array, at: Array) -> Array:
    """Poses (K, 4, 4) at times (K,) between those of a stream (M, 4, 4); NaN outside it."""
    before = np.clip(np.searchsorted(times, at, side="right") - 1, 0, len(times) - 2)
    share = (at - times[before]) / (times[before + 1] - times[before])
    steps = se3.log(se3.inverse(hand[before]) @ hand[before + 1])
    poses = hand[before] @ se3.exp(share[:, None] * steps)
    return np.where(((at >= times[0]) & (at <= times[-1]))[:, None, None], poses, np.nan)


def _best_lag(times: Array, hand: Array, seen: Array) -> float:
    """The lag s at which the angles by which hand and target turn between samples differ least."""
    interval = float(np.median(np.diff(times)))
    strides = [k for k in (1, 2, 3, 5, 8) if k < len(times) / 2]

    def misfit(lag_s: float) -> float:
        moved = interpolated(times, hand, times + lag_s)
        gaps = [
            se3.rotation_error_rad(moved[:-k], moved[k:]) - se3.rotation_error_rad(seen[:-k], seen[k:])
            for k in strides
        ]
        return float(np.nanmedian(np.abs(np.concatenate(gaps))))

    lags = interval * np.arange(-_FARTHEST, _FARTHEST + _STEP / 2, _STEP)
    return float(min(lags, key=lambda lag_s: (misfit(lag_s), abs(lag_s))))


def _confirmed(case: Examination, stamps: Array, lag_s: float) -> tuple[Finding | None, Examination]:
    times, hand, seen = _stream(case, stamps)
    moved = interpolated(times, hand, times + lag_s)
    inside = np.isfinite(moved).all((1, 2))
    if inside.sum() <= LEAST_SAMPLES:
        return None, case
    fit = case.fit_of(moved[inside], seen[inside])
    as_given = np.inf if case.fit is None else case.fit.typical_px
    if fit is None or fit.relative > EXPLAINS or fit.typical_px > _BETTER * as_given:
        summary = (
            f"no constant lag between images and robot poses explains more; {lag_s:+.2f} s comes nearest"
        )
        return Finding(ID, Severity.OK, summary, value=0.0, limit=_LEAST_S), case
    older = "older" if lag_s < 0 else "younger"
    summary = (
        f"the images are {abs(lag_s):.3f} s {older} than their robot poses: at that time the typical sample fits to "
        f"{significant(fit.typical_px)} px, as given to {significant(as_given, 3)} px"
    )
    when = "earlier" if lag_s < 0 else "later"
    action = f"take the robot poses {abs(lag_s):.3f} s {when}, or stop the arm for samples"
    order = np.argsort(stamps[case.usable], kind="stable")
    rows = np.searchsorted(stamps[case.usable][order], times[inside])
    kept = case.recording.subset(case.usable[order[rows]])
    cured = replace(
        case, recording=replace(kept, base_T_flange=moved[inside], joints_rad=None, robot_stamp_s=None)
    )
    return Finding(ID, Severity.CRITICAL, summary, action, abs(lag_s), _LEAST_S), cured
