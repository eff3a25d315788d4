"""The studies' pages: every run counts, beside the paper's numbers, and the text follows the numbers."""

import json
from dataclasses import replace

import numpy as np
import pytest

from hecbench.estimate import Status
from hecbench.report import ablations, curves, html, keypoints, maskless, paper, variations
from hecbench.report.remarks import departures, lost_robots, means, order
from hecbench.report.scores import Ending, end, ending, in_frame, rate_where, start_mm, summary
from hecbench.report.section import Verdict
from hecbench.report.studies import sections
from hecbench.report.table_one import endings, published, table_one


def cells(table, *left):
    """The row that starts with these words, by column."""
    (row,) = [row for row in table.rows if row[: len(left)] == left]
    return dict(zip(table.header, row, strict=True))


def test_the_papers_numbers_are_those_of_the_reference(shared):
    told = json.loads((shared / "reference" / "paper_tables.json").read_text())
    for level, methods in told["synthetic_ur5e"]["results"].items():
        for name, row in methods.items():
            here = paper.TABLE_ONE[level][name]
            t = row["translation_m"]
            np.testing.assert_allclose(here[:4], 1e3 * np.array([t["q1"], t["q3"], t["max"], t["mean"]]))
            assert (here.mean_rad, here.success_pct) == (row["rotation_rad"]["mean"], row["success_pct"])
    assert {name: list(row) for name, row in paper.TABLE_TWO.items()} == told["baxter_pck"]["results"]
    for option, name in (
        ("lambda_cen", "lambda_centroid"),
        ("lambda_area", "lambda_area"),
        ("threshold", "threshold"),
    ):
        theirs = told["ablation"][name]
        rows = zip(theirs["values"], theirs["translation_mm"], theirs["rotation_rad"], strict=True)
        assert paper.ABLATIONS[option][1] == {value: (mm, rad) for value, mm, rad in rows}
    theirs = told["geometry_mismatch"]
    np.testing.assert_allclose(
        [mm for mm, _ in paper.MISMATCH.values()], theirs["translation_mm"], atol=0.005
    )


def test_table_one_counts_every_run(run_of):
    runs = [run_of("drhec", "MP", i, mm, in_frame=mm < 50) for i, mm in enumerate([1.0, 3.0, 90.0])]
    table = table_one("t", [*runs, run_of("drhec", "MP", 3, None)])
    ours, theirs = cells(table, "MP", "drhec"), cells(table, "MP", "paper: DRHeC")
    assert ours["answered"] == "3 of 4"
    assert ours["largest mm"] == "∞"
    assert ours["median mm [95 %]"] == "46.5"
    assert ours["mean mm [95 %]"] == "31.3"
    assert ours["≤ 5 mm, 0.01 rad, % [95 %]"].startswith("50 [")
    assert ours["in frame %; paper: success %"].endswith("of 3")
    assert (theirs["mean mm [95 %]"], theirs["in frame %; paper: success %"]) == ("76.6", "99")
    assert {row[0] for row in table.rows} == {"MP"}
    assert len(table.looks) == len(table.rows)
    assert table.rows.index(tuple(ours.values())) + 1 == table.rows.index(tuple(theirs.values()))


def test_a_lost_robot_ends_where_it_was_last_and_is_no_success(run_of):
    lost = run_of("drhec", "MP", 1, 301.0, rad=0.2, lost=True)
    assert end(lost) == (pytest.approx(301.0), pytest.approx(0.2))
    assert ending(lost) is Ending.LOST
    row = cells(table_one("t", [run_of("drhec", "MP", 0, 1.0, in_frame=True), lost]), "MP", "drhec")
    assert row["answered"] == "1 of 2"
    assert row["largest mm"] == "301"
    assert row["mean mm [95 %]"] == "151"
    assert row["≤ 50 mm, 0.1 rad, % [95 %]"].startswith("50 [")
    assert row["in frame %; paper: success %"].startswith("50 [")


