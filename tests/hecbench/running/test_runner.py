"""Running solvers: every way to end becomes a result, runs resume, and parallel equals serial."""

from dataclasses import replace

import numpy as np
import pytest

from hecbench import conformance, preparation, registry, se3
from hecbench.errors import InputError, Refusal, SolverFailure
from hecbench.estimate import Estimate, Status
from hecbench.recording import Mounting
from hecbench.running import runner, solving
from hecbench.running.runner import Options, Task
from hecbench.specs import Kind, Need, SolverSpec
from hecbench.storage import recording_io, store


def spec(solver, needs=()):
    return SolverSpec(
        name="made_up", summary="s", factory=lambda: solver, needs=frozenset(needs), reference="none"
    )


def test_every_way_to_end_is_a_result(exact_rig):
    def raises(error):
        def solver(recording, *, rng):
            raise error

        return solver

    ends = {
        Status.REFUSED: (Refusal("one axis"), "one axis"),
        Status.FAILED: (SolverFailure("diverged"), "diverged"),
    }
    for status, (error, reason) in ends.items():
        (estimate,) = solving.solve(exact_rig, [spec(raises(error))])
        assert (estimate.status, estimate.reason) == (status, reason)
    (estimate,) = solving.solve(exact_rig, [spec(raises(ZeroDivisionError("x")))])
    assert estimate.status is Status.FAILED
    assert "ZeroDivisionError: x (test_runner.py:" in estimate.reason
    with pytest.raises(InputError, match="damaged"):
        solving.solve(exact_rig, [spec(raises(InputError("damaged")))])
    (estimate,) = solving.solve(
        exact_rig, [spec(raises(InputError("damaged")))], Options(stop_on_bad_input=False)
    )
    assert estimate.status is Status.FAILED


def test_unmet_needs_are_refused_with_the_key_to_give(exact_rig):
    (estimate,) = solving.solve(exact_rig, [spec(None, {Need.MASKS, Need.JOINTS})])
    assert estimate.status is Status.REFUSED
    assert estimate.reason == "the recording lacks masks (samples[].mask); joints (samples[].joints_rad)"


def test_solvers_see_neither_truth_nor_global_seed_and_are_labelled(exact_rig):
    seen = []

    def solver(recording, *, rng):
        seen.append((recording.truth_parent_T_camera, rng.integers(1000)))
        return Estimate(exact_rig.truth_parent_T_camera)

    first, second = (solving.solve(exact_rig, [spec(solver)], Options(seed=4))[0] for _ in range(2))
    assert seen[0] == seen[1]
    assert seen[0][0] is None
    assert first.errors["tre_mm"] < 1e-9
    assert first.held_out is None
    assert (first.recording, first.mounting, first.parent_link) == (
        "rig",
        exact_rig.mounting,
        exact_rig.parent_link,
    )
    assert first.provenance["recording_sha256"] == exact_rig.sha256
    assert replace(first, seconds=0).to_json() == replace(second, seconds=0).to_json()


def test_start_and_truth_are_kept_of_every_run(exact_rig):
    """Also of one without an answer, so that a report can tell what starts failed."""
    start = exact_rig.truth_parent_T_camera @ se3.from_rotvec([0.1, 0, 0], [0.2, 0, 0])
    begun = replace(exact_rig, initial_parent_T_camera=start)
    (estimate,) = solving.solve(begun, [spec(None, {Need.MASKS})])
    assert estimate.status is Status.REFUSED
    np.testing.assert_allclose(estimate.provenance["initial_parent_T_camera"], start)
    np.testing.assert_allclose(estimate.provenance["truth_parent_T_camera"], exact_rig.truth_parent_T_camera)
    (without,) = solving.solve(begun.without_truth(), [spec(None, {Need.MASKS})])
    assert "truth_parent_T_camera" not in without.provenance


def test_facts_of_an_item_come_with_its_results():
    from hecbench_datasets.suites import synthetic

    task = Task(("park",), suite="synthetic", level="mismatch_3", index=2)
    (estimate,), _ = runner.execute(task, Options(seed=1))
    floor_mm = synthetic.correspondence_floor_mm("mismatch_3", 2, 1)
    assert estimate.provenance["facts"] == {"correspondence_floor_mm": floor_mm}
    (estimate,), _ = runner.execute(replace(task, level="LP"), Options(seed=1))
    assert "facts" not in estimate.provenance


def test_an_unseen_target_is_a_reason_not_an_error(exact_rig):
    """Solvers that need the target refuse with what detection said."""
    blank = np.full((960, 1280, 3), 128, np.uint8)
    images = (blank,) * len(exact_rig)
    unseen = replace(exact_rig, camera_T_target=None, corners_px=None, images=images)
    (estimate,) = solving.solve(unseen, [spec(None, {Need.TARGET_POSES})])
    assert estimate.status is Status.REFUSED
    assert "no image shows the chessboard" in estimate.reason


