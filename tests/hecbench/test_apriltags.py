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
from hecbench import apriltags
noise = np.random.default_rng(0).integers(0, 255, (240, 320), dtype=np.uint8)
for decimate in (1.0, 2.0):
    apriltags.detected(noise, sys.argv[1], decimate)
"""


@pytest.mark.parametrize("family", ["tag36h11", "tag25h9", "tag16h5", "tagCircle21h7", "tagStandard41h12"])
def test_process_ends_well_after_detection(family):
    """With the library's own destructor each of these processes ends with signal 11 or 7."""
    for _ in range(2):
        ended = subprocess.run([sys.executable, "-c", SCRIPT, family], env=os.environ | STRICT_HEAP)
        assert ended.returncode == 0
