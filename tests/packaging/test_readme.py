"""What README says of the demo is what the demo says."""

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
NUMBER = re.compile(r"-?\d+(?:\.\d+)?")


@pytest.mark.timeout(1200)  # every method on the photographs: half a minute of a core, more on a busy one
def test_the_demo_says_what_the_readme_says(tmp_path):
    command = [sys.executable, "-m", "hecbench", "demo", "--samples", "2", "--out", "demo"]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert "ur3e_photographs: GOOD" in done.stdout
    assert "markers: small_tag_2m" in done.stdout
    page = (tmp_path / "demo/report.html").read_text()
    assert len(page) < 3e6
    assert page.index("ur3e_photographs") < page.index("markers: small_tag_2m")
    verdict = json.loads((tmp_path / "demo/verdict.json").read_text())
    agrees_with_the_table(verdict)
    agrees_with_the_sentence(verdict)


def rows():
    lines = [line for line in (ROOT / "README.md").read_text().splitlines() if line.startswith("|")]
    end = lines.index("|---|---|---|---|") + 6
    table = [[cell.strip() for cell in line.strip("|").split("|")] for line in lines[:end]]
    return {row[0]: row[1:] for row in table[2:]}


def agrees_with_the_table(verdict):
    held_out = {e["solver"]: e["held_out"] for e in verdict["estimates"] if e["held_out"]}
    apart = {a["solver"]: a["distance_mm"] for a in [*verdict["agreement"], *verdict["rivals"]]}
    assert len(rows()) == 5
    for solver, (looks_at, prediction, distance) in rows().items():
        found = held_out[solver]
        expected = [found["target_mm"], *found["target_mm_interval"]]
        assert [float(n) for n in NUMBER.findall(prediction)] == pytest.approx(expected, rel=0.05)
        assert looks_at == ("the robot" if solver.startswith("render") else "the board")
        if distance == "recommended":
            assert verdict["recommended"] == solver
        else:
            assert float(distance) == pytest.approx(apart[solver], rel=0.1)


def agrees_with_the_sentence(verdict):
    text = (ROOT / "README.md").read_text()
    said = re.search(r"The verdict on them: \*\*(.+)\*\*, expected error in the workspace (.+)\.\n", text)
    assert said[1].replace(" ", "_") == verdict["grade"]
    expected = [verdict["expected_error_mm"][name] for name in ("value", "low", "high")]
    assert [float(n) for n in NUMBER.findall(said[2])] == pytest.approx(expected, rel=0.1)
