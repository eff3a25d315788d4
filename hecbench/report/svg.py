"""Matplotlib figures as SVG text, with one look."""

from __future__ import annotations

import io
from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.axis import Axis
    from matplotlib.figure import Figure

DARK, LIGHT, RED = "#12355b", "#8fa6c2", "#d1495b"
_SHORT, _LONG = 0.7, 1.7
"""Decades of an axis below which its ticks are evenly spaced, and from which on only powers have numbers."""
_BETWEEN = "25"
"""First digits of the ticks that have numbers beside the powers."""
COLOURS = (DARK, RED, "#2e8b57", "#edae49", "#7b4fa3", "#00798c", "#8c564b", "#5c6670")


def panel(width_inch: float, height_inch: float, columns: int, rows: int = 1) -> tuple[Figure, list[Axes]]:
    """A figure with axes side by side, in rows of that height."""
    from matplotlib.figure import Figure

    figure = Figure(figsize=(width_inch, height_inch * rows), layout="constrained")
    axes = [figure.add_subplot(rows, columns, place + 1) for place in range(rows * columns)]
    for each in axes:
        each.spines[["top", "right"]].set_visible(False)
        each.title.set_fontsize(10)
    return figure, axes


def legend_beside(axes: Sequence[Axes]) -> None:
    """One legend for all, right of the last: every label once."""
    handles = {
        label: handle
        for view in axes
        for handle, label in zip(*view.get_legend_handles_labels(), strict=True)
    }
    axes[-1].legend(
        handles.values(),
        handles.keys(),
        loc="center left",
        bbox_to_anchor=(1.01, 0.5),
        frameon=False,
        fontsize=8,
    )


def svg(figure: Figure) -> str:
    """SVG text without a date, so that equal results give equal bytes; names from data are no formulas."""
    import matplotlib
    from matplotlib.text import Text

    for axes in figure.axes:
        for axis in (axes.xaxis, axes.yaxis):
            if axis.get_scale() != "linear":
                _plain_numbers(axis)
    for text in figure.findobj(Text):
        text.set_parse_math(False)
    stream = io.StringIO()
    with matplotlib.rc_context({"svg.hashsalt": "hecbench", "svg.fonttype": "path"}):
        figure.savefig(stream, format="svg", metadata={"Date": None})
    written = stream.getvalue()
    return written[written.index("<svg") :]


def _plain_numbers(axis: Axis) -> None:
    """Numbers instead of powers at the ticks of a logarithmic axis, some of them however short it is."""
    from matplotlib.ticker import MaxNLocator

    low, high = axis.get_view_interval()
    decades = np.log10(high / low) if low > 0 else np.inf
    if decades < _SHORT:
        axis.set_major_locator(MaxNLocator(4))
    axis.set_major_formatter("{x:g}")
    shown = _BETWEEN if _SHORT <= decades < _LONG else ""
    axis.set_minor_formatter(lambda x, _: f"{x:g}" if f"{x:e}"[0] in shown else "")
