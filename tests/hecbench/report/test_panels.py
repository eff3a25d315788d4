"""Panels of error curves: one per solver, also of a single run, of no answer and of names that are no markup."""

import re
import xml.etree.ElementTree as ET

import numpy as np
import pytest

from hecbench.report.panels import panels


def drawings(curves, title="s: l"):
    return ET.fromstring(f"<figure>{panels(curves, title)}</figure>").findall(".//div/div/svg")


def curve_of(svg):
    return svg.find("path[@class='curve']").get("d")


def heights(svg):
    return [float(y) for y in re.findall(r"V([\d.]+)", curve_of(svg))]


def test_a_curve_climbs_at_every_answer_to_the_share_of_answers():
    whole, half = drawings([("a", np.array([1.0, 2.0, 3.0, 4.0]), 4), ("b", np.array([5.0, 6.0]), 4)])
    assert len(heights(whole)) == 4
    assert heights(whole) == sorted(heights(whole), reverse=True)
    top, bottom = heights(whole)[-1], float(curve_of(whole).split("H")[0].split()[1])
    assert heights(half)[-1] == pytest.approx((top + bottom) / 2)


def test_one_run_is_a_visible_step():
    (one,) = drawings([("a", np.array([1.0]), 1)])
    assert len(heights(one)) == 1
    assert one.findall("text")


def test_better_solvers_step_further_left():
    good, bad = drawings([("good", np.array([1.0]), 1), ("bad", np.array([10.0]), 1)])
    first_step = [float(re.search(r"H([\d.]+)", curve_of(svg))[1]) for svg in (good, bad)]
    assert first_step[0] < first_step[1]


def test_a_solver_without_answers_keeps_its_panel():
    _, none = drawings([("a", np.array([1.0]), 1), ("none", np.array([]), 3)])
    assert heights(none) == []


@pytest.mark.parametrize("errors", [[], [np.nan], [0.0]])
def test_nothing_to_draw(errors):
    assert panels([("a", np.array(errors), 1)], "l") is None


def test_an_exact_answer_is_at_the_left_end():
    (svg,) = drawings([("a", np.array([0.0, 1.0]), 2)])
    assert np.isfinite(heights(svg)).all()
    assert len(heights(svg)) == 2


@pytest.mark.parametrize("span", [1.0, 1.5, 8.0, 60.0, 1e6])
def test_ticks_are_few(span):
    (svg,) = drawings([("a", np.array([0.5, 0.5 * span]), 2)])
    assert len(svg.findall("text")) <= 3 + 5


def test_names_are_text_and_figures_of_two_levels_share_nothing():
    curves = [("<b>&", np.array([1.0]), 1)]
    (svg,) = drawings(curves)
    assert svg.find("title").text == "<b>&"
    names = [re.search(r'id="([^"]+)"', panels(curves, title))[1] for title in ("s: l", "s: m")]
    assert names[0] != names[1]
