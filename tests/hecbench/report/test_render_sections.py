"""The renderer methods' section of the report: every run counted, beside the paper's numbers."""

import numpy as np

from hecbench import se3
from hecbench.estimate import Estimate, Status
from hecbench.report.render_sections import PAPER, sections


def run(level, item, error_mm):
    path = [["start", None, [0.0] * 6], ["end", 1.0, [0, 0, 0, 0.1, 0, 0]]]
    errors = {
        "camera_T_parent_translation_error_mm": error_mm,
        "translation_error_mm": error_mm,
        "rotation_error_deg": 0.01,
    }
    return Estimate(
        se3.exp(np.zeros(6)),
        solver="own",
        suite="synthetic",
        level=level,
        item=item,
        errors=errors,
        diagnostics={"path": path},
    )


def test_every_run_counts_beside_the_paper():
    failed = Estimate(
        status=Status.FAILED, reason="lost", solver="own", suite="synthetic", level="MP", item="2"
    )
    (section,) = sections([run("MP", "0", 1.0), run("MP", "1", 9.0), failed, run("LP", "0", 0.5)])
    rows = section["table"].rows
    assert [row[0] for row in rows] == ["LP"] * 6 + ["MP"] * 6
    own = next(row for row in rows if row[0] == "MP" and row[1].startswith("own"))
    assert own[1] == "own, 2 of 3 answered"
    assert own[5] == "5"
    assert own[7] == "33.3"
    assert len(section["figures"]) == 2
    assert all(figure.startswith("<svg") for figure in section["figures"])


def test_other_runs_make_no_section():
    assert sections([]) == []
    assert {len(numbers) for level in PAPER.values() for numbers in level.values()} == {6}
