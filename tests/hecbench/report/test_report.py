"""Tables count every run, figures draw what the evidence holds, and the page works in a browser."""

import re
import shutil
import subprocess
import xml.etree.ElementTree as ET
from dataclasses import replace

import numpy as np
import pytest
from hecbench_plugins.markers.target_poses import project as opencv_project

from hecbench import conformance, registry, se3
from hecbench.errors import InputError
from hecbench.estimate import Estimate, Status
from hecbench.recording import CameraModel, Mounting
from hecbench.report import html
from hecbench.report.recording_figures import (
    agreement_figure,
    overlays,
    project,
    residual_figure,
    residuals_px,
    scene_figure,
)
from hecbench.report.tables import groups, table
from hecbench.running import runner, solving
from hecbench.running.runner import Options, Task
from hecbench.specs import Kind, SolverSpec
from hecbench.storage import evidence, recording_io


def run_of(solver, tre_mm, index):
    place = {"suite": "s", "level": "l", "item": f"{index}", "solver": solver}
    if tre_mm is None:
        return Estimate(status=Status.REFUSED, reason="one axis", **place)
    errors = {"tre_mm": tre_mm, "translation_error_mm": tre_mm, "rotation_error_deg": 0.1}
    return Estimate(np.eye(4), errors=errors, **place)


def test_medians_and_rates_count_runs_without_an_answer():
    runs = [run_of("good", mm, i) for i, mm in enumerate([1.0, 2.0, 3.0, 4.0, 6.0])]
    runs += [run_of("quits", mm, i) for i, mm in enumerate([1.0, 1.0, None, None, None])]
    (group,) = groups(runs)
    found = table(group)
    rows = {row[0]: dict(zip(found.header, row, strict=True)) for row in found.rows}
    assert rows["good"]["TRE median mm [95 %]"].startswith("3 [")
    assert rows["quits"]["TRE median mm [95 %]"].startswith("∞")
    assert rows["quits"]["TRE mean mm"] == "1"
    assert rows["quits"]["answered"] == "2 of 5"
    within = next(name for name in found.header if name.startswith("within"))
    assert rows["good"][within].startswith("4/5")
    assert rows["quits"][within].startswith("2/5")
    assert found.rows[0][0] == "good"
    assert any("quits refused 3 times, first: one axis" in note for note in found.notes)


def test_groups_are_levels_and_recordings():
    level = [run_of("a", 1.0, 0), run_of("b", 1.0, 0)]
    single = replace(run_of("a", 1.0, 0), suite="files", level=None, recording="cell", item="path")
    assert [(g.title, g.is_level, len(g.estimates)) for g in groups([*level, single])] == [
        ("cell (path)", False, 1),
        ("s: l", True, 2),
    ]


@pytest.fixture(scope="module", params=list(Mounting))
def calibrated(request):
    recording = conformance.rig(np.random.default_rng(2), request.param, noise=2e-4)
    picture = np.full((960, 1280, 3), 90, np.uint8)
    recording = replace(recording, images=(picture,) * len(recording))
    names = ("park", "shah", "bundle_fixed")
    specs = [registry.load().get(Kind.SOLVER, name, SolverSpec) for name in names]
    estimates = solving.solve(recording, specs)
    influence = np.linspace(0, 1, len(recording))
    return evidence.collect(recording, recording.sha256, [{"id": "units"}], influence), estimates


def test_projection_is_opencvs(rng):
    K = np.array([[900.0, 0, 640], [0, 910, 480], [0, 0, 1]])
    for count in (0, 4, 5, 8, 12, 14):
        camera = CameraModel(1280, 960, K, rng.uniform(-0.05, 0.05, count))
        points = rng.uniform([-0.3, -0.2, 0.8], [0.3, 0.2, 1.5], (20, 3))
        np.testing.assert_allclose(
            project(camera, points), opencv_project(camera, np.eye(4), points), atol=1e-8
        )
    assert np.isnan(project(camera, np.array([[0.0, 0, -1]]))).all()


def test_residuals_of_a_good_answer_are_small(calibrated):
    shown, estimates = calibrated
    for estimate in estimates:
        residuals = residuals_px(shown, estimate)
        assert residuals.shape == shown.corners_px.shape
        assert np.sqrt((residuals**2).sum(-1).mean()) < 2.0


