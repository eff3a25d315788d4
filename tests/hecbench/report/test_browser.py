"""The page in a real browser: no error on the console, the verdict without scrolling, tables that sort."""

import json
from pathlib import Path

import numpy as np
import pytest

from hecbench import conformance, preparation, registry
from hecbench.recording import Mounting
from hecbench.report import html, pictures
from hecbench.running import calibrating
from hecbench.running.solving import Options
from hecbench.specs import Kind, SolverSpec, SuiteSpec


def calibrated(folder: Path, recording, names):
    specs = [registry.load().get(Kind.SOLVER, name, SolverSpec) for name in names]
    examined = calibrating.examine(recording.without_truth())
    estimates = calibrating.solved(examined, specs, Options())
    found = calibrating.judged(examined, specs, estimates)
    calibrating.Calibration(found, examined.evidence()).save(folder)
    pictures.write(examined.segmented.recording, found.recommended, folder)
    return html.write(folder).path


@pytest.fixture(scope="module")
def photographs():
    return registry.load().get(Kind.SUITE, "photographs", SuiteSpec).make("ur3e", 0, 0)


def at_size(browser, width, height):
    """Headless windows have a least width; the device metrics have none."""
    metrics = {"width": width, "height": height, "deviceScaleFactor": 1, "mobile": width < 600}
    browser.execute_cdp_cmd("Emulation.setDeviceMetricsOverride", metrics)


def errors(browser):
    return [entry for entry in browser.get_log("browser") if entry["level"] == "SEVERE"]


def bottom(browser, selector):
    return browser.execute_script(
        f"return document.querySelector({json.dumps(selector)}).getBoundingClientRect().bottom"
    )


def test_a_board_recording_with_photographs(browser, photographs, tmp_path):
    page = calibrated(tmp_path, photographs, ["bundle", "shah", "park", "li"])
    assert page.stat().st_size < 3e6
    at_size(browser, 1280, 800)
    browser.get(page.as_uri())
    assert not errors(browser)
    for selector in (".grade", ".expect", "dl.pose", ".viewer img"):
        assert 0 < bottom(browser, selector) <= 800
    loaded = browser.execute_script(
        "return [...document.images].every(i => i.complete && i.naturalWidth > 0)"
    )
    assert loaded
    images = "return [...document.querySelectorAll('.viewer img')].map(i => i.hidden)"
    browser.execute_script("document.querySelectorAll('.viewer button')[2].click()")
    assert [i for i, hidden in enumerate(browser.execute_script(images)) if not hidden] == [2]
    _sorts(browser)
    links = "return [...document.querySelectorAll('nav a')].every(a => document.querySelector(a.getAttribute('href')))"
    assert browser.execute_script(links)


def _sorts(browser):
    """A click on the last column orders its rows by that number."""
    values = browser.execute_script(
        "const table = document.querySelector('table.sortable');"
        "const heads = table.tHead.rows[0].cells; heads[heads.length - 1].click();"
        "return [...table.tBodies[0].rows].map(r => parseFloat(r.cells[heads.length - 1].textContent))"
    )
    assert values == sorted(values)
    assert len(values) > 2


def test_a_narrow_screen(browser, photographs, tmp_path):
    page = calibrated(tmp_path, photographs.subset(range(8)), ["bundle", "shah"])
    at_size(browser, 380, 800)
    browser.get(page.as_uri())
    assert not errors(browser)
    assert browser.execute_script("return document.documentElement.scrollWidth") <= 380
    assert bottom(browser, ".expect") <= 800


def test_a_recording_without_photographs_shows_no_viewer(browser, tmp_path):
    rig = conformance.rig(np.random.default_rng(1), Mounting.EYE_IN_HAND, noise=1e-4)
    page = calibrated(tmp_path, preparation.prepare(rig), ["shah", "park"])
    browser.get(page.as_uri())
    assert not errors(browser)
    assert browser.execute_script("return document.querySelector('.viewer')") is None
    assert "rings" not in page.read_text().split("<h2>")[0]
