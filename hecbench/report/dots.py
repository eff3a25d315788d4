"""The dot plot of methods: one number each, with its interval; plain SVG that follows the page's colours."""

from __future__ import annotations

from collections.abc import Sequence
from html import escape

import numpy as np

from hecbench.estimate import Estimate, ordering_metric
from hecbench.report.cells import interval
from hecbench.report.tables import held_out_interval
from hecbench.statistics import Interval

_ROW, _LEFT, _WIDTH, _RIGHT, _TOP = 22, 190, 420, 150, 8


def dot_plot(estimates: Sequence[Estimate], recommended: str | None, agreeing: Sequence[str]) -> str | None:
    """Methods by the metric that orders them, best first; the recommended one bold, those that disagree in grey.

    None when fewer than two methods were measured.
    """
    metric = ordering_metric(estimates)
    rows = [(e, metric.of(e)) for e in estimates if metric is not None and metric.of(e) is not None]
    if metric is None or len(rows) < 2:
        return None
    shown = [
        (e.solver, held_out_interval(e, metric.name) if metric.section == "held_out" else _point(value))
        for e, value in rows
    ]
    ends = np.array([[i.value, i.low, i.high] for _, i in shown])
    positive = ends[np.isfinite(ends) & (ends > 0)]
    low, high = (float(positive.min()), float(positive.max())) if positive.size else (0.1, 1.0)
    low, high = low / 1.2, high * 1.2

    def across(value: float) -> float:
        return _LEFT + _WIDTH * float(np.log(max(value, low) / low) / np.log(high / low))

    height = _TOP + _ROW * len(shown) + 34
    parts = [
        f'<svg class="dots" viewBox="0 0 {_LEFT + _WIDTH + _RIGHT} {height}" role="img">'
        f"<title>{escape(metric.label)}</title>"
    ]
    parts += [_tick(across(value), height, value) for value in _ticks(low, high)]
    for row, (solver, value) in enumerate(shown):
        look = "best" if solver == recommended else "near" if solver in agreeing else "far"
        parts.append(_dot(_TOP + _ROW * (row + 0.5), solver, value, look, across))
    middle = _LEFT + _WIDTH / 2
    parts.append(
        f'<text class="axis" x="{middle}" y="{height - 4}" text-anchor="middle">{escape(metric.label)}</text>'
    )
    return "".join(parts) + "</svg>"


def _point(value: float | None) -> Interval:
    return Interval(np.nan if value is None else value, np.nan, np.nan)


def _dot(y: float, solver: str, value: Interval, look: str, across: object) -> str:
    assert callable(across)
    line = ""
    if np.isfinite([value.low, value.high]).all():
        line = f'<path d="M{across(value.low):.1f} {y:.1f}H{across(value.high):.1f}"/>'
    return (
        f'<g class="{look}"><text x="{_LEFT - 10}" y="{y + 4:.1f}" text-anchor="end">{escape(solver)}</text>{line}'
        f'<circle cx="{across(value.value):.1f}" cy="{y:.1f}" r="4.5"/>'
        f'<text class="value" x="{_LEFT + _WIDTH + 10}" y="{y + 4:.1f}">{interval(value)}</text></g>'
    )


def _ticks(low: float, high: float) -> list[float]:
    decades = range(int(np.floor(np.log10(low))), int(np.ceil(np.log10(high))) + 1)
    return [
        step * 10.0**decade for decade in decades for step in (1, 2, 5) if low <= step * 10.0**decade <= high
    ]


def _tick(x: float, height: int, value: float) -> str:
    return (
        f'<path class="grid" d="M{x:.1f} {_TOP}V{height - 32}"/>'
        f'<text class="axis" x="{x:.1f}" y="{height - 20}" text-anchor="middle">{value:g}</text>'
    )
