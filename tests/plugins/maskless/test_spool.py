"""Pictures in a temporary file come back as they were, from every thread, and leave nothing behind."""

import os
import tempfile

import numpy as np
import pytest
from hecbench_plugins.views.scene_background import background
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


def test_some_rows_of_one_picture_or_of_all(rng):
    pictures = rng.integers(0, 255, (4, 6, 5, 3), dtype=np.uint8)
    spool = Spool.of(lambda number: pictures[number], 4).subset([3, 1])
    np.testing.assert_array_equal(spool.rows(2, 5), pictures[[3, 1], 2:5])
    out = np.zeros((6, 5, 3), np.uint8)
    spool.read_rows(1, 4, 6, out)
    np.testing.assert_array_equal(out[4:], pictures[1, 4:])
    assert not out[:4].any()


def test_the_background_of_a_spool_is_that_of_its_pictures(rng):
    pictures = np.repeat(rng.integers(0, 255, (1, 70, 9, 3), dtype=np.uint8), 5, 0)
    shown = pictures[0].copy()
    pictures[1, 30:40] = 255 - pictures[1, 30:40]
    for given in (pictures, Spool.of(lambda number: pictures[number], 5)):
        image, agreement = background(given)
        np.testing.assert_array_equal(image, shown)
        assert agreement[:30].min() == 1
        assert 0.8 <= agreement[30:40].min() < 1


def test_a_folder_that_cannot_hold_them_is_named(monkeypatch):
    def full(*_):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(os, "pwrite", full)
    with pytest.raises(HecbenchError, match="No space left on device"):
        Spool.of(lambda number: np.zeros((4, 4, 3), np.uint8), 2)
