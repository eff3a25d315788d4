"""A page with a target to scale, a ruler to check the printer with, and the JSON that the recording needs."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING

from hecbench.errors import InputError
from hecbench.storage.recording_io import target_json
from hecbench.system import files
from hecbench.targets import Target
from hecbench_plugins.printing.shapes import Pattern, Rectangle, pattern

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

PAPERS_MM = {
    "A0": (841, 1189), "A1": (594, 841), "A2": (420, 594), "A3": (297, 420), "A4": (210, 297), "A5": (148, 210),
    "letter": (216, 279), "legal": (216, 356),
}  # fmt: skip
RULER_MM = 100
_MM_PER_INCH = 25.4
_LONGEST_LINE = 160
"""Characters of 6 pt that fit on the narrowest page."""
_EDGE_MM = 6.0
"""What most printers leave white."""
_FOOT_MM = 24.0
"""Below the target, for the ruler and the text."""


def write(target: Target, paper: str, path: Path) -> None:
    """Write the page as PDF, SVG or PNG (600 dpi), by the suffix of `path`.

    Raises:
        InputError: the target does not fit on the paper, or cannot be drawn; another suffix.
    """
    kind = path.suffix[1:].lower()
    if kind not in ("pdf", "svg", "png"):
        raise InputError(f"{path}: give a name that ends in .pdf, .svg or .png")
    page = figure(target, paper)
    with files.replacing(path) as stream:
        page.savefig(stream, format=kind, dpi=600)


def figure(target: Target, paper: str) -> Figure:
    """The page, one data unit to the millimetre; a target that is wider than high lies on its side if it must."""
    from matplotlib.figure import Figure
    from matplotlib.patches import Circle
    from matplotlib.patches import Rectangle as Patch

    shown = pattern(target)
    width, height = _page_mm(shown, paper)
    page = Figure(figsize=(width / _MM_PER_INCH, height / _MM_PER_INCH))
    axes = page.add_axes((0, 0, 1, 1))
    axes.set(xlim=(0, width), ylim=(0, height))
    axes.axis("off")
    left, low = (width - shown.width) / 2, _FOOT_MM + (height - _FOOT_MM - shown.height) / 2
    for shape in shown.shapes:
        at = left + shape.x, low + shape.y
        if isinstance(shape, Rectangle):
            axes.add_patch(Patch(at, shape.width, shape.height, color="black", linewidth=0))
        else:
            axes.add_patch(Circle(at, shape.diameter / 2, color="black", linewidth=0))
    _draw_ruler(axes, width)
    described = json.dumps(target_json(target))
    axes.text(width / 2, 4, f"print at 100 %; the ruler must measure {RULER_MM} mm", size=7, ha="center")
    axes.text(width / 2, 8, described if len(described) < _LONGEST_LINE else target.kind, size=6, ha="center")
    return page


def _page_mm(shown: Pattern, paper: str) -> tuple[float, float]:
    if paper not in PAPERS_MM:
        raise InputError(f"--paper {paper}: choose one of {', '.join(PAPERS_MM)}")
    border = 2 * max(_EDGE_MM, shown.quiet)
    for width, height in (PAPERS_MM[paper], PAPERS_MM[paper][::-1]):
        if shown.width + border <= width and shown.height + border + _FOOT_MM <= height:
            return width, height
    raise InputError(
        f"the target is {shown.width:.0f} x {shown.height:.0f} mm and needs {border / 2:.0f} mm of white around it and"
        f" {_FOOT_MM:.0f} mm below: it does not fit on {paper}; give a larger --paper or a smaller --size"
    )


def _draw_ruler(axes: Axes, width: float) -> None:
    left = (width - RULER_MM) / 2
    axes.plot([left, left + RULER_MM], [14, 14], color="black", linewidth=0.3)
    for mm in range(RULER_MM + 1):
        length = 4.0 if mm % 10 == 0 else 2.5 if mm % 5 == 0 else 1.5
        axes.plot([left + mm] * 2, [14, 14 + length], color="black", linewidth=0.2)
        if mm % 10 == 0:
            axes.text(left + mm, 19, str(mm), size=5, ha="center")
