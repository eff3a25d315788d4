"""Keypoints predicted by each method beside the paper's Table II."""

from __future__ import annotations

from collections.abc import Sequence

from hecbench import statistics
from hecbench.estimate import Estimate
from hecbench.report import paper
from hecbench.report.cells import ABSENT, number, percent
from hecbench.report.scores import method_order, paper_name
from hecbench.report.section import Remark, Verdict
from hecbench.report.table_one import FIRST_LOOK, PAPER_LOOK
from hecbench.report.tables import Table

COUNT = "keypoints"


def predicted(runs: Sequence[Estimate]) -> list[Estimate]:
    """The answers whose keypoints were compared with those in the pictures."""
    return [run for run in runs if COUNT in run.diagnostics]


def _share(run: Estimate, threshold_px: int) -> float:
    return float(run.diagnostics[f"pck_{threshold_px}_px"])


def table_two(title: str, runs: Sequence[Estimate]) -> Table | None:
    """One row per recording and method, the paper's below."""
    shown = sorted(predicted(runs), key=lambda run: (run.recording, method_order(run.solver)))
    if not shown:
        return None
    rows = [
        (
            run.recording,
            run.solver,
            str(run.diagnostics[COUNT]),
            *(number(_share(run, threshold)) for threshold in paper.PCK_THRESHOLDS_PX),
            number(run.diagnostics["keypoint_auc"]),
            number(run.diagnostics["keypoint_mean_px"]),
            number((run.errors or {}).get("add_mm")),
            number((run.errors or {}).get("add_auc_400_mm")),
        )
        for run in shown
    ]
    looks = [""] * len(rows)
    for method, shares in paper.TABLE_TWO.items():
        cells = (ABSENT if share is None else f"{share:g}" for share in shares)
        rows.append(("Baxter", f"paper: {method}", f"{paper.PCK_POSES} poses", *cells, *[ABSENT] * 4))
        looks.append(PAPER_LOOK)
    looks[-len(paper.TABLE_TWO)] += f" {FIRST_LOOK}"
    header = (
        "recording", "method", "keypoints", *(f"PCK @{threshold} px" for threshold in paper.PCK_THRESHOLDS_PX),
        "AUC 0-199 px", "mean px", "ADD mm", "ADD AUC 0-399 mm",
    )  # fmt: skip
    notes = ("PCK: share of keypoints predicted within a threshold. The paper's are of the Baxter set only.",)
    return Table(title, header, tuple(rows), notes, left=2, looks=tuple(looks))


def remarks(runs: Sequence[Estimate]) -> list[Remark]:
    """On a recording of a Baxter, whether the paper's share within 20 px lies in our interval."""
    said = []
    for run in predicted(runs):
        method = paper_name(run.solver)
        theirs = paper.TABLE_TWO.get(method or "", (None,))[0]
        if theirs is None or "baxter" not in run.recording.lower():
            continue
        poses = int(run.diagnostics["keypoint_poses"])
        ours = statistics.wilson(round(_share(run, 20) * poses), poses)
        verdict = Verdict.AGREES if ours.low <= theirs <= ours.high else Verdict.DIFFERS
        text = (
            f"{run.solver}: {100 * ours.value:.0f} {percent(ours)} within 20 px, taking {poses} poses as independent; "
            f"the paper has {100 * theirs:.0f} % of {paper.PCK_POSES}."
        )
        said.append(Remark(verdict, text))
    return said
