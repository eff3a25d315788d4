"""Images paired with the wrong robot poses: shifted, sorted otherwise, or some exchanged."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from hecbench.diagnose.case import STANDS_OUT, Examination
from hecbench.diagnose.finding import Finding, Severity, names
from hecbench.diagnose.fit import EXPLAINS, LEAST_SAMPLES, MUCH_BETTER
from hecbench.diagnose.sequences import shifts, text_orders
from hecbench.system.wording import significant

ID = "pairing"
_SHIFTS = (1, -1)
_LEAST_RUN = 2
"""Samples that disagree with a calibration that explains the others, before runs of them are looked for."""
_FITS = 2 * STANDS_OUT
_FAR_BETTER = 0.02
"""With the wrong robot pose a planar target may have got its mirrored pose, which then still fits badly."""


def examine(case: Examination) -> tuple[Finding | None, Examination]:
    """Residuals with the robot poses shifted or in another order; then exchanges among the samples that disagree."""
    if not case.can_be_fitted or len(case.usable) <= LEAST_SAMPLES:
        return None, case
    for attempt in (_all_shifted, _in_text_order, _partly_shifted, _swapped):
        if (found := attempt(case)) is not None:
            return found
    as_given = np.inf if case.fit is None else case.fit.typical_px
    return Finding(ID, Severity.OK, "no shift or exchange of robot poses fits better", value=as_given), case


def _all_shifted(case: Examination) -> tuple[Finding, Examination] | None:
    as_given = np.inf if case.fit is None else case.fit.typical_px
    for shift in _SHIFTS:
        target, robot = _shifted(len(case.usable), shift)
        moved = case.fit_of(case.base_T_flange[robot], case.camera_T_target[target])
        if moved is not None and moved.cures(case.fit):
            which = "next" if shift > 0 else "previous"
            summary = (
                f"every image belongs to the robot pose of the {which} sample: the typical sample then fits to "
                f"{significant(moved.typical_px)} px, as given to {significant(as_given, 3)} px"
            )
            action = f"shift the robot poses by one against the images; drop the {'last' if shift > 0 else 'first'}"
            value, limit = moved.typical_px, MUCH_BETTER * as_given
            finding = Finding(ID, Severity.CRITICAL, summary, action, value, limit)
            return finding, _repaired(case, target, robot)
    return None


def _in_text_order(case: Examination) -> tuple[Finding, Examination] | None:
    for says, order in text_orders(len(case.usable)):
        sorted_otherwise = case.fit_of(case.base_T_flange[order], case.camera_T_target)
        if sorted_otherwise is not None and sorted_otherwise.cures(case.fit):
            summary = f"{says}: sorted alike the typical sample fits to {significant(sorted_otherwise.typical_px)} px"
            action = "number the files with leading zeros, or sort both by number"
            finding = Finding(ID, Severity.CRITICAL, summary, action, sorted_otherwise.typical_px)
            return finding, _repaired(case, np.arange(len(order)), order)
    return None


def _partly_shifted(case: Examination) -> tuple[Finding, Examination] | None:
    """Images of which some belong to robot poses a few rows off: a row was missed in one stream."""
    explained = case.fit is not None and case.fit.relative < EXPLAINS
    if explained and case.agreed is not None and (~case.agreed[1]).sum() < _LEAST_RUN:
        return None
    moves = shifts(case)
    if moves is None:
        return None
    runs = np.split(np.arange(len(moves)), np.flatnonzero(np.diff(moves)) + 1)
    described = [
        f"by {abs(moves[run[0]])} from sample {case.ids(run[:1])[0]} on (the pose of each image stands "
        f"{abs(moves[run[0]])} rows {'below' if moves[run[0]] > 0 else 'above'} it)"
        for run in runs
        if moves[run[0]]
    ]
    concerned = case.ids(np.flatnonzero(moves))
    summary = f"the robot poses are shifted against the images {'; '.join(described)}"
    action = "pair images and robot poses anew: one stream has rows that the other lacks"
    finding = Finding(ID, Severity.CRITICAL, summary, action, float(len(concerned)), 0.0, concerned)
    robot = np.arange(len(moves)) + moves
    paired = np.flatnonzero((robot >= 0) & (robot < len(moves)))
    paired = paired[
        np.unique(robot[paired], return_index=True)[1]
    ]  # images whose own row is missing come second
    return finding, _repaired(case, paired, robot[paired])


def _swapped(case: Examination) -> tuple[Finding, Examination] | None:
    swaps = _exchanged(case)
    if not swaps:
        return None
    order = np.arange(len(case.usable))
    for a, b in swaps:
        order[[a, b]] = b, a
    concerned = case.ids(np.array(swaps).ravel())
    pairs = "; ".join(f"{' and '.join(case.ids(np.array(pair)))}" for pair in swaps)
    summary = f"the robot poses of samples {pairs} are exchanged: each fits the image of the other"
    action = f"exchange the robot poses of {names(concerned)}"
    finding = Finding(ID, Severity.CRITICAL, summary, action, float(len(swaps)), 0.0, concerned)
    return finding, _repaired(case, np.arange(len(order)), order)


def _shifted(count: int, shift: int) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Indices of the images, and of the robot poses that belong to them."""
    first, second = np.arange(count - 1), np.arange(1, count)
    return (first, second) if shift > 0 else (second, first)


def _exchanged(case: Examination) -> list[tuple[int, int]]:
    """Pairs of samples that disagree as given and agree with each other's robot pose."""
    if case.agreed is None:
        return []
    found, agreeing = case.agreed
    odd, before = np.flatnonzero(~agreeing), found.studentised(agreeing)
    pairs: list[tuple[int, int]] = []
    taken: set[int] = set()
    for k, a in enumerate(odd.tolist()):
        for b in odd[k + 1 :].tolist():
            if {a, b} & taken:
                continue
            poses = case.base_T_flange
            poses[[a, b]] = poses[[b, a]]
            crossed = found.with_robot_poses(poses)
            after = crossed.studentised(agreeing)[[a, b]]
            if (after < np.maximum(_FITS, _FAR_BETTER * before[[a, b]])).all():
                pairs.append((a, b))
                taken |= {a, b}
    return pairs


def _repaired(case: Examination, target: NDArray[np.int64], robot: NDArray[np.int64]) -> Examination:
    """The case in which images `target` have the robot poses `robot`, both indices of usable samples."""
    observed = case.observed
    poses = observed.present.base_T_flange[case.usable[robot]]
    kept = replace(case.recording.subset(case.usable[target]), base_T_flange=poses, joints_rad=None)
    return replace(case, recording=kept)