def test_how_runs_end(run_of):
    runs = [run_of("drhec_rgb", "LP", i, 1.0, in_frame=True, start_mm=80.0 + i) for i in range(10)]
    runs += [run_of("drhec_rgb", "LP", 10 + i, 900.0, in_frame=True, start_mm=160.0 + i) for i in range(2)]
    runs += [run_of("drhec_rgb", "LP", 20 + i, 900.0, lost=True, start_mm=160.0 + i) for i in range(6)]
    runs.append(run_of("drhec_rgb", "LP", 98, 400.0, start_mm=170.0))
    runs.append(run_of("drhec_rgb", "LP", 99, None, start_mm=170.0))
    row = cells(endings("t", runs), "LP", "drhec_rgb")
    told = [row[name] for name in ("runs", "near", "robot lost", "end not known")]
    assert told == ["20", "10", "6", "1"]
    assert (row["beyond 100 mm, robot in frame"], row["beyond 100 mm, not reported"]) == ("2", "1")
    assert row["share of the mean from beyond 100 mm %"] == "100"
    assert (row["start median mm: near"], row["start median mm: others"]) == ("84.5", "162")
    assert row["start decides"].startswith("p\u00a0<")
    (remark,) = lost_robots(runs)
    assert (
        "of 20 runs 10 near, 6 robot lost, 2 far, robot in frame, 1 far, not reported, 1 not known"
        in remark.text
    )


def test_a_method_that_is_not_the_published_one_is_told(run_of):
    run = run_of("drhec", "gain", 0, 1.0)
    run = replace(run, diagnostics={**run.diagnostics, "not_as_published": "the background is not black"})
    (remark,) = departures([run, run_of("drhec", "gain", 1, 1.0)])
    assert "drhec is not the published method in 1 of 2 runs, first: the background" in remark.text
    assert any(remark in section.remarks for section in sections([run, run_of("drhec", "gain", 1, 1.0)]))


@pytest.mark.parametrize(
    ("shift", "verdict"), [(1.3, Verdict.AGREES), (1 / 1.3, Verdict.DIFFERS), (None, Verdict.OPEN)]
)
def test_the_order_is_read_from_the_pairs(run_of, shift, verdict):
    rng = np.random.default_rng(0)
    first = rng.uniform(1, 5, 30)
    factor = rng.choice([0.99, 1.01], 30) if shift is None else np.full(30, shift)
    runs = [run_of("drhec_rgbc[variant=x]", "MP", i, mm) for i, mm in enumerate(first)]
    runs += [run_of("drhec_rgb[variant=x]", "MP", i, mm) for i, mm in enumerate(first * factor)]
    runs += [run_of("drhec_rgb[variant=y]", "MP", i, 1e-3) for i in range(30)]
    (remark,) = order(runs)
    assert remark.verdict is verdict
    assert remark.text.startswith("MP, variant=x: RGBC is nearer than RGB on ")


def test_published_means_are_placed_in_our_intervals(run_of):
    rng = np.random.default_rng(1)
    runs = [run_of("drhec", "MP", i, mm) for i, mm in enumerate(rng.normal(76.6, 5, 40))]
    runs += [run_of("ipe", "MP", i, mm) for i, mm in enumerate(rng.normal(10, 1, 40))]
    table = published("t", runs)
    assert cells(table, "MP", "drhec")["the paper's lies"] == "-"
    assert [row[4] for row in table.rows] == ["above", "inside"]
    assert cells(table, "MP", "drhec")["s per 1,000 iterations, median"] == "1"
    assert cells(table, "MP", "drhec")["paper's, RTX 4090"] == "7.19"
    (remark,) = means(runs)
    assert "1 inside (DRHeC MP)" in remark.text
    assert "1 above (IPE MP)" in remark.text
    assert remark.verdict is Verdict.DIFFERS


