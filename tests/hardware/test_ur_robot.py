"""The UR driver: what it refuses, what it reaches, and that nothing moves or lives on that should not."""

import os
import signal
import subprocess
import sys
import threading
import time

import numpy as np
import psutil
import pytest
from hecbench_hardware.arming import take_control
from hecbench_hardware.controller_sim.process import SimulatedController
from hecbench_hardware.devices import DeviceFault, Fault
from hecbench_hardware.kinematics import ARMS
from hecbench_hardware.limits import Box, Limits, Sphere
from hecbench_hardware.motions import LineMotion
from hecbench_hardware.ur.dashboard import Dashboard
from hecbench_hardware.ur.outputs import Outputs
from hecbench_hardware.ur.robot import UrRobot
from hecbench_hardware.ur.stream import Supervision

from hecbench import se3
from hecbench.errors import InputError
from hecbench.registry import load
from hecbench.specs import DeviceSpec, Kind

pytest.importorskip("rtde_receive", reason="ur-rtde has no wheel for this Python")

SLOW_RAD_S = 0.02


def far_from(pose):
    return np.add(pose, [1.0, 0, 0, 0, 0, 0])


def wait_until(condition, timeout_s=20.0):
    deadline = time.monotonic() + timeout_s
    while not condition():
        assert time.monotonic() < deadline, "it did not happen in time"
        time.sleep(0.002)


def test_reading_needs_no_control_and_moving_does(connect, ready_pose):
    robot = connect()
    state = robot.state()
    assert robot.simulated
    assert not robot.enabled
    assert state.base_T_flange == pytest.approx(robot.arm.forward(state.joints_rad))
    assert state.base_T_flange == pytest.approx(state.base_T_tcp)
    assert abs(state.host_stamp_s - time.time()) < 5
    for move in (lambda: robot.move_joints(ready_pose), lambda: robot.move_linear(state.base_T_flange)):
        with pytest.raises(InputError, match="--arm"):
            move()
    with pytest.raises(InputError, match="--arm"), robot.freedrive():
        pass
    robot.stop()


def test_motions_arrive(robot, ready_pose):
    robot.move_joints(ready_pose)
    state = robot.settle()
    assert np.abs(state.joints_rad - ready_pose).max() < 1e-9
    target = se3.make(se3.so3_exp([0.1, 0.2, 0.3]), [0, 0, 0]) @ np.eye(4)
    target[:3, :3] = target[:3, :3] @ state.base_T_flange[:3, :3]
    target[:3, 3] = state.base_T_flange[:3, 3] + [0.05, 0.02, 0.1]
    robot.move_linear(target)
    reached = robot.settle().base_T_flange
    assert se3.translation_error_m(reached, target) <= 1e-9
    assert se3.rotation_error_rad(reached, target) <= 1e-9


def test_the_tool_offset_of_the_controller_is_respected(connect, controller, ready_pose):
    robot = connect()
    robot.enable()
    controller.fault("tool 0 0 0.15 0.1 0 0")
    assert robot.recover(lambda line: True)
    assert robot.flange_T_tcp[:3, 3] == pytest.approx([0, 0, 0.15])
    robot.move_joints(ready_pose)
    target = robot.settle().base_T_flange.copy()
    target[2, 3] += 0.05
    robot.move_linear(target)
    state = robot.settle()
    assert se3.translation_error_m(state.base_T_flange, target) <= 1e-9
    assert se3.translation_error_m(state.base_T_tcp, target) == pytest.approx(0.15)
    description = robot.describe()
    assert description["kinematics_gap_mm"] < 1e-6
    assert description["flange_T_tcp"][2][3] == pytest.approx(0.15)


@pytest.mark.parametrize(
    ("target", "complaint"),
    [
        ([0.0] * 5, "six joint angles"),
        ([0, 0, 0, 0, 0, float("nan")], "not finite"),
        ([7.0, 0, 0, 0, 0, 0], "joint 1"),
        ([0.0, 0.6, 0, 0, 0, 0], "leaves the workspace"),
    ],
)
def test_bad_joint_targets_are_refused_and_nothing_moves(robot, target, complaint):
    before = robot.state().joints_rad
    with pytest.raises(InputError, match=complaint):
        robot.move_joints(target)
    assert np.array_equal(robot.state().joints_rad, before)


def test_bad_linear_targets_are_refused(robot):
    here = robot.state().base_T_flange
    with pytest.raises(InputError, match="rigid transform"):
        robot.move_linear(2 * here)
    far = here.copy()
    far[0, 3] -= 1.0
    with pytest.raises(InputError, match="out of reach"):
        robot.move_linear(far)
    with pytest.raises(InputError, match="at most the limit"):
        robot.move_linear(here, speed_m_s=3.0)


