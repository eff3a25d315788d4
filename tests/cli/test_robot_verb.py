"""`hecbench robot`: the contract of its JSON, names of packages, and one line when refused."""

import json
import sys

import numpy as np
import pytest
from PIL import Image

from hecbench.errors import InputError
from hecbench.robots import packages
from hecbench.robots.model import load_robot

URDF = '<robot name="r"><link name="a"/>{}</robot>'


def test_json_keys_and_picture(hecbench, tmp_path):
    done = hecbench(
        "robot", "ur5e", "--json", "--picture", tmp_path / "p.png", "--joints", "0,-1.5,1.5,0,0,0"
    )
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout)
    assert list(found) == ["name", "links", "joints", "parts", "faces", "extent_m", "colours", "notes"]
    assert set(found["joints"][0]) == {"name", "type", "lower", "upper", "mimic"}
    moving = [joint for joint in found["joints"] if joint["type"] != "fixed"]
    assert [joint["name"] for joint in moving][:2] == ["shoulder_pan_joint", "shoulder_lift_joint"]
    assert (found["links"], found["parts"], found["faces"], found["colours"]) == (11, 20, 121783, 5)
    assert 0.5 < max(found["extent_m"]) < 1.3
    drawn = np.asarray(Image.open(tmp_path / "p.png"))
    assert 0.02 < (drawn < 250).any(2).mean() < 0.6


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        (["nothing.urdf"], "no such URDF file"),
        (["ur5e", "--joints", "1,2"], "6 needed"),
        (["ur5e", "--joints", "a"], "give numbers"),
        (["ur5e", "--picture", "a.jpg"], "only PNG"),
        (["no-such-package:a.urdf"], "pip install no-such-package"),
        (["numpy:a.urdf"], "numpy holds no URDF"),
        (["airo-models:nothing.urdf"], "there is no such file; choose among airo-models:"),
    ],
)
def test_refused_in_one_line(hecbench, arguments, reason):
    done = hecbench("robot", *arguments)
    assert done.returncode == 2
    assert done.stdout == ""
    assert len(done.stderr.splitlines()) == 1
    assert reason in done.stderr


@pytest.fixture
def packaged(tmp_path, monkeypatch):
    """Two installed distributions with URDFs, one of them with an entry point."""
    for name, entry in (
        ("acme-arms", "[hecbench.robots]\nbig_arm = acme_arms:urdf\nlost = acme_arms:gone\n"),
        ("bolt", ""),
    ):
        folder, info = tmp_path / name.replace("-", "_"), tmp_path / f"{name.replace('-', '_')}-1.2.dist-info"
        folder.mkdir()
        info.mkdir()
        (folder / "__init__.py").write_text(
            "from pathlib import Path\nurdf = Path(__file__).parent / 'arm.urdf'\n"
        )
        (folder / "arm.urdf").write_text(
            URDF.format(
                '<link name="b"/><joint name="j" type="fixed"><parent link="a"/><child link="b"/></joint>'
            )
        )
        (folder / f"{folder.name}_only.urdf").write_text(URDF.format(""))
        (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.2\n")
        (info / "entry_points.txt").write_text(entry)
        files = [f"{folder.name}/{file}" for file in ("__init__.py", "arm.urdf", f"{folder.name}_only.urdf")]
        (info / "RECORD").write_text("".join(f"{file},,\n" for file in files))
    monkeypatch.syspath_prepend(tmp_path)
    packages.of_distributions.cache_clear()
    yield
    packages.of_distributions.cache_clear()
    sys.modules.pop("acme_arms", None)


def test_robots_of_packages_by_name_and_path(packaged):
    for name in ("big_arm", "acme-arms:arm.urdf", "acme_arms:arm.urdf", "acme-arms:acme_arms/arm.urdf"):
        assert load_robot(name).links == ("a", "b")
    assert load_robot("bolt_only").links == ("a",)
    with pytest.raises(InputError, match=r"'arm' is there more than once: acme-arms:.*, bolt:.*choose"):
        load_robot("arm")
    with pytest.raises(InputError, match="robot 'lost' of acme-arms is broken"):
        load_robot("lost")
    rows = {robot.name: robot.row() for robot in packages.of_entry_points()}
    assert (rows["big_arm"]["status"], rows["lost"]["status"]) == ("ready", "broken")
    assert rows["big_arm"]["version"] == "1.2"


def test_plugins_lists_robots(hecbench):
    rows = json.loads(hecbench("plugins", "--kind", "robot", "--json").stdout)
    assert {"ur3e", "ur5e"} <= {row["name"] for row in rows if row["distribution"] == "airo-models"}
    assert all(
        set(row) >= {"name", "kind", "status", "needs", "detail", "distribution", "version"} for row in rows
    )
