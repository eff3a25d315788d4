"""The verdict on made-up answers: laws that hold whatever the numbers are."""

from dataclasses import replace

import numpy as np
import pytest

from hecbench import conformance, se3, verdict
from hecbench.errors import InputError
from hecbench.estimate import Estimate, Status
from hecbench.recording import Mounting
from hecbench.verdict import Grade
from hecbench.verdict.answers import CORNERS, SILHOUETTE, TARGET_POSES
from hecbench.workspace import apart_m, points_in_parent

EVIDENCE = {"bundle": CORNERS, "bundle_intrinsics": CORNERS, "tsai": TARGET_POSES, "render": SILHOUETTE}
SIGMA = np.diag([1e-4, 1e-4, 1e-4, 2e-4, 2e-4, 2e-4]) ** 2


@pytest.fixture
def rig():
    return conformance.rig(np.random.default_rng(3), Mounting.EYE_TO_HAND)


def answer(rig, solver, shift_mm=0.0, covariance=SIGMA, **changes):
    X = rig.truth_parent_T_camera.copy()
    X[0, 3] += shift_mm / 1e3
    return Estimate(X, solver=solver, covariance=covariance, camera=rig.camera, **changes)


def judge(rig, *estimates, findings=(), **options):
    return verdict.judge(rig.without_truth(), estimates, EVIDENCE, list(findings), **options)


def finding(name, severity):
    return {"id": name, "severity": severity, "summary": f"{name} was found", "action": f"mend {name}"}


def residuals(values):
    return {f"s{i}": float(value) for i, value in enumerate(values)}


def held_out(px, mm=None):
    found = {"reprojection_px_by_sample": residuals(px), "reprojection_px": float(np.mean(px))}
    mm = px if mm is None else mm
    return found | {"target_mm_by_sample": residuals(mm), "target_mm": float(np.mean(mm))}


def test_the_answer_with_the_least_expected_error_is_recommended(rig):
    found = judge(
        rig, answer(rig, "tsai", 2.0, None), answer(rig, "bundle"), answer(rig, "render", 0.5, 9 * SIGMA)
    )
    assert found.recommended.solver == "bundle"
    assert found.grade is Grade.GOOD
    assert [a.solver for a in found.agreement] == ["render", "tsai"]
    assert found.agreement[0].distance_mm == pytest.approx(0.5)
    assert "looks at the robot itself" in " ".join(found.reasons)


def test_the_expected_error_is_that_of_the_covariance(rig, rng):
    found = judge(rig, answer(rig, "bundle"))
    points_m = points_in_parent(rig.base_T_flange, False)
    drawn = se3.exp(rng.multivariate_normal(np.zeros(6), SIGMA, 4000))
    errors_mm = 1e3 * apart_m(drawn, np.eye(4), points_m)
    assert found.expected.value == pytest.approx(np.sqrt((errors_mm**2).mean()), rel=0.05)
    covered = np.mean((errors_mm >= found.expected.low) & (errors_mm <= found.expected.high))
    assert 0.93 <= covered <= 1.0


def test_the_error_at_a_place_grows_with_its_distance(rig):
    errors = [judge(rig, answer(rig, "bundle"), at_m=np.array([x, 0, 0])).at.value for x in (0.0, 1.0, 3.0)]
    assert errors == sorted(errors)
    sigma_mm = 1e3 * np.sqrt(np.trace(SIGMA[3:, 3:]))
    assert errors[0] == pytest.approx(sigma_mm)
    assert judge(rig, answer(rig, "bundle")).at is None


def test_truth_does_not_enter(rig):
    estimates = [answer(rig, "tsai", 2.0, None), answer(rig, "bundle")]
    wrong = [replace(e, errors={"tre_mm": float(i)}) for i, e in enumerate(estimates)]
    first, second = (judge(rig, *each).to_json() for each in (estimates, wrong))
    first.pop("estimates")
    kept = [estimate["errors"] for estimate in second.pop("estimates")]
    assert first == second
    assert {"tre_mm": 1.0} in kept


def test_a_robot_that_is_seen_elsewhere_makes_the_answer_doubtful(rig):
    found = judge(rig, answer(rig, "bundle"), answer(rig, "tsai", 1.0, None), answer(rig, "render", 60.0))
    assert found.grade is Grade.DOUBTFUL
    assert [r.solver for r in found.rivals] == ["render"]
    assert "the robot itself" in found.rivals[0].reason


def test_a_critical_finding_forbids_the_answer_and_a_fault_makes_it_doubtful(rig):
    bundle = answer(rig, "bundle")
    assert judge(rig, bundle, findings=[finding("units", "critical")]).grade is Grade.DO_NOT_USE
    doubtful = judge(rig, bundle, findings=[finding("pairing", "warning")])
    assert doubtful.grade is Grade.DOUBTFUL
    assert doubtful.next[0] == "pairing: mend pairing"
    assert judge(rig, bundle, findings=[finding("coverage", "warning")]).grade is Grade.USABLE


