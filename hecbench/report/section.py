"""One section of the page: a table with what belongs to it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Any

from hecbench.report.tables import Table


class Verdict(StrEnum):
    """How a result stands to what was claimed."""

    AGREES = "agrees"
    DIFFERS = "differs"
    OPEN = "open"
    WHY = "why"
    ALARM = "alarm"


@dataclass(frozen=True)
class Remark:
    """One computed sentence."""

    verdict: Verdict
    text: str


@dataclass(frozen=True)
class Section:
    """What the page shows under one heading.

    Attributes:
        table: with its title, the heading.
        remarks: computed sentences, shown above the table.
        figures: SVG or HTML text.
        commands: that make the results again.
        findings: of `check`.
        overlays: HTML of pictures.
        folded: shown as its heading alone until it is opened.
    """

    table: Table
    remarks: Sequence[Remark] = ()
    figures: Sequence[str] = ()
    commands: Sequence[str] = ()
    findings: Sequence[dict[str, Any]] = ()
    overlays: Sequence[str] = ()
    folded: bool = False