def test_ablations_stand_beside_the_papers(run_of):
    rng = np.random.default_rng(2)
    errors = rng.uniform(5, 6, 30)
    runs = [run_of("drhec[lambda_cen=0.01]", "lambda_cen", i, mm) for i, mm in enumerate(errors)]
    runs += [run_of("drhec[lambda_cen=0]", "lambda_cen", i, mm / 2) for i, mm in enumerate(errors)]
    table = ablations.ablation("paper", runs, "lambda_cen")
    assert cells(table, "0.01 (default)", "paper: DRHeC")["mean mm [95 %]"] == "5.05"
    assert cells(table, "0", "drhec")["answered"] == "30 of 30"
    said = ablations.remarks(runs, "lambda_cen")
    assert said[0].verdict is Verdict.DIFFERS
    assert "the lowest median is at lambda_cen = 0, the paper's best value is 0.01" in said[0].text
    assert ablations.ablation("paper", runs, "threshold") is None
    assert ablations.remarks([], "threshold") == []


def test_the_default_may_go_unnamed(run_of):
    runs = [run_of("drhec[variant=literal]", "threshold", i, 1.0) for i in range(3)]
    assert list(ablations.series(runs, "threshold")["drhec[variant=literal]"]) == [0.25]


def test_wrong_geometry_beside_its_floor(run_of):
    runs = [
        run_of("drhec", "mismatch_3", i, 1.5 * mm, floor_mm=mm) for i, mm in enumerate((20.0, 30.0, 40.0))
    ]
    runs += [run_of("drhec", "LP", i, 0.3) for i in range(3)]
    table = variations.mismatch("t", runs)
    row = cells(table, "3 %", "drhec")
    assert (row["mean floor mm"], row["mean / floor [95 %]"]) == ("30", "1.5")
    assert cells(table, "0 %", "drhec")["mean floor mm"] == "-"
    assert cells(table, "3 %", "paper: DRHeC")["mean mm [95 %]"] == "53"
    assert {remark.verdict for remark in variations.mismatch_remarks(runs)} >= {Verdict.WHY, Verdict.DIFFERS}


def test_views_and_appearance_are_told_apart(run_of):
    runs = [run_of("drhec", level, 0, 1.0) for level in ("LP", "views_3", "gain", "mismatch_1", "threshold")]
    assert [row[0] for row in variations.views("t", runs).rows] == ["1", "3"]
    assert [row[0] for row in variations.appearance("t", runs).rows] == ["LP", "gain"]


def test_frames_are_counted_where_they_are_told(run_of):
    runs = [run_of("a", "LP", i, 1.0, in_frame=frame) for i, frame in enumerate([True, False, None])]
    assert [in_frame(run) for run in runs] == [True, False, None]
    assert rate_where(runs, in_frame).startswith("50 [")
    assert summary([run_of("a", "LP", 0, None)])[1:3] == ("∞", "-")


def test_starts_and_ways_are_measured_against_the_truth(run_of):
    run = run_of("drhec", "LP", 0, 2.0, start_mm=150.0, costs=(1.0, 0.5, 0.1))
    assert start_mm(run) == pytest.approx(150.0)
    found = curves._errors_on_the_way(run)
    assert (found[0], found[-1]) == (pytest.approx(150.0), pytest.approx(2.0))
    assert curves.progress_curves([run], ["LP"]).startswith("<svg")


