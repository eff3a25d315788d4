"""The numbers of the watch."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class WatchSettings:
    """When the watch looks and when it gives alarm.

    Chosen on three sequences of the virtual lab that docs/watch.md does not report; `still_*` and `alarm` also hold for
    the 40 photographs of a real arm at rest, see there.

    Attributes:
        learn_frames: from which the colours, the joints' offsets and the usual noise are learned.
        window_frames: over which evidence is added up: half a second at 10 Hz.
        limit_mm: rms displacement of the workspace against the estimate itself from which on it is not true.
        alarm: mean square of the six standardised offsets, against the first frames, that gives alarm.
        alarm_frames: in a row.
        still_turn_rad, still_shift_m: advanced. Standard deviations of what the picture of a camera at rest pretends:
            errors of the model and of the joints that change with the arm's pose.
        joint_sigma_rad: advanced. Of the arm's constant joint offsets, as in `render_gn`.
        least_confirmed: advanced. Share of the usual confirmed contour below which the robot is taken as hidden.
        least_points: advanced. Contour points below which too little of the robot is in view.
        correlated_points: advanced. Neighbouring contour points that say as much as one, as in `maskless`.
    """

    learn_frames: int = 20
    window_frames: int = 5
    limit_mm: float = 4.0
    alarm: float = 2.5
    alarm_frames: int = 2
    still_turn_rad: float = float(np.deg2rad(0.03))
    still_shift_m: float = 6e-4
    joint_sigma_rad: float = float(np.deg2rad(0.1))
    least_confirmed: float = 0.6
    least_points: int = 300
    correlated_points: float = 30.0
