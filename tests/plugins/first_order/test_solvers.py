"""Each first-order method from a near start, and what it says of input that it cannot use."""

from dataclasses import replace

import numpy as np
import pytest
from hecbench_datasets.suites import synthetic

from hecbench import registry, se3
from hecbench.errors import InputError, Refusal
from hecbench.estimate import Estimate, Status, Termination
from hecbench.report.tables import groups, table
from hecbench.running import solving
from hecbench.specs import Kind, SolverSpec

pytest.importorskip("torch")

METHODS = {
    "easyhec[iterations=200]": 3.0,
    "easyhec[iterations=200,masks=zbuffered]": 3.0,
    "ipe[iterations=200]": 6.0,
    "drhec_rgb[iterations=200]": 1.0,
    "drhec_rgbc[iterations=200]": 1.0,
    "drhec[iterations=250]": 1.0,
    "drhec[iterations=300,variant=literal]": 3.0,
}
"""Solver and the mm within which it ends; a mask of sampled pixels leaves about a millimetre."""


@pytest.mark.parametrize(("name", "limit_mm"), METHODS.items())
def test_it_converges_from_a_near_start(name, limit_mm, scene, solve, error_of):
    estimate = solve(name, scene)
    mm, rad = error_of(estimate, scene)
    assert mm < limit_mm
    assert rad < limit_mm / 1000
    assert estimate.diagnostics["in_frame"]
    assert estimate.diagnostics["overlap"] > 0.95
    assert estimate.termination is Termination.MAX_ITERATIONS
    path = estimate.diagnostics["path"]
    assert 2 < len(path) <= 40
    start = np.asarray(scene.initial_parent_T_camera)
    np.testing.assert_allclose(se3.exp(np.array(path[0][2])), start, atol=1e-5)
    assert path[-2][1] < path[0][1]


def test_easyhecpp_needs_no_start(exact, solve, error_of):
    unstarted = replace(exact, initial_parent_T_camera=None)
    mm, rad = error_of(estimate := solve("easyhecpp[iterations=200,masks=zbuffered]", unstarted), exact)
    assert mm < 3
    assert rad < 0.003
    assert estimate.diagnostics["start_overlap"] > 0.7


def test_several_views_are_one_pose(solve, error_of, start_off):
    several = start_off(synthetic.make("views_3", 0, 0), [1.0, -1.0, 1.0], [0.01, -0.01, 0.01])
    for name in ("easyhec[iterations=120]", "drhec[iterations=120]"):
        assert error_of(solve(name, several), several)[0] < 3


def test_the_same_recording_gives_the_same_estimate(scene, solve):
    first, second = (solve("drhec[iterations=20]", scene).parent_T_camera for _ in range(2))
    np.testing.assert_array_equal(first, second)


@pytest.mark.parametrize("variant", ["literal", "resolved"])
def test_the_coarse_stage_does_not_turn(variant, exact, solve):
    estimate = solve(f"drhec[iterations=8,variant={variant}]", exact)
    assert estimate.diagnostics["steps_by_stage"] == {"coarse": 8}
    np.testing.assert_allclose(
        estimate.parent_T_camera[:3, :3], exact.initial_parent_T_camera[:3, :3], atol=1e-9
    )


def test_threshold_zero_means_no_stages_or_an_endless_coarse_one(scene, solve):
    resolved = solve("drhec[iterations=5,threshold=0]", scene)
    literal = solve("drhec[iterations=5,threshold=0,variant=literal]", scene)
    assert resolved.diagnostics["steps_by_stage"] == {"one stage": 5}
    assert literal.diagnostics["steps_by_stage"] == {"coarse": 5}


def test_literal_answers_with_the_last_iterate_and_resolved_with_the_best_fine_one(scene, solve):
    resolved = solve("drhec[iterations=150]", scene)
    assert resolved.diagnostics["best_iteration"] < 150
    assert len(resolved.diagnostics["last_parent_T_camera"]) == 4
    assert "best_iteration" not in solve("drhec[iterations=5,variant=literal]", scene).diagnostics