def test_held_out_is_measured_where_there_is_no_truth(exact_rig):
    park = registry.load().get(Kind.SOLVER, "park", SolverSpec)
    (estimate,) = solving.solve(exact_rig.without_truth(), [park])
    assert estimate.errors is None
    assert estimate.held_out["reprojection_px"] < 1e-6
    assert estimate.held_out["samples"] == len(exact_rig)
    (without,) = solving.solve(exact_rig.without_truth(), [park], Options(held_out=False))
    assert without.held_out is None


def test_joints_give_robot_poses(shared):
    recording = recording_io.load(shared / "data" / "ur3e_cam1")
    computed = preparation.with_robot_poses(replace(recording, base_T_flange=None))
    np.testing.assert_allclose(computed.base_T_flange, recording.base_T_flange, atol=1e-6)


def tasks(count, solvers=("park", "shah")):
    return [Task(solvers, suite="markers", level="board_2m", index=i) for i in range(count)]


def comparable(contents):
    found = [replace(estimate, seconds=0.0).to_json() for estimate in contents.estimates]
    return sorted(found, key=lambda e: (e["item"], e["solver"]))


def test_parallel_equals_serial(tmp_path):
    serial = runner.run(tasks(4), Options(), out=tmp_path / "serial")
    parallel = runner.run(tasks(4), Options(), out=tmp_path / "parallel", jobs=2)
    assert len(serial.estimates) == 8
    assert comparable(serial) == comparable(parallel)


def test_an_interrupted_run_is_finished_by_resume(tmp_path):
    whole = runner.run(tasks(4), Options(), out=tmp_path / "whole")

    def interrupt(estimates):
        if estimates[0].item == "000001":
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        runner.run(tasks(4), Options(), out=tmp_path / "cut", on_result=interrupt)
    assert len(store.read(tmp_path / "cut").estimates) == 4
    path = tmp_path / "cut" / store.FILE_NAME
    path.write_bytes(path.read_bytes()[:-50])
    ran = []
    resumed = runner.run(tasks(4), Options(), out=tmp_path / "cut", resume=True, on_result=ran.extend)
    assert len(ran) == 5
    assert comparable(resumed) == comparable(whole)


def test_resume_runs_another_seed_again(tmp_path):
    for seed, expected in ((0, 4), (0, 0), (1, 4), (0, 0)):
        ran = []
        runner.run(tasks(2), Options(seed=seed), out=tmp_path / "o", resume=True, on_result=ran.extend)
        assert len(ran) == expected


def test_resume_runs_a_changed_recording_again(tmp_path):
    folder = tmp_path / "cell"
    for seed, expected in ((0, 1), (0, 0), (1, 1)):
        recording_io.save(conformance.rig(np.random.default_rng(seed), Mounting.EYE_TO_HAND), folder)
        ran = []
        runner.run(
            [Task(("park",), path=folder)], Options(), out=tmp_path / "o", resume=True, on_result=ran.extend
        )
        assert len(ran) == expected


def test_recordings_are_recognised_or_refused(tmp_path, exact_rig):
    recording_io.save(exact_rig, tmp_path / "native")
    assert preparation.load_recording(tmp_path / "native").name == "rig"
    with pytest.raises(InputError, match="does not exist"):
        preparation.load_recording(tmp_path / "nowhere")
    (tmp_path / "empty").mkdir()
    with pytest.raises(InputError, match="holds neither tables nor pictures"):
        preparation.load_recording(tmp_path / "empty")


def test_a_cluster_gives_the_same_results(tmp_path):
    """The scheduler and its worker live in this process's children on the loopback address."""
    from distributed import LocalCluster

    here = runner.run(tasks(3), Options(), out=tmp_path / "here")
    cluster = LocalCluster(
        n_workers=1, threads_per_worker=1, host="127.0.0.1", dashboard_address=None, silence_logs=50
    )
    try:
        there = runner.run(tasks(3), Options(), out=tmp_path / "there", executor=cluster.scheduler_address)
    finally:
        cluster.close()
    assert comparable(here) == comparable(there)


@pytest.mark.parametrize("executor", ["tcp://127.0.0.1:1", "nonsense://x", "127.0.0.1"])
def test_a_scheduler_that_does_not_answer_is_named(tmp_path, executor):
    with pytest.raises(InputError, match="--executor"):
        runner.run(tasks(1), Options(), out=tmp_path, executor=executor)


def test_solvers_of_other_names_and_seeds_draw_other_numbers(exact_rig):
    def draws(recording, *, rng):
        return Estimate(np.eye(4), diagnostics={"draw": rng.random()})

    named = [replace(spec(draws), name=name) for name in ("one", "two")]
    found = [
        estimate.diagnostics["draw"]
        for seed in (0, 1)
        for estimate in solving.solve(exact_rig, named, Options(seed=seed, held_out=False))
    ]
    assert len(set(found)) == 4
