"""What README says of the demo is what the demo says."""

import json
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
pytestmark = pytest.mark.timeout(
    1200
)  # every method on the photographs: half a minute of a core, more on a busy one
NUMBER = re.compile(r"-?\d+(?:\.\d+)?")


@pytest.fixture(scope="module")
def verdict(tmp_path_factory):
    """The verdict on the photographs that come with the package, as `hecbench demo` makes it."""
    from hecbench_datasets import photographs

    from hecbench.running import calibrating, planning
    from hecbench.running.solving import Options

    recording = photographs.make(photographs.UR3E, 0, 0)
    specs = planning.solvers_for((), recording)
    examined = calibrating.examine(recording)
    estimates = calibrating.solved(examined, specs, Options())
    found = calibrating.judged(examined, specs, estimates)
    found.save(tmp_path_factory.mktemp("demo") / "verdict.json")
    return json.loads(json.dumps(found.to_json()))


def rows():
    lines = [line for line in (ROOT / "README.md").read_text().splitlines() if line.startswith("|")]
    end = lines.index("|---|---|---|---|") + 6
    table = [[cell.strip() for cell in line.strip("|").split("|")] for line in lines[:end]]
    return {row[0]: row[1:] for row in table[2:]}


def test_the_table(verdict):
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


def test_the_verdict(verdict):
    text = (ROOT / "README.md").read_text()
    said = re.search(r"The verdict on them: \*\*(.+)\*\*, expected error in the workspace (.+)\.\n", text)
    assert said[1].replace(" ", "_") == verdict["grade"]
    expected = [verdict["expected_error_mm"][name] for name in ("value", "low", "high")]
    assert [float(n) for n in NUMBER.findall(said[2])] == pytest.approx(expected, rel=0.1)
