"""Recordings as people really have them (../shared/cases/marker): each fault is named, and no other one is blamed."""

import pytest

from hecbench import preparation, registry
from hecbench.diagnose import Severity, check
from hecbench.estimate import Status
from hecbench.running import solving
from hecbench.specs import Kind, SolverSpec

NAMED = {
    "lens_missing": ("lens_model", "lens model"),
    "lens_twice": ("lens_model", "rectified"),
    "oblong_squares": ("target_shape", "2.0 % shorter"),
    "transposed_corners": ("corner_order", "9x6 grid"),
    "fisheye_as_radtan": ("lens_model", "equidistant"),
    "k_for_p": ("intrinsics", "0.937"),
    "rotvec_as_rpy": ("rotation_convention", "rotation vectors were read as Euler angles"),
    "frozen_target": ("repeated_samples", "000008 to 000016"),
    "mirrored_pictures": ("mirrored_images", "mirrored"),
    "shift_after_gap": ("pairing", "by 2 from sample 000010 on"),
    "charuco_swapped": ("coverage", "8 x 6"),
    "two_tags_same_id": ("coverage", "seen twice in 12 of 12"),
}
"""The only critical finding of each, and words of it."""


@pytest.fixture
def case(shared):
    """The recording of a case."""
    folder = shared / "cases" / "marker"
    if not folder.is_dir():
        pytest.skip("the cases (../shared/cases) are not beside this checkout")
    return lambda name: preparation.load_recording(folder / name)


def critical(findings):
    return {finding.id: finding for finding in findings if finding.severity is Severity.CRITICAL}


@pytest.mark.parametrize("name", NAMED)
def test_the_cause_is_named_alone(name, case):
    wanted, words = NAMED[name]
    found = critical(check(case(name)))
    assert set(found) == {wanted}
    assert words in found[wanted].summary
    assert found[wanted].action


def test_obeyed_advice_is_taken_back(case):
    found = critical(check(case("k_for_p_after_advice")))
    assert set(found) == {"intrinsics", "target_scale"}
    assert found["target_scale"].value == pytest.approx(1 / 0.954, abs=0.003)


@pytest.mark.parametrize("name", ["camera_link", "four_standstills", "mono16", "exif_turned"])
def test_nothing_is_critical(name, case):
    assert critical(check(case(name))) == {}


def test_a_frame_that_is_not_optical_is_named(case):
    found = {finding.id: finding for finding in check(case("camera_link"))}
    assert "+x axis" in found["camera_frame"].summary


def test_standstills_count_once(case):
    coverage = next(finding for finding in check(case("four_standstills")) if finding.id == "coverage")
    assert coverage.severity is Severity.WARNING
    assert "60 samples at 4 robot poses" in coverage.summary


@pytest.mark.parametrize("name", ["rotvec_as_rpy", "frozen_target", "two_tags_same_id"])
def test_no_answer_is_ok_that_contradicts_the_data(name, case):
    solvers = registry.load().ready(Kind.SOLVER, SolverSpec)
    chosen = [
        spec
        for spec in solvers
        if spec.name in {"shah", "park", "single3d_iterative", "bundle", "bundle_fixed"}
    ]
    estimates = solving.solve(case(name), chosen, solving.Options(held_out=False))
    assert len(estimates) == len(chosen)
    assert all(estimate.status is not Status.OK and estimate.reason for estimate in estimates)


def test_five_hundred_samples_are_examined_in_seconds(case):
    from time import process_time

    recording, start = case("many_500"), process_time()
    findings = check(recording)
    assert critical(findings) == {}
    assert process_time() - start < 20  # a quadratic method takes minutes; about 1 s on a quiet machine
