"""The 3D view: what is placed where, and that a browser shows it."""

import numpy as np
import pytest

from hecbench import preparation, registry
from hecbench.errors import InputError
from hecbench.estimate import Estimate
from hecbench.report import recommended, viewer
from hecbench.running import solving
from hecbench.specs import Kind, SolverSpec, SuiteSpec

pytest.importorskip("viser")


@pytest.fixture(scope="module")
def recording():
    suite = registry.load().get(Kind.SUITE, "photographs", SuiteSpec)
    return preparation.prepare(suite.make("ur3e", 0, 0))


@pytest.fixture(scope="module")
def stage(recording):
    specs = [registry.load().get(Kind.SOLVER, name, SolverSpec) for name in ("bundle_fixed", "shah")]
    estimates = solving.solve(recording, specs, solving.Options(held_out=False))
    shown = viewer.Stage(viewer.open_server("127.0.0.1", 0), recording, estimates)
    yield shown
    shown.close()


def pose(handle):
    from hecbench import se3

    return se3.from_quat_wxyz(np.asarray(handle.wxyz), np.asarray(handle.position))


def test_cameras_and_links_are_where_the_answer_puts_them(stage, recording):
    for sample in (0, 7):
        stage.show(sample)
        for frustum, estimate in zip(stage._frusta, stage.estimates, strict=True):
            np.testing.assert_allclose(pose(frustum), estimate.parent_T_camera, atol=1e-6)
        links = stage._links[sample]
        for link, mesh in stage._robot._meshes:
            np.testing.assert_allclose(pose(mesh), links[link], atol=1e-6)
    assert stage._frusta[0].image.shape[:2] == (360, 640)


def test_a_click_says_how_far_the_others_are(stage):
    stage._say_distances("shah")
    apart_m = np.linalg.norm(np.subtract(*(e.parent_T_camera[:3, 3] for e in stage.estimates)))
    assert f"bundle_fixed: {1e3 * apart_m:.2g} mm" in stage._text.content


def test_a_browser_shows_the_saved_scene(stage, browser, tmp_path):
    stage.save(tmp_path / "scene.html")
    browser.get((tmp_path / "scene.html").as_uri())
    from selenium.webdriver.common.by import By
    from selenium.webdriver.support.ui import WebDriverWait

    WebDriverWait(browser, 120).until(lambda shown: shown.find_elements(By.TAG_NAME, "canvas"))
    assert not [entry for entry in browser.get_log("browser") if entry["level"] == "SEVERE"]
    with pytest.raises(InputError, match="ends in"):
        stage.save(tmp_path / "scene.obj")


def test_an_answer_of_another_recording_is_refused(recording, tmp_path):
    Estimate(np.eye(4), solver="x", mounting="eye_in_hand", parent_link="tool0").save(tmp_path / "x.json")
    with pytest.raises(InputError, match="eye_in_hand from tool0"):
        recommended.all_of([tmp_path / "x.json"], recording)
