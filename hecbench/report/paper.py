"""What the DRHeC paper reports, for tables that stand beside it.

DRHeC, IEEE Transactions on Instrumentation and Measurement 75:7505816, 2026, doi 10.1109/TIM.2026.3712913. Metres are
turned into millimetres.
"""

from __future__ import annotations

from typing import NamedTuple

LEVELS = ("LP", "MP", "HP")
RUNS_PER_LEVEL, ABLATION_RUNS, MISMATCH_RUNS, PCK_POSES = 200, 20, 20, 20

METHODS = {
    "easyhec": "EasyHeC",
    "easyhecpp": "EasyHeC++",
    "ipe": "IPE",
    "drhec_rgb": "RGB",
    "drhec_rgbc": "RGBC",
    "drhec": "DRHeC",
}
"""The paper's name of a solver, by the solver's name without its options."""

ORDER = ("drhec", "drhec_rgbc", "drhec_rgb")
"""From the best to the worst in the paper's Table I: what the centroid and area losses are worth."""


class Spread(NamedTuple):
    """One row of Table I."""

    q1_mm: float
    q3_mm: float
    largest_mm: float
    mean_mm: float
    mean_rad: float
    success_pct: float


TABLE_ONE = {
    "LP": {
        "EasyHeC": Spread(0.2, 0.5, 1128.2, 8.9, 0.0122, 91.5),
        "IPE": Spread(0.8, 2.1, 8.4, 1.6, 0.0095, 100.0),
        "RGB": Spread(0.2, 103.7, 1870.3, 341.9, 0.3254, 79.0),
        "RGBC": Spread(0.1, 0.3, 1.2, 0.3, 0.0013, 100.0),
        "DRHeC": Spread(0.2, 0.3, 1.3, 0.3, 0.0012, 100.0),
    },
    "MP": {
        "EasyHeC": Spread(0.5, 357.0, 1894.0, 281.5, 0.2899, 91.5),
        "IPE": Spread(3.4, 157.3, 1497.7, 146.9, 0.2719, 96.5),
        "RGB": Spread(711.2, 1694.5, 2199.4, 1257.2, 1.0278, 28.5),
        "RGBC": Spread(0.2, 293.3, 1597.2, 186.2, 0.1703, 99.0),
        "DRHeC": Spread(0.2, 0.9, 1993.7, 76.6, 0.0930, 99.0),
    },
    "HP": {
        "EasyHeC": Spread(29.3, 1343.2, 1986.2, 657.2, 0.6508, 71.0),
        "IPE": Spread(72.9, 496.5, 1872.2, 405.5, 0.5866, 83.5),
        "RGB": Spread(1339.9, 1810.5, 2161.4, 1520.4, 1.1892, 11.0),
        "RGBC": Spread(0.5, 406.8, 1809.5, 332.3, 0.3124, 97.5),
        "DRHeC": Spread(0.5, 210.3, 1626.9, 149.5, 0.2187, 99.5),
    },
}

PCK_THRESHOLDS_PX = (20, 30, 40, 50, 100, 150, 200)
TABLE_TWO: dict[str, tuple[float | None, ...]] = {
    "DREAM": (0.16, 0.23, 0.29, 0.33, 0.52, 0.62, 0.64),
    "OK": (0.34, 0.54, 0.66, 0.69, 0.88, 0.93, 0.95),
    "IPE (box)": (None, None, None, 0.65, 0.94, 0.95, 0.95),
    "IPE (cylinder)": (None, None, None, 0.80, 0.91, 0.93, 0.95),
    "IPE (CAD)": (None, None, None, 0.74, 0.90, 0.95, 0.95),
    "EasyHeC": (0.35, 0.55, 0.75, 0.90, 0.95, 0.95, 1.0),
    "EasyHeC++": (0.50, 0.75, 0.75, 0.85, 0.90, 0.95, 1.0),
    "DRHeC": (0.65, 0.75, 0.90, 1.0, 1.0, 1.0, 1.0),
}
"""Share of Baxter poses whose end-effector falls within each threshold."""

TABLE_THREE = {
    "cyclegan": (294.35, 3.19, 0.9300, 23.68, 0.9725),
    "cut": (354.60, 3.46, 0.9284, 22.76, 0.9680),
    "geomaskgan": (304.74, 3.26, 0.9286, 23.54, 0.9705),
    "cyclegan_mask": (292.12, 3.19, 0.9350, 23.70, 0.9722),
}
"""Translator -> MSE and MAE of 255, IoU, PSNR, SSIM of translated photographs."""

TABLE_NINE = {
    "without": (0.0099, 0.0162, 0.6111, 20.88, 0.9477),
    "with": (0.0026, 0.0053, 0.8520, 25.95, 0.9727),
}
"""The same without and with DRHeC's translation, MSE and MAE of 1."""

ABLATIONS: dict[str, tuple[str, dict[float, tuple[float, float]]]] = {
    "lambda_cen": (
        "VI",
        {
            0.0: (86.06, 0.0),
            0.1: (10.67, 0.04),
            0.01: (5.05, 0.02),
            0.001: (158.62, 0.03),
            0.0001: (188.10, 0.0),
        },
    ),
    "lambda_area": (
        "VII",
        {
            0.0: (134.86, 0.05),
            0.1: (111.17, 0.11),
            0.01: (21.81, 0.01),
            0.001: (16.99, 0.04),
            0.0001: (2.30, 0.01),
        },
    ),
    "threshold": (
        "VIII",
        {
            0.0: (183.83, 0.02),
            0.2: (18.32, 0.02),
            0.25: (13.65, 0.01),
            0.3: (28.23, 0.03),
            0.5: (150.11, 0.07),
        },
    ),
}
"""Option of `drhec` -> number of the table, and mean mm and mean rad of each value."""

DEFAULTS = {"lambda_cen": 0.01, "lambda_area": 0.0001, "threshold": 0.25}

MISMATCH = {0: (7.41, 0.0197), 1: (21.92, 0.0190), 3: (53.05, 0.0287), 5: (86.13, 0.0396)}
"""DRHeC: percent by which the geometry is off -> mean mm and mean rad."""

SECONDS_PER_1000 = {"DRHeC": 7.19, "EasyHeC": 7.18, "IPE": 78.25}
"""Seconds per 1,000 iterations on an RTX 4090."""
