"""What was found in a picture is found again: the same, and without looking."""

import numpy as np
import pytest
from hecbench_plugins.detection import pictures

from hecbench.system import cache, threads

LOOKED = []


@pytest.fixture(autouse=True)
def _own_folder(monkeypatch, tmp_path):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.delenv(cache.VARIABLE, raising=False)
    LOOKED.clear()


def brightest(grey, least):
    """The place of the brightest pixel and its value; of several kinds, as detectors give them."""
    LOOKED.append(grey.max())
    place = np.argwhere(grey == grey.max())[0] / 3
    return None if grey.max() < least else {int(grey.max()): place, -1: [place, bool(grey[0, 0])]}


def drawn(rng, count=6):
    greys = list(rng.integers(0, 200, (count, 20, 30), dtype=np.uint8))
    return [*greys[:3], None, *greys[3:], np.zeros((20, 30), np.uint8)]


def test_each_gives_the_same_from_the_cache(rng):
    greys = drawn(rng)
    first = pictures.each(greys, brightest, 50)
    assert len(LOOKED) == 7
    again = pictures.each(greys, brightest, 50)
    assert len(LOOKED) == 7
    assert [one is None for one in first] == [one is None for one in again]
    assert first[3] is None
    assert first[-1] is None
    for one, other in zip(first[:3], again[:3], strict=True):
        assert one.keys() == other.keys()
        value = next(key for key in one if key >= 0)
        np.testing.assert_array_equal(one[value], other[value])
        np.testing.assert_array_equal(one[-1][0], other[-1][0])
        assert one[-1][1] == other[-1][1]


def test_another_question_or_another_picture_is_looked_at(rng):
    greys = drawn(rng)
    pictures.each(greys, brightest, 50)
    pictures.each(greys, brightest, 51)
    assert len(LOOKED) == 14
    greys[0] = greys[0].reshape(30, 20)
    pictures.each(greys, brightest, 50)
    assert len(LOOKED) == 15


def test_one_thread_and_more_agree(monkeypatch, rng):
    monkeypatch.setenv(cache.VARIABLE, "1")
    monkeypatch.setenv(threads.VARIABLE, "1")
    greys, found = drawn(rng), []
    for most in (1, 4):
        threads.limit(most)
        found.append(repr(pictures.each(greys, brightest, 0)))
    threads.count.cache_clear()
    assert found[0] == found[1]
