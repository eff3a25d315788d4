"""The unmodified ur_rtde client drives the simulated controller."""

import socket
import struct
import time

import numpy as np
import pytest
from hecbench_hardware.controller_sim.arm import SimulatedArm
from hecbench_hardware.controller_sim.control_script import DONE
from hecbench_hardware.controller_sim.process import SimulatedController
from hecbench_hardware.controller_sim.program import ProgramRunner
from hecbench_hardware.controller_sim.server import serve
from hecbench_hardware.controller_sim.urscript.uploads import start_program
from hecbench_hardware.kinematics import ARMS

from hecbench.errors import InputError

dashboard_client = pytest.importorskip("dashboard_client", reason="ur-rtde has no wheel for this Python")
rtde_control = pytest.importorskip("rtde_control", reason="ur-rtde has no wheel for this Python")
rtde_io = pytest.importorskip("rtde_io", reason="ur-rtde has no wheel for this Python")
rtde_receive = pytest.importorskip("rtde_receive", reason="ur-rtde has no wheel for this Python")

HOME = [0.0, -1.5708, 1.5708, -1.5708, -1.5708, 0.0]
READY = [0.3, -1.4, 1.5, -1.6, -1.5, 0.2]


@pytest.fixture(scope="module")
def receive(running_controller):
    return rtde_receive.RTDEReceiveInterface(running_controller.host)


@pytest.fixture(scope="module")
def control_client(running_controller):
    client = connected(running_controller.host)
    yield client
    client.stopScript()
    client.disconnect()


def connected(host, attempts=3):
    """The client, which gives up at once when a busy machine makes it too slow for its own handshake."""
    for _ in range(attempts - 1):
        try:
            return rtde_control.RTDEControlInterface(host)
        except RuntimeError:
            time.sleep(1)
    return rtde_control.RTDEControlInterface(host)


@pytest.fixture
def control(control_client, controller):
    wait_until(lambda: not control_client.isProgramRunning())  # else it waits for the program that was ended
    control_client.reuploadScript()
    wait_until(control_client.isProgramRunning)
    return control_client


def wait_until(condition, timeout_s=20.0):
    deadline = time.monotonic() + timeout_s
    while not condition():
        assert time.monotonic() < deadline, "it did not happen in time"
        time.sleep(0.002)


def test_motions_reach_their_targets(control, receive):
    assert control.moveJ(READY)
    wait_until(lambda: np.abs(np.subtract(receive.getActualQ(), READY)).max() == 0)
    target = receive.getActualTCPPose()
    target[0], target[2] = target[0] + 0.05, target[2] + 0.1
    assert control.moveL(target)
    wait_until(lambda: np.abs(np.subtract(receive.getActualTCPPose(), target)).max() <= 1e-9)
    assert control.moveJ_IK(target)
    assert control.moveL_FK(READY)
    wait_until(lambda: np.abs(np.subtract(receive.getActualQ(), READY)).max() <= 1e-9)


def test_paths_servo_speed_and_contact(control, receive, controller):
    assert control.moveJ([[*HOME, 1.0, 1.0, 0.0], [*READY, 1.0, 1.0, 0.0]])
    wait_until(lambda: receive.getActualQ() == READY)
    pose = receive.getActualTCPPose()
    higher = [*pose[:2], pose[2] + 0.05, *pose[3:]]
    assert control.moveL([[*higher, 0.2, 0.5, 0.0], [*pose, 0.2, 0.5, 0.0]])
    wait_until(lambda: np.abs(np.subtract(receive.getActualTCPPose(), pose)).max() < 1e-5)  # text of 6 digits

    servo = [READY[0] + 0.02, *READY[1:]]
    for _ in range(20):
        control.servoJ(servo, 0.0, 0.0, 0.002, 0.1, 300)
    wait_until(lambda: abs(receive.getActualQ()[0] - servo[0]) < 1e-9)
    control.servoL(receive.getActualTCPPose(), 0.0, 0.0, 0.002, 0.1, 300)
    assert control.servoStop()
    control.speedJ([0.1, 0, 0, 0, 0, 0], 0.5, 0.0)
    wait_until(lambda: receive.getActualQ()[0] > servo[0] + 0.01)
    assert control.speedStop()
    control.speedL([0, 0, 0.02, 0, 0, 0], 0.25, 0.0)
    wait_until(lambda: receive.getActualTCPPose()[2] > pose[2] + 0.01)
    assert control.speedStop()

    controller.fault(f"contact {pose[2]}")
    assert control.moveUntilContact([0, 0, -0.02, 0, 0, 0])
    wait_until(lambda: receive.getActualTCPForce()[2] > 0)


def test_asynchronous_motion_reports_progress_and_stops(control, receive):
    before = control.getAsyncOperationProgressEx().operationId()
    assert control.moveJ([1.5, *HOME[1:]], 0.2, 0.5, True)
    wait_until(lambda: control.getAsyncOperationProgressEx().operationId() != before)
    assert control.getAsyncOperationProgressEx().isAsyncOperationRunning()
    control.stopJ(2.0)
    assert not control.getAsyncOperationProgressEx().isAsyncOperationRunning()
    wait_until(lambda: 0 < receive.getActualQ()[0] < 1.5 and np.abs(receive.getActualQd()).max() == 0)


