"""A hundred faults of an arm that is taken for a real one, with ``--arm --yes`` and nobody at the terminal.

After each of them nothing may move and nothing may be made ready, also when the fault has gone by itself.

Run: ``make bench TEST_ARGS=benchmarks/bench_robot_unattended.py`` (some minutes).
"""

import threading
import time
from collections import Counter

import numpy as np
from click.testing import CliRunner
from hecbench_hardware.commands import record
from hecbench_hardware.controller_sim.process import SimulatedController
from hecbench_hardware.kinematics import ARMS

from hecbench.recording import Mounting, Recording, RobotDescription
from hecbench.storage import recording_io

FAULTS, SEED = 100, 1
KINDS = (
    ("protective_stop",),
    ("emergency_stop", "release_emergency_stop"),
    ("push 120", "push 0"),
    ("contact 0.6", "contact -9"),
    ("local_mode",),
    ("end_program",),
    ("link_loss 0.2",),
    ("stale",),
    ("slow 0.001",),
)
MADE_READY = ("motion", "unlock", "power on", "brake release", "play")
AFTERWARDS_S = 0.5


def cell(folder):
    joints = np.array([0.3, -1.4, 1.5, -1.6, -1.5, 0.2]) + 0.3 * np.eye(6)[:5]
    plan = Recording(
        name="cell",
        mounting=Mounting.EYE_IN_HAND,
        sample_ids=tuple("abcde"),
        robot=RobotDescription(model="ur5e"),
        joints_rad=joints,
        base_T_flange=ARMS["ur5e"].forward(joints),
    )
    recording_io.save(plan, folder)
    return folder


def unattended(controller, plan, out, verbs, wait_s):
    """Events of the controller after the fault, its speed at the end, and how the run ended."""
    controller.fault("reset")
    controller.fault("unmarked")

    def inject():
        while float(controller.ask("speed")) == 0:
            time.sleep(0.002)
        time.sleep(wait_s)
        for verb in verbs:
            controller.fault(verb)
            time.sleep(0.3)

    actor = threading.Thread(target=inject)
    actor.start()
    words = [plan, "--out", out, "--robot", "ur5e", "--host", controller.host, "--arm", "--yes",
             "--set", "robot.max_age_s=1", "--set", "robot.leniency=10"]  # fmt: skip
    result = CliRunner().invoke(record, [str(word) for word in words])
    actor.join()
    time.sleep(AFTERWARDS_S)
    events = controller.ask("log").split(" | ")
    first = next(i for i, event in enumerate(events) if f"injected: {verbs[0]}" in event)
    return events[first:], float(controller.ask("speed")), result.exit_code


def test_no_motion_after_a_fault_without_a_person(benchmark, tmp_path):
    rng, plan = np.random.default_rng(SEED), cell(tmp_path / "cell")
    ended, wrong = Counter(), []

    def run():
        with SimulatedController(time_scale=10.0) as controller:
            for number in range(FAULTS):
                verbs = KINDS[rng.integers(len(KINDS))]
                out = tmp_path / str(number)
                events, speed, code = unattended(controller, plan, out, verbs, rng.uniform(0, 0.05))
                after = [event for event in events if any(word in event for word in MADE_READY)]
                ended[verbs[0].split()[0], code] += 1
                if after or speed or code != 1:
                    wrong.append((number, verbs, after, speed, code))
                    print(wrong[-1], flush=True)

    benchmark.pedantic(run, rounds=1)
    print("\nfault and exit code:", dict(ended))
    assert not wrong
