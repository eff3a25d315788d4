"""Made-up results of studies whose every number is known, and pages in a browser."""

import json

import numpy as np
import pytest

from hecbench import registry, se3
from hecbench.estimate import Estimate, Status, Termination
from hecbench.report import html, pictures
from hecbench.running import calibrating
from hecbench.running.solving import Options
from hecbench.specs import Kind, SolverSpec, SuiteSpec


def make_run(
    solver,
    level,
    item,
    error_mm=1.0,
    *,
    suite="paper",
    rad=None,
    in_frame=None,
    start_mm=100.0,
    floor_mm=None,
    status=Status.OK,
    lost=False,
    costs=(),
):
    """One result that ends at the identity, the truth being `error_mm` and `rad` away from there.

    An error of None has no answer and tells no end; `lost` has none either, but tells where the robot was lost.
    """
    rad = (error_mm or 0.0) / 500 if rad is None else rad
    truth = se3.from_rotvec([rad, 0, 0], [(error_mm or 0.0) / 1e3, 0, 0])
    start = se3.make(truth[:3, :3], truth[:3, 3] + [0, start_mm / 1e3, 0])
    origin = {
        "recording_sha256": f"{level} {item}",
        "seed": 0,
        "truth_parent_T_camera": truth.tolist(),
        "initial_parent_T_camera": start.tolist(),
    }
    if floor_mm is not None:
        origin["facts"] = {"correspondence_floor_mm": floor_mm}
    place = {"suite": suite, "level": level, "item": f"{item}", "solver": solver, "provenance": origin}
    if error_mm is None:
        status = Status.FAILED if status is Status.OK else status
        return Estimate(status=status, reason="lost", termination=Termination.STALLED, seconds=2.0, **place)
    left = np.linspace(1, 0, max(len(costs), 2))
    way = se3.log(start)
    path = [[f"step {i}", cost, (left[i] * way).tolist()] for i, cost in enumerate(costs or (None, 1.0))]
    diagnostics = {"path": path} | ({} if in_frame is None else {"in_frame": in_frame})
    if lost:
        return Estimate(
            status=Status.FAILED,
            reason="the robot left the picture",
            termination=Termination.OUT_OF_FRAME,
            diagnostics=diagnostics | {"in_frame": False},
            iterations=700,
            seconds=2.0,
            **place,
        )
    errors = {
        "camera_T_parent_translation_error_mm": error_mm,
        "translation_error_mm": error_mm,
        "tre_mm": error_mm,
        "rotation_error_deg": np.rad2deg(rad),
    }
    return Estimate(
        se3.exp(np.zeros(6)), errors=errors, diagnostics=diagnostics, iterations=2000, seconds=2.0, **place
    )


@pytest.fixture(scope="session")
def run_of():
    """Makes one result of a study."""
    return make_run


def study_runs(count=20, seed=0):
    """All studies of suite `paper` and the maskless ones, with plausible numbers drawn at random."""
    rng = np.random.default_rng(seed)
    lost = {"drhec": 0.05, "drhec_rgbc": 0.15, "drhec_rgb": 0.5, "easyhec": 0.2, "ipe": 0.2}
    levels = {"LP": 0.4, "MP": 1.0, "HP": 1.5}
    runs = []

    def drawn(solver, level, item, share, spread, **more):
        gone = rng.random() < share
        error = float(rng.uniform(200, 1500) if gone else spread * rng.lognormal(0, 0.5))
        length = 60
        costs = 0.02 * np.exp(-np.linspace(0, 1.0 if gone else 6.0, length) * rng.uniform(0.8, 1.2)) + 1e-5
        start = rng.uniform(60, 120) * (1 + 2 * levels.get(level, 0.4)) + 80 * gone
        out = bool(gone and rng.random() < 0.6)
        more |= {"in_frame": True, "lost": out, "start_mm": float(start), "costs": costs.tolist()}
        return make_run(solver, level, item, error, **more)

    for level, hardness in levels.items():
        for base, share in lost.items():
            for variant in ("literal", "resolved"):
                extra = 0.6 if variant == "literal" else 1.0
                for item in range(count):
                    name = f"{base}[variant={variant}]"
                    runs.append(
                        drawn(name, level, item, min(0.9, share * hardness * (2 - extra)), 0.3 / extra)
                    )
        runs += [make_run("render_gn", level, item, 0.006, start_mm=150.0) for item in range(count)]
        runs.append(make_run("ipe[variant=literal]", level, count, None))
    for option, values in (
        ("lambda_cen", (0, 0.1, 0.01, 0.001, 0.0001)),
        ("lambda_area", (0, 0.1, 0.01, 0.001, 0.0001)),
        ("threshold", (0, 0.2, 0.25, 0.3, 0.5)),
    ):
        for value in values:
            name = f"drhec[{option}={value:g}]"
            runs += [drawn(name, option, item, 0.1 + 0.05 * (value == 0), 0.5) for item in range(count)]
    for level, floor in (("mismatch_1", 10.0), ("mismatch_3", 31.0), ("mismatch_5", 55.0)):
        for item in range(count):
            known = float(floor * rng.lognormal(0, 0.3))
            runs.append(make_run("drhec", level, item, known * 1.1, floor_mm=known))
    for level in ("views_3", "views_5", "gain", "noise"):
        runs += [
            drawn(name, level, item, 0.05, 0.4) for name in ("drhec", "easyhec") for item in range(count)
        ]
    for suite, level in (("maskless_real", "5_views_0.1m_10deg"), ("maskless_real", "5_views_0.2m_20deg")):
        for item in range(count):
            error = (
                None if item == 3 else 60.0 if item == 5 and "0.2m" in level else float(rng.uniform(3, 10))
            )
            status = Status.REFUSED if item % 2 else Status.FAILED
            runs.append(make_run("render_gn", level, item, error, suite=suite, rad=0.01, status=status))
    return runs


@pytest.fixture(scope="session")
def studies():
    """Results of all studies."""
    return study_runs(count=6)


class Screen:
    """A browser's window on a page."""

    def __init__(self, browser):
        self._browser = browser

    def at_size(self, width, height):
        """Headless windows have a least width; the device metrics have none."""
        metrics = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": width < 600}
        self._browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", metrics)

    def open(self, page):
        self._browser.get(page.as_uri())

    def errors(self):
        return [entry for entry in self._browser.get_log("browser") if entry["level"] == "SEVERE"]

    def run(self, script):
        return self._browser.execute_script(script)

    def bottom(self, selector):
        return self.run(
            f"return document.querySelector({json.dumps(selector)}).getBoundingClientRect().bottom"
        )


@pytest.fixture
def screen(browser):
    return Screen(browser)


@pytest.fixture(scope="session")
def photographs():
    return registry.load().get(Kind.SUITE, "photographs", SuiteSpec).make("ur3e", 0, 0)


@pytest.fixture(scope="session")
def calibrated():
    """Makes the page of a recording calibrated by some solvers, in a folder."""

    def make(folder, recording, names):
        specs = [registry.load().get(Kind.SOLVER, name, SolverSpec) for name in names]
        examined = calibrating.examine(recording.without_truth())
        estimates = calibrating.solved(examined, specs, Options())
        found = calibrating.judged(examined, specs, estimates)
        calibrating.Calibration(found, examined.evidence()).save(folder)
        pictures.write(examined.segmented.recording, found.recommended, folder)
        return html.write(folder).path

    return make
