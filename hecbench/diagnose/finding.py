"""What `check` says about a recording."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from enum import StrEnum
from typing import Any

from hecbench.estimate import plain


class Severity(StrEnum):
    """How bad it is; `critical` means that no calibration from these data can be trusted."""

    OK = "ok"
    INFO = "info"
    WARNING = "warning"
    CRITICAL = "critical"


@dataclass(frozen=True)
class Finding:
    """One answer of `check`.

    Attributes:
        id: the kind of fault that was looked for.
        severity: of what was found.
        summary: one sentence with its numbers.
        action: what to do; empty when nothing is to be done.
        value: the number that decides, in the unit that the summary names.
        limit: what it is compared with.
        samples: ids of the samples concerned.
        per_sample: a number for each sample id, for plots; not part of the JSON.
    """

    id: str
    severity: Severity
    summary: str
    action: str = ""
    value: float | None = None
    limit: float | None = None
    samples: tuple[str, ...] = ()
    per_sample: Mapping[str, float] = field(default_factory=dict)

    def to_json(self) -> dict[str, Any]:
        """JSON values by name."""
        return {
            "id": self.id,
            "severity": str(self.severity),
            "summary": self.summary,
            "action": self.action,
            "value": plain(self.value),
            "limit": plain(self.limit),
            "samples": list(self.samples),
        }


def names(samples: tuple[str, ...], most: int = 8) -> str:
    """Sample ids for a sentence; a run of numbers only by its ends."""
    if len(samples) > 3 and all(sample.isdigit() for sample in samples):
        numbers = [int(sample) for sample in samples]
        if numbers == list(range(numbers[0], numbers[0] + len(numbers))):
            return f"{samples[0]} to {samples[-1]}"
    shown = ", ".join(samples[:most])
    return shown if len(samples) <= most else f"{shown} and {len(samples) - most} more"
