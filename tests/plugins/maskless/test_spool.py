"""Pictures in a temporary file come back as they were, from every thread, and leave nothing behind."""

import os
import tempfile

import numpy as np
import pytest
from hecbench_plugins.views.spool import Spool

from hecbench.errors import HecbenchError
from hecbench.system import threads


def test_pictures_come_back_as_they_were(rng, tmp_path, monkeypatch):
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    pictures = rng.integers(0, 255, (9, 5, 7, 3), dtype=np.uint8)
    spool = Spool.of(lambda number: pictures[number], len(pictures))
    assert spool.shape == pictures.shape
    np.testing.assert_array_equal(np.stack(threads.each(spool.__getitem__, range(9))), pictures)
    part = spool.subset([7, 2, 4]).subset([2, 0])
    del spool
    np.testing.assert_array_equal(np.stack(list(part)), pictures[[4, 7]])
    part[0][:] = 0
    np.testing.assert_array_equal(part[0], pictures[4])
    assert os.listdir(tmp_path) == []


def test_a_folder_that_cannot_hold_them_is_named(monkeypatch):
    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "pwrite", full)
    with pytest.raises(HecbenchError, match="No space left on device"):
        Spool.of(lambda number: np.zeros((4, 4, 3), np.uint8), 2)
