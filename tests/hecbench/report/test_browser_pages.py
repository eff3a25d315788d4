"""Every kind of page in a real browser: no error, nothing too wide or too large, and only what is there."""

import subprocess
import sys
from dataclasses import replace

import pytest

from hecbench.report import html

LARGEST_BYTES = 3e6
WIDTHS = (1280, 380)


def command(*words):
    subprocess.run([sys.executable, "-m", "hecbench", *words], check=True, capture_output=True)


@pytest.fixture(scope="module")
def mixed(calibrated, photographs, tmp_path_factory):
    return calibrated(tmp_path_factory.mktemp("mixed"), photographs, ["render_gn_free", "bundle", "shah"])


@pytest.fixture(scope="module")
def markerless(calibrated, photographs, tmp_path_factory):
    bare = replace(photographs, target=None, corners_px=None, camera_T_target=None)
    return calibrated(tmp_path_factory.mktemp("markerless"), bare, ["render_gn_free"])


@pytest.fixture(scope="module")
def study(tmp_path_factory):
    """All marker solvers on two levels."""
    out = tmp_path_factory.mktemp("study") / "out"
    levels = ("--level", "tag_2m", "--level", "board_2m")
    command("run", "markers", *levels, "--samples", "5", "--out", str(out))
    return html.write(out).path


@pytest.fixture(scope="module")
def trials(tmp_path_factory):
    pytest.importorskip("mujoco", reason="the contact sweep needs mujoco: pip install 'hecbench[lab]'")
    out = tmp_path_factory.mktemp("trials") / "out"
    command("trial", "grasp", "--offset-mm", "3", "--no-render", "--trials", "9", "--out", str(out))
    return html.write(out).path


@pytest.mark.parametrize("width", WIDTHS)
@pytest.mark.parametrize("kind", ["mixed", "markerless", "study", "trials"])
def test_a_page(request, screen, kind, width):
    page = request.getfixturevalue(kind)
    assert page.stat().st_size < LARGEST_BYTES
    screen.at_size(width, 800)
    screen.open(page)
    assert not screen.errors()
    assert screen.run("return document.documentElement.scrollWidth") <= width
    shown = screen.run("return document.body.innerText")
    for word in ("mathdefault", "undefined", "[nan", "None"):
        assert word not in shown


@pytest.mark.parametrize("kind", ["mixed", "markerless"])
def test_the_verdict_and_the_photographs_are_seen_at_once(request, screen, kind):
    page = request.getfixturevalue(kind)
    for width in WIDTHS:
        screen.at_size(width, 800)
        screen.open(page)
        assert 0 < screen.bottom(".grade") <= 800
        assert 0 < screen.bottom(".expect") <= 800
    loaded = "return [...document.querySelectorAll('.viewer img')].filter(i => i.naturalWidth > 0).length"
    assert screen.run(loaded) >= 8


def test_a_page_without_a_board_does_not_speak_of_one(markerless):
    text = markerless.read_text()
    assert "Rings: observed corners" not in text
    assert "held-out prediction of the board" not in text


def test_a_study_says_first_who_is_first(study, screen):
    screen.at_size(1280, 800)
    screen.open(study)
    first = screen.run("return document.querySelector('section').innerText")
    assert first.startswith("Which solver is first")
    assert "tag_2m" in first
    assert "board_2m" in first
    assert 0 < screen.bottom("section") <= 800
    assert len(screen.run("return [...document.querySelector('.panels').querySelectorAll('p')]")) == 13


@pytest.mark.parametrize("width", WIDTHS)
def test_the_numbers_of_a_study_are_seen_without_sideways_scrolling(study, screen, width):
    screen.at_size(width, 800)
    screen.open(study)
    rights = screen.run(
        "return [...document.querySelectorAll('section:first-of-type td'),"
        "  ...document.querySelectorAll('section:nth-of-type(2) tr > :nth-child(3)')]"
        "  .map(cell => { const range = document.createRange(); range.selectNodeContents(cell);"
        "    return range.getBoundingClientRect().right; })"
    )
    assert len(rights) > 20
    assert max(rights) <= width
    text = "return [...document.querySelectorAll('.panels text')].map(t => t.getBoundingClientRect().height)"
    assert min(screen.run(text)) >= 8


def test_trials_of_one_task_mention_no_other(trials):
    text = trials.read_text()
    assert "insertion" not in text
    assert "trials of" in text
