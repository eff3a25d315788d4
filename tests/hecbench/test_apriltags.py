"""Detectors are never freed: the process ends well, whatever the heap looks like."""

import os
import subprocess
import sys

import pytest

pytest.importorskip("pupil_apriltags", reason="detection needs pupil-apriltags")

STRICT_HEAP = {
    "MALLOC_PERTURB_": "165",  # freed memory is overwritten, so that a later use of it shows
    "GLIBC_TUNABLES": "glibc.malloc.mxfast=0:glibc.malloc.tcache_count=0",  # and checked at once
}
SCRIPT = """
import sys
import numpy as np
from hecbench.system import apriltags
rng = np.random.default_rng(0)
for text in sys.argv[2:]:
    width, height = map(int, text.split("x"))
    noise = rng.integers(0, 255, (height, width), dtype=np.uint8)
    for decimate in (1.0, 2.0):
        apriltags.detected(noise, sys.argv[1], decimate)
"""
ODD_SIZES = [f"{width}x{height}" for width in (1, 2, 3, 4, 7, 8, 100) for height in (1, 2, 3, 4, 8, 9, 1000)]


@pytest.mark.parametrize("family", ["tag36h11", "tag25h9", "tag16h5", "tagCircle21h7", "tagStandard41h12"])
def test_process_ends_well_after_detection(family):
    """With the library's own destructor each of these processes ends with signal 11 or 7."""
    for _ in range(2):
        command = [sys.executable, "-c", SCRIPT, family, "320x240"]
        assert subprocess.run(command, env=os.environ | STRICT_HEAP).returncode == 0


def test_pictures_too_small_for_a_tag_show_none():
    """The library crashes on some of them, and on others it never returns."""
    command = [sys.executable, "-c", SCRIPT, "tag36h11", *ODD_SIZES]
    assert subprocess.run(command, env=os.environ | STRICT_HEAP, timeout=120).returncode == 0