def test_the_grade_is_relative_to_the_tolerance(rig):
    order = [Grade.GOOD, Grade.USABLE, Grade.DOUBTFUL, Grade.DO_NOT_USE]
    grades = [judge(rig, answer(rig, "bundle"), tolerance_mm=t).grade for t in (5.0, 0.6, 0.25, 0.01)]
    assert [order.index(grade) for grade in grades] == sorted(order.index(grade) for grade in grades)
    assert {grades[0], grades[-1]} == {Grade.GOOD, Grade.DO_NOT_USE}


def test_the_robot_alone_is_never_good(rig):
    """Nothing that `check` knows looks at it, and nothing independent confirms it."""
    assert judge(rig, answer(rig, "render")).grade is Grade.USABLE


def freed(rig, gain, sigma_ratio, shift_mm=20.0):
    """A bundle, and one with a focal length 2 % longer whose left-out residuals are smaller by a factor."""
    noise = 1 + 0.2 * np.random.default_rng(0).random(20)
    K = rig.camera.K.copy()
    K[0, 0] *= 1.02
    K[1, 1] *= 1.02
    camera = replace(rig.camera, K=K)
    extras = {"intrinsics_sigma": [sigma_ratio] * 4, "intrinsics_prior_sigma": [1.0] * 4}
    fixed = answer(rig, "bundle", held_out=held_out(noise))
    free = answer(rig, "bundle_intrinsics", shift_mm, held_out=held_out(gain * noise), extras=extras)
    return fixed, replace(free, camera=camera)


def test_a_changed_camera_must_be_earned(rig):
    fixed, free = freed(rig, gain=0.5, sigma_ratio=0.1)
    earned = judge(rig, fixed, free)
    assert earned.recommended.solver == "bundle_intrinsics"
    assert earned.grade is Grade.DOUBTFUL
    assert judge(rig, fixed, freed(rig, 0.9, sigma_ratio=0.1)[1]).recommended.solver == "bundle"
    assert judge(rig, fixed, freed(rig, 0.5, sigma_ratio=0.9)[1]).recommended.solver == "bundle"
    found = judge(rig, fixed, freed(rig, 1.0, sigma_ratio=0.1)[1])
    assert found.recommended.solver == "bundle"
    assert "moves the principal point by" in found.rivals[0].reason
    assert found.to_json()["camera"]["K"][0][0] == rig.camera.K[0, 0]


def test_a_lens_that_seems_wrong_but_is_not_determined_is_named(rig):
    fixed, free = freed(rig, gain=0.5, sigma_ratio=0.9)
    found = judge(rig, fixed, free)
    assert found.recommended.solver == "bundle"
    assert any("calibrate the lens again" in sentence for sentence in found.next)


def test_answers_on_folds_stand_in_for_a_covariance(rig):
    shifted = [answer(rig, "tsai", shift).parent_T_camera.tolist() for shift in (-1, 1, -1, 1, 0)]
    found = judge(rig, answer(rig, "tsai", 0.0, None, held_out={"fold_answers": shifted}))
    assert found.expected.value == pytest.approx(np.sqrt(4 / 5 * 4))
    assert judge(rig, answer(rig, "tsai", 0.0, None)).grade is Grade.DOUBTFUL


def test_without_an_answer_there_is_still_a_verdict(rig, tmp_path):
    missing = Estimate(solver="tsai", status=Status.REFUSED, reason="the hand hardly rotates")
    found = judge(rig, missing, findings=[finding("rotation_diversity", "critical")])
    assert found.grade is Grade.DO_NOT_USE
    assert found.to_json()["parent_T_camera"] is None
    assert found.reasons == ["tsai: the hand hardly rotates"]


def test_the_recommended_answer_comes_first_in_a_list(rig):
    """Also before one with its own camera that predicts better, so that a script that takes the first is safe."""
    fixed, free = freed(rig, gain=0.9, sigma_ratio=0.1)
    found = judge(rig, free, fixed)
    assert [e.solver for e in found.estimates] == ["bundle_intrinsics", "bundle"]
    assert [e.solver for e in found.recommended_first(found.estimates)] == ["bundle", "bundle_intrinsics"]


def test_file_round_trip(rig, tmp_path):
    written = judge(rig, answer(rig, "bundle"), answer(rig, "render", 60.0), at_m=np.ones(3))
    written.save(tmp_path / "verdict.json")
    assert verdict.load(tmp_path / "verdict.json").to_json() == written.to_json()
    (tmp_path / "verdict.json").write_text('{"schema": "hecbench.verdict/1"}')
    with pytest.raises(InputError, match=r"verdict\.json"):
        verdict.load(tmp_path / "verdict.json")