def test_questions(control):
    control.moveJ(READY)
    pose = control.getForwardKinematics()
    assert control.getInverseKinematics(pose, READY) == pytest.approx(READY, abs=1e-6)
    wait_until(lambda: control.getInverseKinematicsHasSolution(pose))
    assert not control.getInverseKinematicsHasSolution([2.0, 0, 0, 0, 0, 0])
    assert control.setTcp([0, 0, 0.15, 0, 0, 0])
    assert control.getTCPOffset() == pytest.approx([0, 0, 0.15, 0, 0, 0])
    lifted = control.getForwardKinematics(READY, [0, 0, 0.15, 0, 0, 0])
    assert np.linalg.norm(np.subtract(lifted, pose)[:3]) == pytest.approx(0.15)
    assert control.poseTrans([0.1, 0, 0, 0, 0, 0], [0.1, 0, 0, 0, 0, 0]) == pytest.approx(
        [0.2, 0, 0, 0, 0, 0]
    )
    assert control.isPoseWithinSafetyLimits(pose)
    assert not control.isJointsWithinSafetyLimits([9.0, 0, 0, 0, 0, 0])
    assert control.isSteady()
    assert control.setPayload(0.9, [0, 0, 0.05])
    assert control.zeroFtSensor()


def test_freedrive_by_hand(control, receive, controller):
    wait_until(lambda: receive.getActualQ() == pytest.approx(HOME, abs=1e-4))
    controller.fault("hand 0.5 -1.4 1.5 -1.6 -1.5 0.2")
    time.sleep(0.05)
    assert receive.getActualQ() == pytest.approx(HOME, abs=1e-4)
    assert control.freedriveMode()
    assert control.getFreedriveStatus() == 0
    controller.fault("hand 0.5 -1.4 1.5 -1.6 -1.5 0.2")
    wait_until(lambda: abs(receive.getActualQ()[0] - 0.5) < 1e-9)
    assert control.endFreedriveMode()
    assert control.teachMode()
    assert control.endTeachMode()


def test_custom_script(control, receive):
    script = (
        "movej([0.1,-1.5,1.5,-1.5,-1.5,0.0], a=1.4, v=1.05)\nsleep(0.1)\nset_standard_digital_out(3, True)\n"
    )
    assert control.sendCustomScriptFunction("custom", script)
    wait_until(lambda: abs(receive.getActualQ()[0] - 0.1) < 1e-9)
    assert receive.getDigitalOutState(3)


def test_a_custom_script_closes_the_gripper(control, controller):
    script = "rq_activate_and_wait()\nrq_close_and_wait()\n"
    assert control.sendCustomScriptFunction("close", script)
    with socket.create_connection((controller.host, 63352), 20.0) as gripper:
        gripper.sendall(b"GET POS\n")
        assert gripper.makefile().readline() == "POS 255\n"


def test_outputs_and_slider(receive, controller):
    outputs = rtde_io.RTDEIOInterface(controller.host)
    try:
        outputs.setStandardDigitalOut(1, True)
        outputs.setToolDigitalOut(0, True)
        outputs.setSpeedSlider(0.3)
        wait_until(lambda: receive.getDigitalOutState(1) and receive.getDigitalOutState(16))
        wait_until(lambda: receive.getTargetSpeedFraction() == pytest.approx(0.3))
    finally:
        outputs.disconnect()


def test_dashboard(controller):
    dashboard = dashboard_client.DashboardClient(controller.host)
    dashboard.connect()
    assert dashboard.robotmode() == "Robotmode: RUNNING"
    assert dashboard.safetystatus() == "Safetystatus: NORMAL"
    assert dashboard.programState().startswith("STOPPED")
    assert dashboard.getRobotModel() == "UR5"
    assert dashboard.getSerialNumber().isdigit()
    assert dashboard.isInRemoteControl()
    assert not dashboard.running()
    dashboard.popup("hello")
    dashboard.closePopup()
    with pytest.raises(RuntimeError):
        dashboard.loadURP("missing.urp")
    dashboard.powerOff()
    assert dashboard.robotmode() == "Robotmode: POWER_OFF"
    dashboard.disconnect()


def test_protective_and_emergency_stop_and_back(control, receive, controller):
    dashboard = dashboard_client.DashboardClient(controller.host)
    dashboard.connect()
    assert control.triggerProtectiveStop()
    wait_until(receive.isProtectiveStopped)
    with pytest.raises(RuntimeError, match="Cannot unlock"):
        dashboard.unlockProtectiveStop()
    time.sleep(0.15)
    dashboard.unlockProtectiveStop()
    controller.fault("emergency_stop")
    wait_until(receive.isEmergencyStopped)
    assert not control.moveJ(READY)
    controller.fault("release_emergency_stop")
    dashboard.powerOn()
    dashboard.brakeRelease()
    control.reuploadScript()
    wait_until(control.isProgramRunning)
    assert control.moveJ(READY)
    dashboard.disconnect()


