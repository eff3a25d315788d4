"""Small panels of error curves, one per solver, side by side as the width allows; plain SVG in the page's colours."""

from __future__ import annotations

import hashlib
from collections.abc import Sequence
from html import escape

import numpy as np

from hecbench.se3 import Array

Curve = tuple[str, Array, int]
"""A solver, the errors of its answers in mm, ascending, and how many runs it had."""
_LEFT, _TOP, _WIDTH, _HEIGHT, _BELOW, _RIGHT = 28, 6, 150, 80, 20, 12
_SHORT = 1.2
"""Decades below which 2 and 5 have ticks beside the powers of ten."""
_MOST_TICKS = 5


def panels(curves: Sequence[Curve], title: str) -> str | None:
    """One panel per curve in the given order, all curves in grey behind each; None when no run has an error."""
    errors = np.concatenate([errors for _, errors, _ in curves])
    positive = errors[np.isfinite(errors) & (errors > 0)]
    if not positive.size:
        return None
    low, high = float(positive.min()) / 1.2, float(positive.max()) * 1.2
    paths = [_steps(errors, runs, low, high) for _, errors, runs in curves]
    name = "behind-" + hashlib.sha256(title.encode()).hexdigest()[:12]
    behind = f'<svg class="shared"><defs><path id="{name}" d="{"".join(paths)}"/></defs></svg>'
    frame = _frame(low, high)
    drawn = "".join(
        _panel(solver, path, name, frame) for (solver, _, _), path in zip(curves, paths, strict=True)
    )
    said = f"{title}: share of runs with a TRE below, mm; the other solvers in grey."
    return f'<figcaption>{escape(said)}</figcaption><div class="panels">{behind}{drawn}</div>'


def _panel(solver: str, path: str, behind: str, frame: str) -> str:
    box = f"0 0 {_LEFT + _WIDTH + _RIGHT} {_TOP + _HEIGHT + _BELOW}"
    return (
        f'<div><p>{escape(solver)}</p><svg viewBox="{box}" role="img"><title>{escape(solver)}</title>{frame}'
        f'<use class="behind" href="#{behind}"/><path class="curve" d="{path}"/></svg></div>'
    )


def _frame(low: float, high: float) -> str:
    parts = []
    for share in (0, 0.5, 1):
        y = _y(share)
        parts.append(f'<path class="grid" d="M{_LEFT} {y:.1f}h{_WIDTH}"/>')
        parts.append(f'<text class="axis" x="{_LEFT - 5}" y="{y + 4:.1f}" text-anchor="end">{share:g}</text>')
    for tick in _ticks(low, high):
        x = _x(tick, low, high)
        parts.append(f'<path class="grid" d="M{x:.1f} {_TOP}v{_HEIGHT}"/>')
        parts.append(
            f'<text class="axis" x="{x:.1f}" y="{_TOP + _HEIGHT + 15}" text-anchor="middle">{tick:g}</text>'
        )
    return "".join(parts)


def _steps(errors: Array, runs: int, low: float, high: float) -> str:
    """From no run at the left end to the share of answers at the right end."""
    path = f"M{_LEFT} {_y(0):.1f}"
    for count, error in enumerate(errors[np.isfinite(errors)], start=1):
        path += f"H{_x(float(error), low, high):.1f}V{_y(count / runs):.1f}"
    return f"{path}H{_LEFT + _WIDTH}"


def _x(value: float, low: float, high: float) -> float:
    return _LEFT + _WIDTH * float(np.log(max(value, low) / low) / np.log(high / low))


def _y(share: float) -> float:
    return _TOP + _HEIGHT * (1 - share)


def _ticks(low: float, high: float) -> list[float]:
    decades = range(int(np.floor(np.log10(low))), int(np.ceil(np.log10(high))) + 1)
    digits = (1, 2, 5) if np.log10(high / low) < _SHORT else (1,)
    ticks = [float(f"{digit}e{decade}") for decade in decades for digit in digits]
    inside = [tick for tick in ticks if low <= tick <= high]
    return inside[:: -(-len(inside) // _MOST_TICKS)] if inside else []
