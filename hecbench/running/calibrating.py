"""One recording, every method that can, one verdict; and the folder in which they are left."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hecbench import diagnose, preparation, registry, verdict
from hecbench.diagnose import Finding
from hecbench.errors import HecbenchError
from hecbench.estimate import Estimate
from hecbench.recording import Recording
from hecbench.running.solving import Options, each_solved, provenance
from hecbench.specs import ExporterSpec, Kind, SolverSpec
from hecbench.storage import evidence
from hecbench.storage.evidence import Evidence
from hecbench.storage.results import VERDICT_NAME
from hecbench.system import files
from hecbench.verdict import Verdict
from hecbench.verdict.answers import evidence_of

EXPORTS = "exports"


@dataclass(frozen=True, eq=False)
class Calibration:
    """The verdict on a recording, and what the page shows of the recording."""

    verdict: Verdict
    evidence: Evidence

    def save(self, folder: Path) -> list[str]:
        """``verdict.json``, ``<solver>.json`` of each method, the exports of the recommended one, and the evidence.

        Returns what `export_all` says.
        """
        self.verdict.save(folder / VERDICT_NAME)
        for estimate in self.verdict.estimates:
            estimate.save(folder / f"{estimate.solver}.json")
        evidence.save(self.evidence, folder)
        if self.verdict.recommended is None:
            return []
        return export_all(self.verdict.recommended, folder / EXPORTS)


@dataclass(frozen=True, eq=False)
class Examined:
    """A recording made ready, with what `check` says about it.

    Attributes:
        read: as it was read, perhaps without its truth.
        segmented: what the solvers get.
        findings: of `check`.
    """

    read: Recording
    segmented: preparation.Segmented
    findings: Sequence[Finding]

    @property
    def findings_json(self) -> list[dict[str, Any]]:
        """As they are written."""
        return [finding.to_json() for finding in self.findings]

    def evidence(self) -> Evidence:
        """What a page shows of the recording."""
        return evidence_from(self.read, self.segmented.recording, self.findings)


def examine(recording: Recording, segmenter: str | None = None, check: bool = True) -> Examined:
    """Prepare a recording, detecting everything once, and look for faults in it."""
    ready = preparation.prepare(recording)
    findings = diagnose.check(recording, ready) if check else []
    return Examined(recording, preparation.segmented(ready, segmenter), findings)


def solved(
    examined: Examined,
    specs: Sequence[SolverSpec],
    options: Options,
    on_start: Callable[[SolverSpec], None] = lambda spec: None,
    on_result: Callable[[Estimate], None] = lambda estimate: None,
) -> list[Estimate]:
    """The estimates of all solvers; `on_result` gets each as it comes."""
    origin = provenance(examined.read, options)
    estimates = []
    for estimate in each_solved(examined.segmented, specs, options, origin, on_start):
        on_result(estimate)
        estimates.append(estimate)
    return estimates


def judged(
    examined: Examined,
    specs: Sequence[SolverSpec],
    estimates: Sequence[Estimate],
    tolerance_mm: float = verdict.TOLERANCE_MM,
    at_m: NDArray[np.float64] | None = None,
) -> Verdict:
    """The verdict on the estimates of an examined recording."""
    return verdict.judge(
        examined.segmented.recording.without_truth(),
        estimates,
        {spec.name: evidence_of(spec.needs) for spec in specs},
        examined.findings_json,
        tolerance_mm=tolerance_mm,
        at_m=at_m,
    )


def evidence_from(recording: Recording, prepared: Recording, findings: Sequence[Finding]) -> Evidence:
    """What a report shows of a recording beside its numbers."""
    influence = next((dict(f.per_sample) for f in findings if f.id == "influence"), {})
    influence_mm = np.array([influence.get(sample, np.nan) for sample in recording.sample_ids])
    return evidence.collect(prepared, recording.sha256, [f.to_json() for f in findings], influence_mm)


def export_all(estimate: Estimate, folder: Path) -> list[str]:
    """The estimate by every exporter, one file each; returns a line for each that cannot write it, or is faulty."""
    left_out = []
    for exporter in registry.load().ready(Kind.EXPORTER, ExporterSpec):
        try:
            content = exporter.write(estimate, {})
        except Exception as error:
            reason = str(error) if isinstance(error, HecbenchError) else f"{type(error).__name__}: {error}"
            left_out.append(f"{folder.name}/{exporter.name}{exporter.suffix} is not written: {reason}")
            continue
        files.write_text(folder / f"{exporter.name}{exporter.suffix}", content)
    return left_out