def test_program_dies_of_an_unreachable_pose(control):
    assert not control.moveL([2.0, 0, 0.2, 0, 3.14, 0])
    assert not control.isProgramRunning()


def test_second_control_client_is_refused(control, controller):
    with pytest.raises(RuntimeError, match="in use"):
        rtde_control.RTDEControlInterface(controller.host)


def test_old_controller_version():
    with SimulatedController(time_scale=100.0, version=(3, 15, 8, 0)) as old:
        client = rtde_control.RTDEControlInterface(old.host)
        assert client.moveJ(READY)
        client.disconnect()


def test_two_arms_at_once(control, controller):
    with SimulatedController(model="ur10e", time_scale=50.0, version=(5, 26, 0, 0)) as other:
        assert other.host != controller.host
        second = rtde_control.RTDEControlInterface(other.host)
        assert control.moveJ(READY, 1.0, 1.0, True)
        assert second.moveJ(HOME, 1.0, 1.0, True)
        for client in (control, second):
            wait_until(
                lambda client=client: not client.getAsyncOperationProgressEx().isAsyncOperationRunning()
            )
        second.disconnect()


@pytest.mark.parametrize("time_scale", [1, 20])
def test_a_motion_is_a_function_of_cycles(time_scale):
    """No wall clock enters: two runs of the same cycles give the same trajectory, bit by bit."""

    def trajectory():
        program = ProgramRunner(SimulatedArm(ARMS["ur5e"]))
        program.arm.dt_s *= time_scale
        start_program(program, "def rtde_control():\nend\n")
        program.arm.io.inputs.doubles[:8] = [*READY, 0.5, 1.0]
        program.arm.io.inputs.ints[0] = 1
        joints = []
        while program.arm.io.outputs.ints[0] != DONE:
            program.step()
            joints.append(program.arm.joints)
        return np.array(joints)

    first = trajectory()
    assert np.array_equal(first, trajectory())
    assert first[-1].tolist() == READY


def test_a_verdict_outlasts_its_question_for_a_busy_client():
    program = ProgramRunner(SimulatedArm(ARMS["ur5e"]))
    start_program(program, "def rtde_control():\nend\n")
    registers, results = program.arm.io.inputs.ints, program.arm.io.outputs.ints

    def after(command, cycles):
        registers[0] = command
        for _ in range(cycles):
            program.step()
        return results[1]

    assert after(47, 5) == 1  # is the arm steady?
    assert after(0, 40) == 1
    assert after(0, 20) == 0
    assert after(47, 5) == 1
    assert after(54, 5) == -1  # the next question has its own answer


def frame(kind, body):
    return struct.pack(">HB", 3 + len(body), ord(kind)) + body


@pytest.fixture
def raw(controller):
    with socket.create_connection((controller.host, 30004), 2.0) as client:

        def ask(kind, body):
            client.sendall(frame(kind, body))
            size, _ = struct.unpack(">HB", client.recv(3))
            return client.recv(size - 3)

        ask.send = client.sendall
        yield ask


def test_wire_protocol(raw, controller):
    assert raw("V", struct.pack(">H", 2)) == b"\x01"
    assert raw("V", struct.pack(">H", 3)) == b"\x00"
    assert struct.unpack(">4I", raw("v", b"")) == (5, 11, 6, 0)
    assert raw("S", b"") == b"\x00"
    assert raw("O", struct.pack(">d", 100) + b"timestamp,nonsense") == b"\x00DOUBLE,NOT_FOUND"
    assert raw("O", struct.pack(">d", 100) + b"timestamp,actual_q,") == b"\x01DOUBLE,VECTOR6D"
    assert raw("I", b"input_int_register_47") == b"\x01INT32"
    assert raw("P", b"") == b"\x01"
    raw.send(frame("U", b"\x01\x00"))
    raw.send(frame("U", b"\x09"))
    assert raw("V", struct.pack(">H", 2)) == b"\x01"
    log = controller.ask("log")
    assert "input recipe 1: 1 bytes, expected 4" in log
    assert "input recipe 9 does not exist" in log


def test_bad_requests_are_answered_in_one_line(controller):
    with pytest.raises(InputError, match="choose one of"):
        controller.fault("earthquake")
    for wrong in ("hand 1 2", "slow fast", "slow"):
        with pytest.raises(InputError, match="wrong numbers"):
            controller.fault(wrong)
    with pytest.raises(InputError, match="loopback"):
        serve("192.168.0.7")
    with pytest.raises(InputError, match="time scale"):
        serve("127.0.1.1", time_scale=0.0)
    with pytest.raises(InputError, match="ur5e"):
        serve("127.0.1.1", model="ur5")
    with pytest.raises(InputError, match="another 127"):
        SimulatedController(controller.host).start()
