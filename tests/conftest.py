"""Fixtures for every test."""

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