def test_a_path_through_a_forbidden_box_is_refused(connect, ready_pose):
    box = Box((-0.6, -0.6, 0.0), (-0.3, -0.4, 1.0))
    robot = connect(limits=Limits(keep_out=(box,)))
    robot.enable()
    with pytest.raises(InputError, match="keep-out box"):
        robot.move_joints([1.0, *robot.state().joints_rad[1:]])


@pytest.fixture
def swinging(connect, controller, ready_pose):
    """A controller taken for a real one, with a long tool, and a flange pose half a turn of the tool's tip away."""
    controller.fault("unmarked")
    robot = connect(limits=Limits(workspace=Box((-1.5, -1.5, -0.5), (1.5, 1.5, 2.0))))
    robot.enable()
    controller.fault("tool 0 0 0.45 0 0 0")
    assert robot.recover(lambda line: True)
    robot.move_joints(ready_pose)
    base_T_tcp = robot.settle().base_T_tcp
    before, after = (
        se3.make(se3.so3_exp([0.0, turn, 0.0]) @ base_T_tcp[:3, :3], base_T_tcp[:3, 3])
        @ se3.inverse(robot.flange_T_tcp)
        for turn in (-0.5, 0.5)
    )
    robot.move_joints(robot.arm.inverse(before, ready_pose)[0])
    robot.settle()
    return robot, after


def test_the_arc_of_a_long_tool_is_kept_out_of_a_wall(swinging):
    """A wall above the arc is fine, one between the arc and its ends is not."""
    robot, target = swinging
    line = LineMotion(robot.arm, robot.state().joints_rad, target, robot.flange_T_tcp)
    top_m = robot.arm.forward(line.joints)[:, 2, 3].max()
    ends_m = robot.arm.forward(line.joints[[0, -1]])[:, 2, 3].max()
    assert top_m > ends_m + 0.01, "the arc rises above both of its ends"
    before = robot.state().joints_rad
    for wall_m, fits in ((top_m + 0.061, True), ((top_m + ends_m) / 2 + 0.06, False)):
        robot.limits = Limits(workspace=Box((-1.5, -1.5, -0.5), (1.5, 1.5, wall_m)))
        if fits:
            robot.move_linear(target)
            robot.move_linear(robot.arm.forward(before))
            before = robot.settle().joints_rad
            continue
        with pytest.raises(InputError, match="leaves the workspace"):
            robot.move_linear(target)
    assert np.array_equal(robot.settle().joints_rad, before)


def test_the_tip_of_a_tool_is_part_of_the_limits_before_control_is_taken(swinging, connect):
    watcher = connect()
    for robot in (swinging[0], watcher):
        furthest = max(ball.centre_m[2] for ball in robot.limits.tool)
        assert furthest == pytest.approx(0.45)
        robot.carry((Sphere((0.0, 0.0, 0.6), 0.02),))
        assert robot.limits.tool[-1].centre_m[2] == pytest.approx(0.45)
        assert Sphere((0.0, 0.0, 0.6), 0.02) in robot.limits.tool


def test_a_tool_that_was_changed_since_is_refused(swinging, controller, ready_pose):
    robot, target = swinging
    before = robot.state().base_T_tcp
    controller.fault("tool 0 0 0.2 0 0 0")
    wait_until(lambda: se3.translation_error_m(robot.state().base_T_tcp, before) > 0.1)
    for move in (lambda: robot.move_linear(target), lambda: robot.move_joints(ready_pose)):
        with pytest.raises(InputError, match=r"the tool centre point is 0\.250 m from"):
            move()


@pytest.mark.parametrize(
    ("settings", "complaint"),
    [
        ({"limits": Limits(joint_speed_rad_s=1.1)}, "joint_speed_rad_s 1.1 is above"),
        ({"limits": Limits(tool_speed_m_s=0.6)}, "tool_speed_m_s 0.6 is above"),
        ({"supervision": Supervision(max_age_s=1.1)}, "max_age_s=1.1 is above"),
        ({"supervision": Supervision(max_force_n=200)}, "max_force_n=200 is above"),
        ({"supervision": Supervision(leniency=11)}, "leniency=11 is above"),
    ],
)
def test_a_real_arm_is_not_driven_faster_or_blinder_than_the_caps(connect, controller, settings, complaint):
    connect(**settings)
    controller.fault("unmarked")
    with pytest.raises(InputError, match=complaint):
        connect(**settings)


