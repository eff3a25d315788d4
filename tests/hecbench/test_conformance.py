"""Every solver passes the conformance checks, and the checks catch solvers that should not pass."""

from dataclasses import replace

import numpy as np
import pytest

from hecbench import conformance, registry, se3
from hecbench.conformance import solvers
from hecbench.errors import InputError, Refusal
from hecbench.estimate import Estimate
from hecbench.specs import Kind, SolverSpec

CHECKED = [spec for spec in registry.load().ready(Kind.SOLVER, SolverSpec) if spec.needs <= solvers.SUPPORTED]


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


NEED_A_MODEL = ("cut", "cyclegan", "cyclegan_mask", "geomaskgan")
OTHERS = (Kind.DATASET, Kind.EVALUATOR, Kind.EXPORTER, Kind.SEGMENTER, Kind.TRANSLATOR)


@pytest.mark.parametrize(
    "plugin",
    [p for kind in OTHERS for p in registry.load().select(kind) if p.status is registry.PluginStatus.READY],
    ids=lambda plugin: f"{plugin.kind}-{plugin.name}",
)
def test_plugins_of_other_kinds_conform(plugin):
    if plugin.name in NEED_A_MODEL:
        pytest.skip(
            f"{plugin.name} needs a model that the user trains: hecbench conformance '{plugin.name}[model=DIR]'"
        )
    checks = conformance.check_plugin(plugin.spec)
    assert checks
    assert [f"{check.name}: {check.detail}" for check in checks if not check.passed] == []


def test_a_markerless_solver_conforms():
    checks = conformance.check_solver(registry.load().named("render_gn"))
    assert [f"{check.name}: {check.detail}" for check in checks if not check.passed] == []


def markerless_failures(solver):
    spec = replace(registry.load().named("render_gn"), factory=lambda: solver)
    return {check.name for check in conformance.check_solver(spec) if not check.passed}


def test_the_start_is_no_markerless_answer():
    failed = markerless_failures(lambda recording, *, rng: Estimate(recording.initial_parent_T_camera))
    assert failed == {"exact pictures", "no robot in the pictures"}


def test_a_solver_that_reads_the_order_is_caught():
    def first_view(recording, *, rng):
        return Estimate(se3.make(np.eye(3), recording.joints_rad[0, :3]))

    assert "order of samples" in markerless_failures(first_view)


def others_failures(name, **changes):
    spec = replace(registry.load().named(name, changes.pop("kind", None)), **changes)
    return [check.detail for check in conformance.check_plugin(spec) if not check.passed]


def test_faulty_plugins_of_other_kinds_are_caught():
    def everywhere(recording):
        return replace(
            recording, masks=tuple(np.full((240, 320), 255, np.uint8) for _ in range(len(recording)))
        )

    def bright(image, mask, *, part, colours):
        return np.full_like(image, 2.0)

    def nan(estimate, recording, *, solve, rng):
        return {"x": float("nan")}

    assert "overlap" in others_failures("given", factory=lambda: everywhere)[0]
    assert "[0, 1]" in others_failures("identity", factory=lambda: bright)[0]
    assert "not a number" in others_failures("consistency", factory=lambda: nan)[0]
    assert "recognises" in others_failures("native", sniff=lambda path: True)[0]
    assert "wrote nothing" in others_failures("ros", write=lambda estimate, options: "")[0]


def test_kinds_without_checks_are_refused():
    with pytest.raises(Refusal, match="no checks for a gripper"):
        conformance.check_plugin(registry.load().named("none"))


def test_a_name_of_two_kinds_must_be_told_apart():
    with pytest.raises(InputError, match="--kind"):
        registry.load().named("easyhec")
    assert registry.load().named("easyhec", "dataset").kind is Kind.DATASET
