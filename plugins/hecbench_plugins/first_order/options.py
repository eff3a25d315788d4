"""Options that several first-order solvers share; listing solvers imports this, so nothing heavy is imported here."""

from __future__ import annotations

import math
from collections.abc import Callable

from hecbench.specs import Option


def choice(*names: str) -> Callable[[str], str]:
    """A parser of one of these words."""

    def parse(text: str) -> str:
        if text not in names:
            raise ValueError(f"'{text}' is none of {', '.join(names)}")
        return text

    return parse


def not_negative(text: str) -> float:
    """A finite number of zero or more."""
    value = float(text)
    if not math.isfinite(value) or value < 0:
        raise ValueError(f"{text} is not a finite number of zero or more")
    return value


def positive(text: str) -> float:
    """A finite number above zero."""
    if not_negative(text) == 0:
        raise ValueError("must be above zero")
    return float(text)


def _count(text: str) -> int:
    if int(text) < 1:
        raise ValueError("must be 1 or more")
    return int(text)


ITERATIONS = Option("iterations", _count, "of Adam")
BACKEND = Option(
    "backend", choice("cpu", "nvdiffrast"), "cpu, or nvdiffrast (CUDA, not installed with hecbench, untested)"
)
MASKS = Option(
    "masks", choice("per_link", "zbuffered"), "per_link: the links' masks added up; zbuffered: one picture"
)
