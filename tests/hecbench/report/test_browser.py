"""The page in a real browser: no error on the console, the verdict without scrolling, tables that sort."""

import numpy as np

from hecbench import conformance, preparation
from hecbench.recording import Mounting


def test_a_board_recording_with_photographs(screen, calibrated, photographs, tmp_path):
    page = calibrated(tmp_path, photographs, ["bundle", "shah", "park", "li"])
    assert page.stat().st_size < 3e6
    screen.at_size(1280, 800)
    screen.open(page)
    assert not screen.errors()
    for selector in (".grade", ".expect", "dl.pose", ".viewer img"):
        assert 0 < screen.bottom(selector) <= 800
    loaded = screen.run("return [...document.images].every(i => i.complete && i.naturalWidth > 0)")
    assert loaded
    images = "return [...document.querySelectorAll('.viewer img')].map(i => i.hidden)"
    screen.run("document.querySelectorAll('.viewer button')[2].click()")
    assert [i for i, hidden in enumerate(screen.run(images)) if not hidden] == [2]
    _sorts(screen)
    links = "return [...document.querySelectorAll('nav a')].every(a => document.querySelector(a.getAttribute('href')))"
    assert screen.run(links)


def _sorts(screen):
    """A click on the last column orders its rows by that number."""
    values = screen.run(
        "const table = document.querySelector('table.sortable');"
        "const heads = table.tHead.rows[0].cells; heads[heads.length - 1].click();"
        "return [...table.tBodies[0].rows].map(r => parseFloat(r.cells[heads.length - 1].textContent))"
    )
    assert values == sorted(values)
    assert len(values) > 2


def test_a_narrow_screen(screen, calibrated, photographs, tmp_path):
    page = calibrated(tmp_path, photographs.subset(range(8)), ["bundle", "shah"])
    screen.at_size(380, 800)
    screen.open(page)
    assert not screen.errors()
    assert screen.run("return document.documentElement.scrollWidth") <= 380
    assert screen.bottom(".expect") <= 800


def test_a_recording_without_photographs_shows_no_viewer(screen, calibrated, tmp_path):
    rig = conformance.rig(np.random.default_rng(1), Mounting.EYE_IN_HAND, noise=1e-4)
    page = calibrated(tmp_path, preparation.prepare(rig), ["shah", "park"])
    screen.open(page)
    assert not screen.errors()
    assert screen.run("return document.querySelector('.viewer')") is None
    assert "rings" not in page.read_text().split("<h2>")[0]