def test_supervision_that_stops_always_is_refused():
    for name in ("max_age_s", "max_force_n", "late_s", "leniency"):
        for value in (0.0, -1.0, float("nan")):
            with pytest.raises(InputError, match=f"{name}=.* above 0"):
                Supervision(**{name: value})


def test_stop_from_another_thread(robot, ready_pose):
    robot.move_joints(ready_pose)
    stopper = threading.Timer(0.1, robot.stop)
    stopper.start()
    with pytest.raises(DeviceFault) as caught:
        robot.move_joints(far_from(ready_pose), speed_rad_s=SLOW_RAD_S)
    assert caught.value.fault is Fault.STOPPED
    stopper.join()
    assert robot.settle().joints_rad[0] < 1.3
    robot.move_joints(ready_pose)


def test_one_motion_at_a_time(robot, ready_pose):
    failures = []

    def slow():
        try:
            robot.move_joints(far_from(robot.state().joints_rad), speed_rad_s=SLOW_RAD_S)
        except DeviceFault as error:
            failures.append(error.fault)

    mover = threading.Thread(target=slow)
    mover.start()
    wait_until(lambda: np.abs(robot.state().joint_speeds_rad_s).max() > 0)
    with pytest.raises(InputError, match="moving already"):
        robot.move_joints(ready_pose)
    robot.stop()
    mover.join()
    assert failures == [Fault.STOPPED]


def test_freedrive(robot, controller):
    with robot.freedrive():
        controller.fault("hand 0.2 -1.4 1.5 -1.6 -1.5 0.2")
        wait_until(lambda: abs(robot.state().joints_rad[0] - 0.2) < 1e-9)
        assert robot.settle().joints_rad[5] == pytest.approx(0.2)
    controller.fault("hand 0.5 -1.4 1.5 -1.6 -1.5 0.2")
    assert robot.settle().joints_rad[0] == pytest.approx(0.2)


def test_settle_says_when_the_arm_is_not_where_it_was_sent(robot, controller, ready_pose):
    robot.move_joints(ready_pose)
    controller.fault("place 0.31 -1.4 1.5 -1.6 -1.5 0.2")
    wait_until(lambda: robot.state().joints_rad[0] > 0.305)
    with pytest.raises(DeviceFault) as caught:
        robot.settle()
    assert caught.value.fault is Fault.OFF_TARGET


def test_speed_slider_is_set_and_set_back(connect, controller, ready_pose):
    watcher, robot = connect(), connect(speed_slider=0.4)
    robot.enable()
    wait_until(lambda: watcher.state().speed_fraction == pytest.approx(0.4))
    robot.move_joints(ready_pose)
    robot.close()
    wait_until(lambda: watcher.state().speed_fraction == pytest.approx(1.0))


@pytest.mark.parametrize(
    ("verbs", "fault"),
    [
        (["local_mode"], Fault.LOCAL_MODE),
        (["program"], Fault.BUSY),
        (["protective_stop"], Fault.PROTECTIVE_STOP),
        (["emergency_stop"], Fault.EMERGENCY_STOP),
        (["emergency_stop", "release_emergency_stop"], Fault.POWER_OFF),
    ],
)
def test_control_is_not_taken_of_an_unready_controller(connect, controller, verbs, fault):
    for verb in verbs:
        controller.fault(verb)
    with pytest.raises(DeviceFault) as caught:
        connect().enable()
    assert caught.value.fault is fault
    assert "\n" not in str(caught.value)


def test_second_client_is_refused(robot, connect):
    with pytest.raises(DeviceFault, match="another"):
        connect().enable()


def test_second_writer_of_outputs_is_refused(controller):
    with Outputs(controller.host) as outputs:
        outputs.call("setStandardDigitalOut", 1, True)
        with pytest.raises(DeviceFault, match="another client"):
            Outputs(controller.host)
    with pytest.raises(DeviceFault, match="not done"):
        outputs.call("setStandardDigitalOut", 1, True)


def test_wrong_address_and_wrong_model(controller):
    with pytest.raises(DeviceFault, match="nothing listens"):
        UrRobot("127.0.0.250", ARMS["ur5e"])
    with pytest.raises(DeviceFault, match="is the address right"):
        UrRobot("no-such-host.invalid", ARMS["ur5e"])
    with pytest.raises(InputError, match="not a ur10e"):
        UrRobot(controller.host, ARMS["ur10e"])


def spec(name):
    return load().get(Kind.ROBOT, name, DeviceSpec)


