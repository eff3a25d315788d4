"""What the scripts in benchmarks/ write into docs/data."""

import json
import runpy
from pathlib import Path

FIGURES_FILE = runpy.run_path(str(Path(__file__).parents[2] / "benchmarks" / "figures_file.py"))


def test_figures_replace_those_of_their_name_alone(tmp_path):
    path = tmp_path / "data" / "figures.json"
    for figures in ({"lab": {"n": 1}}, {"lit": {"n": 2}}, {"lab": {"n": 3}}):
        FIGURES_FILE["replace"](path, figures)
    assert json.loads(path.read_text()) == {"lab": {"n": 3}, "lit": {"n": 2}}


def test_the_command_can_be_given_again(monkeypatch):
    monkeypatch.setattr("sys.argv", ["/somewhere/benchmarks/store_figures.py", "lab", "--out", "x.json"])
    assert FIGURES_FILE["command"]() == "python benchmarks/store_figures.py lab --out x.json"
