"""Fixtures for every test."""

import shutil
from pathlib import Path

import numpy as np
import pytest

from hecbench.conformance import rig
from hecbench.recording import Mounting

SHARED_DATA = Path(__file__).resolve().parents[2] / "shared"


@pytest.fixture(scope="session")
def shared():
    """The folder with real recordings beside the checkout."""
    if not (SHARED_DATA / "data").is_dir():
        pytest.skip("the real recordings (../shared) are not beside this checkout")
    return SHARED_DATA


@pytest.fixture
def rng():
    return np.random.default_rng(7)


@pytest.fixture(params=list(Mounting))
def exact_rig(request):
    """An exact recording in each mounting."""
    return rig(np.random.default_rng(3), request.param)


@pytest.fixture(scope="module")
def browser(tmp_path_factory):
    """Chromium, driven; skipped where it or its driver is absent."""
    webdriver = pytest.importorskip("selenium.webdriver")
    programs = [shutil.which(name) for name in ("chromium", "chromium-browser", "google-chrome")]
    driver = shutil.which("chromedriver")
    if driver is None or not any(programs):
        pytest.skip("needs Chromium and chromedriver")
    options = webdriver.ChromeOptions()
    options.binary_location = next(filter(None, programs))
    profile = tmp_path_factory.mktemp("profile")
    for argument in (
        "--headless=new",
        "--no-sandbox",
        "--enable-unsafe-swiftshader",
        f"--user-data-dir={profile}",
    ):
        options.add_argument(argument)
    options.set_capability("goog:loggingPrefs", {"browser": "ALL"})
    started = webdriver.Chrome(options=options, service=webdriver.ChromeService(driver))
    yield started
    started.quit()
