"""Depth pictures that cannot be read, hold nothing, or are in other units than millimetres."""

from __future__ import annotations

import numpy as np

from hecbench.diagnose.case import Examination
from hecbench.diagnose.finding import Finding, Severity, names
from hecbench.errors import InputError
from hecbench.samples.spread import evenly
from hecbench.system.wording import significant

ID = "depth"
NEAREST_M, FARTHEST_M = 0.15, 12.0
"""The median depth of a picture of a robot cell lies between these."""
_LEAST_KNOWN = 0.05
"""Share of the pixels that have depth; below it the picture says nothing."""
_MOST_EXAMINED = 20
_UNITS = {
    1000.0: "metres",
    100.0: "decimetres",
    10.0: "centimetres",
    0.1: "tenths of a millimetre",
    0.25: "1/4 mm",
}
"""By what the numbers must be multiplied to be millimetres."""
_CURE = "store 16-bit millimetres, 0 where unknown, as samples[].depth, aligned with the colour camera"


def examine(case: Examination) -> tuple[Finding | None, Examination]:
    """Up to 20 pictures, evenly spread: their size and kind, the share of known pixels, and the median of these."""
    recording = case.recording
    indices = [i for i, source in enumerate(recording.depths or ()) if source is not None]
    if not indices:
        return None, case
    faulty, reasons, empty, medians = [], [], [], []
    for i in np.array(indices)[evenly(len(indices), _MOST_EXAMINED)].tolist():
        try:
            depth = recording.depth(i)
        except (InputError, OSError) as error:
            faulty.append(recording.sample_ids[i])
            reasons.append(str(error))
            continue
        known = depth[depth > 0]
        if len(known) < _LEAST_KNOWN * depth.size:
            empty.append(recording.sample_ids[i])
        else:
            medians.append(float(np.median(known)))
    examined = len(faulty) + len(empty) + len(medians)
    if not medians:
        what = reasons[0] if reasons else f"{names(tuple(empty))}: hold no depth"
        return Finding(ID, Severity.CRITICAL, what, _CURE, float(examined), 0.0, (*faulty, *empty)), case
    median_m = float(np.median(medians))
    if not NEAREST_M < median_m < FARTHEST_M:
        fitting = [
            unit for factor, unit in _UNITS.items() if NEAREST_M < factor * median_m < 0.5 * FARTHEST_M
        ]
        says = f": {' or '.join(fitting[:2])} rather than millimetres?" if fitting else ""
        summary = f"the median depth is {significant(1e3 * median_m, 4)} mm{says}"
        return Finding(ID, Severity.CRITICAL, summary, _CURE, median_m, FARTHEST_M), case
    if faulty or empty:
        summary = "; ".join([*reasons[:1], *([f"{names(tuple(empty))}: hold no depth"] if empty else [])])
        concerned = (*faulty, *empty)
        return Finding(ID, Severity.WARNING, summary, _CURE, float(len(concerned)), 0.0, concerned), case
    return Finding(ID, Severity.OK, f"{examined} depth pictures are readable, median {median_m:.2f} m"), case