def test_a_real_robot_is_taken_control_of_only_when_armed_and_confirmed(controller, monkeypatch):
    monkeypatch.setattr(Dashboard, "is_simulated", lambda self: False)
    robot = spec("ur5e").open({"host": controller.host, "max_age_s": "1.0", "leniency": "10"})
    asked = []
    try:
        with pytest.raises(InputError, match="--arm"):
            take_control(robot, "3 motions", armed=False, confirm=lambda line: not asked.append(line))
        with pytest.raises(InputError, match="not confirmed"):
            take_control(robot, "3 motions", armed=True, confirm=lambda line: False)
        assert not asked
        assert not robot.enabled
        take_control(robot, "3 motions", armed=True, confirm=lambda line: not asked.append(line))
        assert robot.enabled
        assert "3 motions" in asked[0]
    finally:
        robot.close()


def test_a_simulated_robot_needs_no_arming(controller):
    robot = spec("ur5e").open({"host": controller.host, "max_age_s": "1.0", "leniency": "10"})
    try:
        take_control(robot, "1 motion", armed=False, confirm=lambda line: False)
        assert robot.enabled
    finally:
        robot.close()


@pytest.mark.parametrize(
    ("options", "complaint"),
    [({"speed_slider": "2"}, "speed_slider"), ({"max_age_s": "nan"}, "finite"), ({}, "host")],
)
def test_bad_options(controller, options, complaint):
    host = {"host": controller.host} if options else {}
    with pytest.raises(InputError, match=complaint):
        spec("ur5e").open({**host, **options})


def test_simulated_arm_by_name_brings_its_controller(ready_pose):
    robot = spec("sim_ur5e").open({"time_scale": "50", "max_age_s": "1.0", "leniency": "10"})
    try:
        robot.enable()
        robot.move_joints(ready_pose)
        host = robot.host
    finally:
        robot.close()
    with pytest.raises(DeviceFault):
        UrRobot(host, ARMS["ur5e"])


MOVER = """
import sys
import numpy as np
from hecbench_hardware.kinematics import ARMS
from hecbench_hardware.ur.robot import UrRobot
from hecbench_hardware.ur.stream import Supervision
robot = UrRobot(sys.argv[1], ARMS["ur5e"], supervision=Supervision(max_age_s=1.0, leniency=10))
robot.enable()
print("moving", flush=True)
robot.move_joints(robot.state().joints_rad + [1, 0, 0, 0, 0, 0], speed_rad_s=0.01)
"""


@pytest.mark.parametrize("number", [signal.SIGKILL, signal.SIGINT])
def test_a_killed_program_leaves_no_process_and_no_motion(controller, connect, number):
    watcher = connect()
    program = subprocess.Popen(
        [sys.executable, "-c", MOVER, controller.host],
        stdout=subprocess.PIPE,
        stderr=subprocess.DEVNULL,
        preexec_fn=lambda: signal.signal(
            signal.SIGINT, signal.SIG_DFL
        ),  # ignored in the background of a shell
    )
    try:
        program.stdout.readline()
        wait_until(lambda: np.abs(watcher.state().joint_speeds_rad_s).max() > 0)
        workers = psutil.Process(program.pid).children()
        assert len(workers) == 2
        os.kill(program.pid, number)
        program.wait(5)
        gone, alive = psutil.wait_procs(workers, timeout=5)
        assert len(gone) == 2
        assert not alive
        wait_until(lambda: np.abs(watcher.state().joint_speeds_rad_s).max() == 0)
    finally:
        program.kill()
        program.wait()
        program.stdout.close()


def test_an_interrupted_request_does_not_shift_the_answers(robot, monkeypatch):
    """As Ctrl-C between sending and receiving does."""
    connection = robot._control.worker.connection

    poll = type(connection).poll

    def interrupted(self, timeout_s=0):
        if self is connection:
            raise KeyboardInterrupt
        return poll(self, timeout_s)

    with monkeypatch.context() as patch:
        patch.setattr(type(connection), "poll", interrupted)
        with pytest.raises(KeyboardInterrupt):
            robot._control.worker.request("call", "getTCPOffset")
    assert robot._control.request("call", "endFreedriveMode") is True


def test_two_arms_at_once(robot, ready_pose):
    with SimulatedController(model="ur3e", time_scale=50.0) as other:
        supervision = Supervision(max_age_s=1.0, late_s=10, leniency=10)
        with UrRobot(other.host, ARMS["ur3e"], supervision=supervision) as second:
            second.enable()
            movers = [threading.Thread(target=arm.move_joints, args=(ready_pose,)) for arm in (robot, second)]
            for mover in movers:
                mover.start()
            for mover in movers:
                mover.join()
            for arm in (robot, second):
                assert np.abs(arm.settle().joints_rad - ready_pose).max() < 1e-9
