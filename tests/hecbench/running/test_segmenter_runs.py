"""Runs with the masks of a segmenter: named in the result, resumed by name, refused in one sentence."""

from dataclasses import replace

import numpy as np
import pytest
from hecbench_datasets.suites import synthetic
from hecbench_plugins.evaluators.mask_iou import of_masks

from hecbench import registry
from hecbench.conformance import rig
from hecbench.errors import InputError
from hecbench.estimate import Estimate, Status
from hecbench.recording import Mounting
from hecbench.report.tables import groups
from hecbench.running import planning, runner, solving
from hecbench.running.solving import Options
from hecbench.specs import Kind, SolverSpec


def spec(name):
    return registry.load().get(Kind.SOLVER, name, SolverSpec)


@pytest.fixture(scope="module")
def scene():
    return synthetic.make("LP", 0, 4)


def test_the_estimate_names_the_segmenter_and_tells_the_overlaps(scene):
    (found,) = solving.solve(scene, [spec("render_gn")], Options(segmenter="given"))
    assert found.provenance["masks"] == "given"
    assert found.diagnostics["masks_iou_given"] == 1
    assert found.diagnostics["mask_iou"] > 0.97
    assert found.errors["masks_iou_truth"] > 0.97


def test_a_bad_mask_overlaps_less_with_the_truth(scene):
    shifted = replace(scene, masks=(np.roll(scene.masks[0], 6, 1),))
    overlap = of_masks(Estimate(np.eye(4)), shifted, solve=None, rng=None)["masks_iou_truth"]
    assert 0.5 < overlap < 0.9


def test_left_out_views_are_predicted_where_there_is_no_target():
    views = synthetic.make("views_3", 0, 4)
    (found,) = solving.solve(views, [spec("render_gn")], Options(held_out=True))
    held_out = found.held_out
    assert (held_out["folds"], held_out["failed_folds"], held_out["samples"]) == (3, 0, 3)
    assert held_out["mask_iou"] > 0.97
    assert "mask_iou_interval" not in held_out  # of three values


def test_without_masks_robot_methods_are_refused_and_marker_methods_run(scene):
    bare = replace(scene, masks=None)
    (refused,) = solving.solve(bare, [spec("render_gn")], Options(segmenter="given"))
    assert refused.status is Status.REFUSED
    assert "segmenter 'given'" in refused.reason
    markers = rig(np.random.default_rng(3), Mounting.EYE_TO_HAND)
    (solved,) = solving.solve(markers, [spec("park")], Options(segmenter="given"))
    assert solved.status is Status.OK


def test_resume_keeps_the_results_of_each_segmenter_apart(tmp_path):
    tasks = planning.suite_tasks("synthetic", ("LP",), 1, ("render_gn",), 0, "given")
    runner.run(tasks, Options(), out=tmp_path)
    runner.run(tasks, Options(segmenter="given"), out=tmp_path, resume=True)
    contents = runner.run(tasks, Options(segmenter="given"), out=tmp_path, resume=True)
    assert [e.provenance["masks"] for e in contents.estimates] == [None, "given"]
    assert [group.title for group in groups(contents.estimates)] == [
        "synthetic: LP",
        "synthetic: LP, masks: given",
    ]


def test_an_unknown_segmenter_is_bad_usage(scene):
    with pytest.raises(InputError, match="no segmenter is called 'no_such'"):
        planning.solvers_for(("park",), scene, "no_such")
