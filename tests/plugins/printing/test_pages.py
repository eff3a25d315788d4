"""Printed targets, scanned back: the detectors find the declared size within 0.1 %."""

import io
import json
import re

import numpy as np
import pytest
from click.testing import CliRunner
from hecbench_plugins.detection import charuco, chessboard, circles, markers
from hecbench_plugins.printing import page
from hecbench_plugins.printing.command import target as verb
from hecbench_plugins.printing.shapes import pattern
from PIL import Image

from hecbench.errors import InputError
from hecbench.system import apriltags
from hecbench.targets import (
    AprilGridTarget,
    AprilTagTarget,
    ArucoGridTarget,
    ArucoTarget,
    CharucoTarget,
    ChessboardTarget,
    MarkersTarget,
    PointsTarget,
)

DPI = 150


def dots(columns, rows, spacing_m):
    y, x = np.mgrid[:rows, :columns] * spacing_m
    return PointsTarget.of(np.stack([x, y, np.zeros_like(x)], -1).reshape(-1, 3))


def scanned(target, paper):
    stream = io.BytesIO()
    page.figure(target, paper).savefig(stream, format="png", dpi=DPI)
    return np.asarray(Image.open(stream).convert("L"))


def found_px(target, grey):
    match target:
        case AprilTagTarget():
            (tag,) = apriltags.detected(grey, target.family)
            assert tag.id == target.id
            return tag.corners_px
        case ChessboardTarget():
            return chessboard.corners(grey, target.columns, target.rows)
        case CharucoTarget():
            return charuco.find([grey], target)[1][0]
        case MarkersTarget():
            return markers.find([grey], target)[1][0]
        case _:
            grid, marked = circles.centres(grey, 5, 6)
            assert marked
            return grid


@pytest.mark.parametrize(
    ("target", "paper"),
    [
        (ChessboardTarget(8, 5, 0.02), "A4"),
        (CharucoTarget(5, 7, 0.03, 0.022, "4X4_50"), "A4"),
        (CharucoTarget(6, 8, 0.03, 0.022, "5X5_100"), "A3"),
        (CharucoTarget(6, 8, 0.03, 0.022, "5X5_100", legacy=True), "A3"),
        (AprilTagTarget("tag36h11", 7, 0.12), "A4"),
        (AprilTagTarget("tag25h9", 3, 0.1), "A4"),
        (AprilTagTarget("tag16h5", 2, 0.1), "letter"),
        (dots(5, 6, 0.025), "A4"),
        (ArucoTarget("4X4_50", 3, 0.1), "A4"),
        (ArucoGridTarget(4, 5, 0.03, 0.009, "6X6_250"), "A4"),
        (AprilGridTarget(6, 5, 0.024, 0.3), "A4"),
    ],
    ids=lambda value: value if isinstance(value, str) else value.kind,
)
def test_the_declared_size_is_found(target, paper):
    pixels = found_px(target, scanned(target, paper))
    points = target.points_m[:, :2]
    assert len(pixels) == len(points)
    centred, seen = points - points.mean(0), pixels - pixels.mean(0)
    size_m = np.sqrt((seen**2).sum() / (centred**2).sum()) ** -1 * DPI / 0.0254
    scale = 1 / size_m
    assert scale == pytest.approx(1.0, abs=1e-3)


def test_tags_stand_upright():
    target = AprilTagTarget("tag36h11", 7, 0.12)
    bottom_left, _, top_right, _ = found_px(target, scanned(target, "A4"))
    assert bottom_left[0] < top_right[0]
    assert bottom_left[1] > top_right[1]


@pytest.mark.parametrize(("paper", "size_pt"), [("A4", (595.3, 841.9)), ("A3", (841.9, 1190.6))])
def test_the_pdf_has_the_size_of_the_paper(tmp_path, paper, size_pt):
    page.write(AprilTagTarget("tag36h11", 0, 0.1), paper, tmp_path / "tag.pdf")
    box = re.search(rb"/MediaBox \[ ?0 0 ([\d.]+) ([\d.]+)", (tmp_path / "tag.pdf").read_bytes())
    assert (float(box[1]), float(box[2])) == pytest.approx(size_pt, abs=0.1)


def test_the_ruler_is_to_scale():
    (axes,) = page.figure(AprilTagTarget("tag36h11", 0, 0.1), "A4").axes
    line = axes.lines[0].get_xdata()
    assert line[1] - line[0] == page.RULER_MM
    assert axes.get_xlim() == (0, 210)


def test_no_cell_of_a_tag_is_drawn_twice():
    shown = pattern(AprilTagTarget("tag36h11", 0, 0.1))
    area = sum(s.width * s.height for s in shown.shapes)
    assert area < shown.width * shown.height


@pytest.mark.parametrize(
    ("words", "message"),
    [
        (["chessboard", "--size", "20"], "COLUMNSxROWS"),
        (["chessboard", "--size", "60", "--grid", "9x6"], "does not fit on A4"),
        (["apriltag", "--size", "-1"], "--size -1"),
        (["apriltag", "--size", "50", "--family", "tagCircle21h7"], "tag36h11"),
        (["apriltag", "--size", "50", "--id", "100000"], "ids are 0 to"),
        (["charuco", "--size", "20", "--grid", "5x7", "--dictionary", "9X9"], "9X9"),
        (["apriltag", "--size", "50", "--paper", "A9"], "A9"),
        (["aruco_grid", "--size", "20", "--grid", "9x6", "--dictionary", "4X4_50"], "larger dictionary"),
        (["aruco", "--size", "20", "--id", "50"], "ids are 0 to 49"),
        (["aprilgrid", "--size", "20", "--grid", "4x4", "--gap", "-1"], "spacing"),
        (["apriltag", "--size", "50", "--out", "tag.gif"], ".pdf, .svg or .png"),
    ],
)
def test_bad_wishes_are_refused_in_one_line(words, message, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    done = CliRunner().invoke(verb, words)
    assert isinstance(done.exception, InputError)
    assert message in str(done.exception)
    assert not list(tmp_path.iterdir())


def test_the_json_describes_the_target(tmp_path):
    out = tmp_path / "board.svg"
    done = CliRunner().invoke(verb, ["chessboard", "--size", "20", "--grid", "8x5", "--out", str(out)])
    assert done.exit_code == 0
    assert json.loads(done.stdout) == {"kind": "chessboard", "columns": 8, "rows": 5, "square_m": 0.02}
    assert out.read_text().lstrip().startswith("<?xml")
