"""Estimates: what they insist on, and their JSON form."""

import json

import numpy as np
import pytest

from hecbench import estimate as module
from hecbench import se3
from hecbench.errors import InputError
from hecbench.estimate import Estimate, Status, Termination, best_first, ordering_metric
from hecbench.recording import CameraModel, Mounting

SCHEMA_KEYS = [
    "schema", "solver", "recording", "mounting", "parent_link", "camera", "status", "reason", "parent_T_camera",
    "carrier_T_target", "covariance", "termination", "iterations", "renders", "seconds", "diagnostics", "extras",
    "errors", "held_out", "provenance",
]  # fmt: skip


def test_json_has_the_keys_of_the_schema_in_order():
    found = Estimate(np.eye(4)).to_json()
    assert list(found) == SCHEMA_KEYS
    assert found["schema"] == "hecbench.estimate/1"


def test_file_round_trip(tmp_path, rng):
    written = Estimate(
        se3.exp(rng.normal(size=6)),
        covariance=np.diag(np.arange(1.0, 7.0)),
        termination=Termination.CONVERGED,
        diagnostics={"spread": np.float64(1.5), "flags": np.array([True, False]), "none": np.nan},
        camera=CameraModel(640, 480, np.array([[600.0, 0, 320], [0, 600, 240], [0, 0, 1]]), np.zeros(5)),
        mounting=Mounting.EYE_IN_HAND,
        held_out={"target_mm": 3.0},
        suite="markers",
        level="tag_2m",
        item="000001",
    )
    written.save(tmp_path / "deep" / "park.json")
    read = module.load(tmp_path / "deep" / "park.json")
    assert read.to_json() == written.to_json()
    assert read.diagnostics == {"spread": 1.5, "flags": [True, False], "none": None}
    json.loads((tmp_path / "deep" / "park.json").read_text())


def test_files_of_version_0_1_are_read():
    written = Estimate(np.eye(4), carrier_T_target=se3.exp(np.arange(6) / 10)).to_json()
    written["other_T_target"] = written.pop("carrier_T_target")
    read = module.decode(json.dumps(written).encode(), "old.json")
    np.testing.assert_allclose(read.carrier_T_target, se3.exp(np.arange(6) / 10))


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({}, "status 'ok' with parent_T_camera None"),
        ({"parent_T_camera": np.eye(4), "status": Status.REFUSED, "reason": "no"}, "status 'refused' with"),
        ({"status": Status.FAILED}, "needs a reason"),
        ({"parent_T_camera": np.diag([1, 1, -1, 1])}, "not a rigid transform"),
        ({"parent_T_camera": np.full((4, 4), np.nan)}, "not a rigid transform"),
        ({"parent_T_camera": np.eye(3)}, "not a rigid transform"),
    ],
)
def test_inconsistent_estimates_are_refused(arguments, message):
    with pytest.raises(InputError, match=message):
        Estimate(**arguments)


@pytest.mark.parametrize("content", [b"", b"{}", b'{"schema": "hecbench.estimate/2"}', b"\xff"])
def test_bad_files_are_one_line(tmp_path, content):
    path = tmp_path / "bad.json"
    path.write_bytes(content)
    with pytest.raises(InputError, match=r"bad.json: is not a hecbench.estimate/1") as caught:
        module.load(path)
    assert "\n" not in str(caught.value)


def test_best_first_prefers_prediction_then_error_then_any_answer():
    refused = Estimate(status=Status.REFUSED, reason="no", solver="refused")
    bare = Estimate(np.eye(4), solver="bare")
    good = Estimate(np.eye(4), solver="good", errors={"tre_mm": 1.0})
    bad = Estimate(np.eye(4), solver="bad", errors={"tre_mm": 9.0})
    assert [e.solver for e in best_first([refused, bad, bare, good])] == ["good", "bad", "bare", "refused"]
    predicts = [Estimate(np.eye(4), solver=str(px), held_out={"reprojection_px": px}) for px in (2.0, 0.5)]
    assert [e.solver for e in best_first(predicts)] == ["0.5", "2.0"]


def measured(solver, **sections):
    return Estimate(np.eye(4), solver=solver, **sections)


def test_one_metric_orders_all_methods():
    """Pixels are never compared with millimetres, and no metric is taken that most answers lack."""
    both = measured("both", held_out={"target_mm": 3.0, "reprojection_px": 0.1})
    better = measured("better", held_out={"target_mm": 2.0, "reprojection_px": 0.9})
    spread = measured("spread", diagnostics={"target_spread_mm": 0.1})
    missing = Estimate(solver="missing", status=Status.FAILED, reason="r")
    ordered = best_first([missing, spread, both, better])
    assert [e.solver for e in ordered] == ["better", "both", "spread", "missing"]
    assert ordering_metric(ordered).name == "target_mm"
    alone = measured("alone", errors={"tre_mm": 1.0}, diagnostics={"target_spread_mm": 1.0})
    many = [measured(f"m{i}", diagnostics={"target_spread_mm": 9.0 - i}) for i in range(3)]
    assert [e.solver for e in best_first([*many, alone])] == ["alone", "m2", "m1", "m0"]


def test_an_overlap_is_better_when_it_is_larger():
    ordered = best_first([measured(str(iou), held_out={"mask_iou": iou}) for iou in (0.5, 0.9, 0.7)])
    assert [e.solver for e in ordered] == ["0.9", "0.7", "0.5"]


def test_without_any_metric_the_order_is_kept():
    assert [e.solver for e in best_first([measured("b"), measured("a")])] == ["b", "a"]
    assert ordering_metric([measured("a")]) is None
