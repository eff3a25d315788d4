"""The wheel holds what it should, and a stranger's wheel is discovered next to ours."""

import json
import os
import subprocess
import sys
import zipfile
from pathlib import Path

import pytest

from hecbench import __version__

ROOT = Path(__file__).resolve().parents[2]
TOY = ROOT / "tests" / "third_party" / "toy_calibrator"
PACKAGES = ("hecbench", "hecbench_plugins", "hecbench_hardware", "hecbench_datasets")


def build_wheel(source, destination):
    command = [sys.executable, "-m", "build", "--wheel", "--no-isolation", "--outdir", destination, source]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    return next(Path(destination).glob("*.whl"))


@pytest.fixture(scope="module")
def wheel(tmp_path_factory):
    return build_wheel(ROOT, tmp_path_factory.mktemp("wheel"))


def test_wheel_holds_the_four_packages_and_nothing_else(wheel):
    names = zipfile.ZipFile(wheel).namelist()
    assert {name.split("/")[0] for name in names} == {*PACKAGES, f"hecbench-{__version__}.dist-info"}
    assert {f"{package}/py.typed" for package in PACKAGES} <= set(names)
    assert "hecbench/report/templates/report.html.j2" in names
    assert not [name for name in names if "__pycache__" in name or name.startswith("tests")]


def test_wheel_passes_check_wheel_contents(wheel):
    command = [
        Path(sys.executable).parent / "check-wheel-contents",
        "--toplevel", ",".join(PACKAGES),
        "--ignore", "W002",
        wheel,
    ]  # fmt: skip
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr


@pytest.mark.parametrize("folder", ["plugins", "hardware", "datasets", "tests"])
def test_no_folder_shadows_a_package_of_its_name(folder):
    """A `datasets/__init__.py` would shadow a well-known package for everyone who works from the checkout."""
    assert not (ROOT / folder / "__init__.py").exists()


def test_a_third_party_wheel_is_discovered_and_its_faults_survived(tmp_path):
    """Built, installed and listed: one good solver, one broken module, one claim on a taken name."""
    site = tmp_path / "site"
    wheel = build_wheel(TOY, tmp_path)
    command = [
        sys.executable,
        "-m",
        "pip",
        "install",
        "--quiet",
        "--no-deps",
        "--no-index",
        "--target",
        site,
        wheel,
    ]
    subprocess.run(command, check=True, capture_output=True)
    environment = {**os.environ, "PYTHONPATH": str(site)}

    def hecbench(*arguments):
        executable = Path(sys.executable).parent / "hecbench"
        return subprocess.run(
            [executable, *arguments], env=environment, capture_output=True, text=True, check=False
        )

    rows = json.loads(hecbench("plugins", "--json").stdout)
    toy = next(row for row in rows if row["name"] == "toy")
    assert (toy["status"], toy["distribution"], toy["version"]) == ("ready", "toy-calibrator", "0.3.0")
    broken = next(row for row in rows if row["name"] == "toy_broken")
    assert (broken["status"], broken["kind"]) == ("broken", None)
    assert "licence dongle" in broken["detail"]
    claims = [row for row in rows if row["name"] == "horaud"]
    assert {row["status"] for row in claims} == {"conflict"}
    assert "hecbench and toy-calibrator" in claims[0]["detail"]
    assert next(row for row in rows if row["name"] == "park")["status"] == "ready"

    checked = hecbench("conformance", "toy", "--json")
    assert checked.returncode == 0, checked.stdout
    refused = hecbench("conformance", "horaud")
    assert refused.returncode == 2
    assert "conflict" in refused.stderr