def test_wrong_answers_come_first(run_of):
    errors = [5.0, 6.0, 50.0, None, 10.0]
    runs = [
        run_of("render_gn", "1_view", i, mm, suite="maskless_real", rad=0.01) for i, mm in enumerate(errors)
    ]
    runs.append(run_of("render_gn", "1_view", 9, None, suite="maskless_real", status=Status.REFUSED))
    runs.append(run_of("render_gn", "1_view", 10, 5.0, suite="maskless_real", rad=0.05))
    row = cells(maskless.outcomes("t", runs), "1_view", "render_gn")
    told = [row[name] for name in ("wrong with status ok", "runs", "right", "refused", "failed")]
    assert told == ["2", "7", "3", "1", "1"]
    (remark,) = maskless.remarks(runs)
    assert remark.verdict is Verdict.ALARM
    assert "2 of 7 runs" in remark.text
    assert "1_view item 2, 1_view item 10" in remark.text
    assert maskless.remarks(runs[:2])[0].verdict is Verdict.OPEN
    assert maskless.remarks(runs[:2] * 100)[0].verdict is Verdict.AGREES
    more = [run_of("render_gn", f"{n}_views", 0, 1.0, suite="maskless_real") for n in (40, 5, 10)]
    more.append(run_of("render_gn", "hopeless", 0, None, suite="maskless_real"))
    ordered = [row[0] for row in maskless.outcomes("t", more).rows]
    assert ordered == ["5_views", "10_views", "40_views", "hopeless"]


def test_a_method_that_never_answers(run_of):
    runs = [run_of("ipe", level, i, None) for level in ("LP", "MP") for i in range(2)]
    table = table_one("t", runs)
    assert cells(table, "LP", "ipe")["mean mm [95 %]"] == "-"
    assert curves.error_curves(runs, ["LP", "MP"]) is None
    assert curves.cost_curves(runs, ["LP", "MP"]) is None
    assert curves.basin(runs, ["LP"]) is None
    assert curves.progress_curves(runs, ["LP"]) is None
    assert sections(runs)[0].table.rows == table.rows


def test_cost_curves_leave_out_costs_that_cannot_be_compared(run_of):
    good = run_of("drhec", "LP", 0, 1.0, costs=(2.0, 1.0, 0.5))
    negative = run_of("render_gn", "LP", 0, 1.0, costs=(2.0, -300.0))
    assert curves.cost_curves([negative], ["LP"]) is None
    assert curves.cost_curves([good, negative], ["LP"]).startswith("<svg")


def test_every_study_has_its_section(studies):
    found = sections(studies)
    titles = [section.table.title for section in found]
    assert titles == [
        "maskless_real: right, silent or wrong",
        "paper: starts LP, MP, HP beside the paper's Table I",
        "paper: how the runs end",
        "paper: the paper's numbers in our intervals",
        "paper: Table VI, lambda_cen",
        "paper: Table VII, lambda_area",
        "paper: Table VIII, threshold",
        "paper: more views",
        "paper: wrong geometry",
        "paper: changed appearance",
    ]
    assert [len(section.figures) for section in found[:3]] == [1, 2, 2]
    assert all(figure.startswith("<svg") for section in found for figure in section.figures)


def test_the_page_shows_studies_first_and_folds_their_levels(studies):
    text = html.page(studies, [], "hecbench report", lambda sha256: None)
    assert text.index("beside the paper") < text.index("<details>")
    assert text.count("<details>") == len({(run.suite, run.level) for run in studies})
    assert text.count('<tr class="paper') > 30


def test_other_runs_make_no_section(run_of):
    assert sections([]) == []
    assert sections([run_of("park", "tag_2m", 0, suite="markers")]) == []
    assert keypoints.table_two("t", []) is None


def test_keypoints_stand_beside_table_two(run_of):
    run = run_of("drhec", None, "baxter", 12.0, suite="files")
    told = {f"pck_{threshold}_px": 0.65 for threshold in paper.PCK_THRESHOLDS_PX}
    told |= {"keypoints": 100, "keypoint_poses": 20, "keypoint_auc": 0.9, "keypoint_mean_px": None}
    run = replace(run, recording="baxter", diagnostics=told)
    (section,) = sections([run])
    row = cells(section.table, "baxter", "drhec")
    assert (row["keypoints"], row["PCK @20 px"], row["mean px"]) == ("100", "0.65", "-")
    assert cells(section.table, "Baxter", "paper: DRHeC")["PCK @20 px"] == "0.65"
    (remark,) = section.remarks
    assert remark.verdict is Verdict.AGREES
    assert "65 [43, 82] % within 20 px" in remark.text