def test_figures_are_svg(calibrated):
    shown, estimates = calibrated
    drawings = [
        scene_figure(shown, estimates[0]),
        residual_figure(shown, estimates[0]),
        agreement_figure(shown, estimates),
        *overlays(shown, estimates[0]),
    ]
    assert len(drawings) == 6
    for drawing in drawings:
        assert ET.fromstring(drawing).tag.endswith("svg")
    assert drawings[3].count('class="predicted"') == len(shown.points_m)


def test_figures_that_cannot_be_drawn_are_left_out(calibrated):
    shown, estimates = calibrated
    refused = Estimate(status=Status.REFUSED, reason="no")
    assert scene_figure(shown, refused) is None
    assert residual_figure(shown, refused) is None
    assert agreement_figure(shown, [refused, estimates[0]]) is None
    assert overlays(replace(shown, corners_px=None), estimates[0]) == []


def test_evidence_round_trip(calibrated, tmp_path):
    shown, _ = calibrated
    evidence.save(shown, tmp_path)
    read = evidence.load(tmp_path, shown.sha256)
    assert read.findings == [{"id": "units"}]
    assert (read.mounting, read.sample_ids, read.size) == (shown.mounting, shown.sample_ids, shown.size)
    assert read.pictures == shown.pictures
    np.testing.assert_array_equal(read.corners_px, shown.corners_px)
    assert evidence.load(tmp_path, "0" * 64) is None
    path = next((tmp_path / "evidence").iterdir())
    path.write_bytes(path.read_bytes()[:200])
    with pytest.raises(InputError, match="cannot be read"):
        evidence.load(tmp_path, shown.sha256)


def test_consistency_of_the_truth(exact_rig):
    from hecbench_plugins.evaluators.consistency import consistency, reconstruction_errors_m

    found = consistency(Estimate(exact_rig.truth_parent_T_camera), exact_rig, solve=None, rng=None)
    assert max(found.values()) < 1e-6
    worse = exact_rig.truth_parent_T_camera @ se3.from_rotvec([0.02, 0, 0], [0, 0, 0])
    assert reconstruction_errors_m(worse, exact_rig).mean() > 1e-5


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    """A report on a level and on a recording with pictures."""
    out = tmp_path_factory.mktemp("report")
    recording = conformance.rig(np.random.default_rng(2), Mounting.EYE_TO_HAND, noise=2e-4)
    texture = np.random.default_rng(0).integers(0, 255, (960, 1280, 3), dtype=np.uint8)
    recording = replace(recording.without_truth(), name="<cell & co>", images=(texture,) * len(recording))
    recording_io.save(recording, out / "cell")
    names = ("park", "shah", "tsai", "bundle_fixed")
    tasks = [Task(names, path=out / "cell")]
    tasks += [Task(names, suite="markers", level="board_2m", index=i) for i in range(3)]
    runner.run(tasks, Options(command="hecbench run markers"), out=out)
    return html.write(out).path


def test_page_is_self_contained_and_complete(written):
    text = written.read_text()
    assert not re.findall(r'(?:src|href)="(?!data:|#)', text)
    assert "&lt;cell &amp; co&gt;" in text
    assert "<cell & co>" not in text
    for part in (
        "Findings of the check",
        "markers: board_2m",
        "hecbench run markers",
        "Where this comes from",
    ):
        assert part in text
    assert text.count("<svg") >= 5
    assert text.count('class="overlay"') == 3


def test_same_results_give_the_same_page(written):
    before = written.read_bytes()
    assert html.write(written.parent).path.read_bytes() == before


def test_page_in_a_browser(written, tmp_path):
    """Headless Chromium shows it without a console message."""
    browser = shutil.which("chromium") or shutil.which("chromium-browser")
    if browser is None:
        pytest.skip("chromium is not installed")
    command = [
        browser, "--headless", "--no-sandbox", "--disable-gpu", "--disable-background-networking",
        "--disable-component-update", "--disable-sync", "--no-first-run", f"--user-data-dir={tmp_path / 'profile'}",
        "--enable-logging=stderr", "--v=0", "--window-size=1300,3000", f"--screenshot={tmp_path / 'page.png'}",
        written.as_uri(),
    ]  # fmt: skip
    done = subprocess.run(command, capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0, done.stderr
    assert "CONSOLE" not in done.stderr
    from PIL import Image

    shades = np.asarray(Image.open(tmp_path / "page.png").convert("L"))
    assert shades.shape == (3000, 1300)
    assert 0.01 < (shades < 200).mean() < 0.6


def test_a_store_without_whole_results_is_refused(tmp_path):
    (tmp_path / "estimates.jsonl").write_text('{"schema": "hecb')
    with pytest.raises(InputError, match="no whole result"):
        html.write(tmp_path)