@pytest.mark.parametrize("name", ["easyhec", "ipe", "drhec"])
def test_a_robot_out_of_the_picture_is_a_failure_with_its_reason(name, exact, solve, start_off):
    estimate = solve(name, start_off(exact, [0, 0, 0], [3.0, 0, 0]))
    assert (estimate.status, estimate.termination) == (Status.FAILED, Termination.OUT_OF_FRAME)
    assert "not in the picture at the start" in estimate.reason
    assert estimate.diagnostics["in_frame"] is False


def test_a_robot_that_leaves_the_picture_ends_the_run(exact, solve, start_off):
    """Only a corner of the robot is in the picture, and without overlap its masks' error falls as it goes."""
    estimate = solve("easyhec", start_off(exact, [0, 0, 0], [1.0, 0, 0]))
    assert estimate.status is Status.FAILED
    assert "left the picture in iteration" in estimate.reason
    assert 0 < estimate.iterations < 1000
    assert len(estimate.diagnostics["path"]) > 1


@pytest.mark.parametrize(
    ("name", "change", "reason"),
    [
        ("easyhec", {"masks": None}, "masks"),
        ("ipe", {"masks": None}, "masks"),
        ("easyhecpp", {"masks": None}, "masks"),
        ("drhec", {"images": None}, "images"),
        ("drhec", {"initial_parent_T_camera": None}, "initial"),
        ("easyhec", {"masks": (np.zeros((480, 640), np.uint8),)}, "0.0 % of the image"),
        ("drhec", {"masks": (np.zeros((480, 640), np.uint8),)}, "0.0 % of the image"),
        ("ipe", {"robot": None}, "robot_model"),
    ],
)
def test_what_is_missing_is_refused_by_name(name, change, reason, scene):
    blind = replace(scene, **change)
    spec = registry.load().get(Kind.SOLVER, name, SolverSpec)
    (estimate,) = solving.solve(blind, [spec])
    assert estimate.status is Status.REFUSED
    assert reason in estimate.reason


def test_a_search_on_a_hemisphere_needs_a_fixed_camera(exact, solve):
    from hecbench.recording import Mounting

    with pytest.raises(Refusal, match="eye_to_hand only"):
        solve("easyhecpp", replace(exact, mounting=Mounting.EYE_IN_HAND))


def test_nvdiffrast_that_is_missing_is_refused(scene, solve):
    with pytest.raises(Refusal, match="backend=cpu"):
        solve("easyhec[backend=nvdiffrast]", scene)


@pytest.mark.parametrize(
    "name",
    [
        "easyhec[masks=summed]",
        "easyhec[iterations=0]",
        "ipe[gamma=0]",
        "drhec[variant=printed]",
        "drhec[lambda_cen=-1]",
        "drhec[threshold=nan]",
        "drhec_rgb[lambda_cen=0.1]",
        "drhec_rgbc[lambda_area=0.1]",
        "drhec[backend=cuda]",
    ],
)
def test_options_that_are_not_understood_are_named(name):
    option = name.partition("[")[2].partition("=")[0]
    with pytest.raises(InputError, match=option):
        registry.load().get(Kind.SOLVER, name, SolverSpec)


def test_a_translator_that_does_not_exist_is_named(scene, solve):
    with pytest.raises(InputError, match="no translator is called 'no_such'"):
        solve("drhec[translator=no_such]", scene)


def test_pictures_that_are_not_simulated_are_told_in_the_tables(start_off, solve):
    brighter = start_off(synthetic.make("gain", 0, 0), [0.5, 0, 0], [0.005, 0, 0])
    plain = solve("drhec[iterations=30]", brighter)
    assert "colours differ" in plain.diagnostics["not_as_published"]
    named = replace(plain, solver="drhec", suite="paper", level="gain", item="0")
    assert any("drhec is not the published method" in note for note in table(groups([named])[0]).notes)
    translated = solve("drhec[iterations=30,translator=part_colours]", brighter)
    assert translated.diagnostics["translator"] == "part_colours"
    assert "not_as_published" not in translated.diagnostics


def test_simulated_pictures_need_no_translator(scene, solve):
    estimate = solve("drhec[iterations=100]", scene)
    assert isinstance(estimate, Estimate)
    assert "not_as_published" not in estimate.diagnostics
