"""Every solver passes the conformance checks, and the checks catch solvers that should not pass."""

from dataclasses import replace

import numpy as np
import pytest

from hecbench import conformance, registry, se3
from hecbench.conformance import solvers
from hecbench.errors import Refusal
from hecbench.estimate import Estimate
from hecbench.specs import Kind, Need, SolverSpec

CHECKED = [
    spec for spec in registry.load().ready(Kind.SOLVER, SolverSpec) if spec.needs <= solvers._SUPPORTED
]


@pytest.mark.parametrize("spec", CHECKED, ids=lambda spec: spec.name)
def test_solver_conforms(spec):
    failed = [f"{check.name}: {check.detail}" for check in conformance.check_solver(spec) if not check.passed]
    assert failed == []


def park():
    return registry.load().get(Kind.SOLVER, "park", SolverSpec)


def failures(solver):
    return {c.name for c in conformance.check_solver(replace(park(), factory=lambda: solver)) if not c.passed}


def good(recording, rng):
    return park().factory()(recording, rng=rng)


def wrong_by_a_centimetre(recording, *, rng):
    return Estimate(se3.exp([0, 0, 0, 0.01, 0, 0]) @ good(recording, rng).parent_T_camera)


def always_answers(recording, *, rng):
    return Estimate(np.eye(4))


def reads_names(recording, *, rng):
    shift = 1e-4 * len(recording.name)
    return Estimate(se3.exp([0, 0, 0, shift, 0, 0]) @ good(recording, rng).parent_T_camera)


def uses_global_generator(recording, *, rng):
    np.random.rand()  # noqa: NPY002 - the fault under test
    return good(recording, rng)


def writes_to_its_input(recording, *, rng):
    found = good(recording, rng)
    recording.base_T_flange[0, 0, 3] += 1.0
    return found


def crashes(recording, *, rng):
    return Estimate(recording.base_T_flange[7])


def depends_on_order(recording, *, rng):
    twist = se3.log(recording.base_T_flange[0]) * 1e-3
    return Estimate(se3.exp(twist) @ good(recording, rng).parent_T_camera)


@pytest.mark.parametrize(
    ("solver", "caught"),
    [
        (wrong_by_a_centimetre, "exact, eye_to_hand"),
        (always_answers, "degenerate data"),
        (reads_names, "truth, ids and paths"),
        (uses_global_generator, "no side effects"),
        (writes_to_its_input, "no side effects"),
        (depends_on_order, "order of samples"),
        (crashes, "degenerate data"),
    ],
)
def test_faulty_solvers_are_caught(solver, caught):
    assert caught in failures(solver)


def test_solvers_that_need_pictures_are_told_so():
    with pytest.raises(Refusal, match="needs images"):
        conformance.check_solver(replace(park(), needs=frozenset({Need.IMAGES})))
