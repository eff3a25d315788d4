"""Matplotlib figures as SVG text, with one look."""

from __future__ import annotations

import io
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

DARK, LIGHT, RED = "#12355b", "#8fa6c2", "#d1495b"
COLOURS = (DARK, RED, "#2e8b57", "#edae49", "#7b4fa3", "#00798c", "#8c564b", "#5c6670")


def panel(width_inch: float, height_inch: float, columns: int) -> tuple[Figure, list[Axes]]:
    """A figure with axes side by side."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width_inch, height_inch), layout="constrained")
    axes = [figure.add_subplot(1, columns, column + 1) for column in range(columns)]
    for each in axes:
        each.spines[["top", "right"]].set_visible(False)
        each.title.set_fontsize(10)
    return figure, axes


def svg(figure: Figure) -> str:
    """SVG text without a date, so that equal results give equal bytes."""
    import matplotlib

    stream = io.StringIO()
    with matplotlib.rc_context({"svg.hashsalt": "hecbench", "svg.fonttype": "path"}):
        figure.savefig(stream, format="svg", metadata={"Date": None})
    text = stream.getvalue()
    return text[text.index("<svg") :]
