"""The robot drawn over a recording's images."""

from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

from hecbench import se3
from hecbench.errors import InputError
from hecbench.estimate import Estimate, Status
from hecbench.report.overlay import Overlay, render
from hecbench.storage.recording_io import load


@pytest.fixture(scope="module")
def lit(shared):
    return load(shared / "data" / "lit_ur5e_1_00").subset([0, 1])


def test_overlay_follows_the_mask_at_the_truth(lit):
    drawn = Overlay(lit).draw(1, lit.truth_parent_T_camera)
    red = (drawn == np.round(255 * np.array([1.0, 0.2, 0.1]))).all(-1)
    mask = lit.mask(1)
    rim = mask ^ np.roll(mask, 1, 0) | mask ^ np.roll(mask, 1, 1)
    assert red.sum() > 500
    assert (red & (rim | np.roll(rim, -1, 0) | np.roll(rim, -1, 1))).sum() > 0.8 * red.sum()


def test_render_writes_overlays_and_the_descent(lit, tmp_path):
    ends = [lit.initial_parent_T_camera, lit.truth_parent_T_camera]
    path = [["start", None, se3.log(ends[0]).tolist()], ["end", 1.0, se3.log(ends[1]).tolist()]]
    files = render(lit, Estimate(ends[1], diagnostics={"path": path}), tmp_path / "out")
    assert [file.name for file in files] == ["000000.png", "000001.png", "filmstrip.png", "filmstrip.gif"]
    assert Image.open(files[0]).size == (640, 480)
    assert Image.open(files[3]).n_frames == 2
    assert not [file for file in (tmp_path / "out").iterdir() if file.name.startswith(".")]


def test_what_cannot_be_drawn_is_said(lit, tmp_path):
    with pytest.raises(InputError, match="no answer to draw"):
        render(lit, Estimate(status=Status.REFUSED, reason="out of frame"), tmp_path)
    with pytest.raises(InputError, match="no robot model"):
        Overlay(replace(lit, robot=None))
    with pytest.raises(InputError, match="both an image and joints"):
        Overlay(replace(lit, images=None))
