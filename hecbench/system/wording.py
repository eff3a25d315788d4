"""Numbers as people write them."""

from __future__ import annotations


def significant(value: float, digits: int = 2) -> str:
    """A number of so many digits, written out: 120, not 1.2e+02, up to a million."""
    return f"{float(f'{value:.{digits}g}'):.7g}"
