"""The examples and the README's code run as they stand."""

import re
import subprocess
import sys
from pathlib import Path
from types import ModuleType, SimpleNamespace

import numpy as np
import pytest

from hecbench import conformance, registry
from hecbench.recording import Mounting
from hecbench.storage import recording_io

ROOT = Path(__file__).parents[2]
SAYS = {
    "01_marker_methods": "bundle ",
    "02_without_markers": "standard deviations",
    "03_check_before_you_solve": "1 critical",
    "04_your_own_solver": "n = 10",
    "05_write_a_recording": "12 samples",
    "06_a_fair_table": "paired test: p = ",
}


def test_every_example_is_tried():
    assert {path.stem for path in (ROOT / "examples").glob("*.py")} == set(SAYS)


@pytest.mark.parametrize("name", SAYS)
def test_example(name, tmp_path):
    done = subprocess.run(
        [sys.executable, ROOT / "examples" / f"{name}.py"],
        capture_output=True, text=True, cwd=tmp_path, check=False,
    )  # fmt: skip
    assert done.returncode == 0, done.stderr
    assert SAYS[name] in done.stdout


def readme_code():
    return re.findall(r"```python\n(.*?)```", (ROOT / "README.md").read_text(), re.S)


def test_readme_writes_a_recording(tmp_path, monkeypatch, rng):
    monkeypatch.chdir(tmp_path)
    rig = conformance.rig(rng, Mounting.EYE_TO_HAND)
    (code,) = [code for code in readme_code() if "recording_io.save" in code]
    given = {
        "base_T_flange": rig.base_T_flange,
        "K": np.array([[900.0, 0, 640], [0, 900, 360], [0, 0, 1]]),
        "distortion": np.zeros(5),
        "corners_px": rng.uniform(0, 700, (12, 63, 2)),
    }
    exec(compile(code, "README.md", "exec"), given)
    assert len(recording_io.load(tmp_path / "my_cell")) == 12


def test_readme_solver_is_a_plugin(monkeypatch):
    (code,) = [code for code in readme_code() if "hecbench_solvers" in code]
    module = ModuleType("readme_solver")
    exec(compile(code, "README.md", "exec"), vars(module))
    monkeypatch.setitem(sys.modules, module.__name__, module)
    entry = SimpleNamespace(name="readme", value="readme", dist=None, load=lambda: module)
    (plugin,) = registry.build([entry]).plugins
    assert (plugin.name, plugin.status) == ("mine", registry.PluginStatus.READY)
