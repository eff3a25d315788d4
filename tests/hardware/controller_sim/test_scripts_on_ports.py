"""Programs that arrive on the script ports: executed, or reported in the log and on the primary interface."""

import socket
import struct
import time

import numpy as np
import pytest
from hecbench_hardware.controller_sim.dynamics import Dynamics
from hecbench_hardware.kinematics import ARMS

rtde_control = pytest.importorskip("rtde_control", reason="ur-rtde has no wheel for this Python")
rtde_io = pytest.importorskip("rtde_io", reason="ur-rtde has no wheel for this Python")
rtde_receive = pytest.importorskip("rtde_receive", reason="ur-rtde has no wheel for this Python")

Q = "[0, -1.57, 1.57, -1.57, -1.57, 0.4]"
PROGRAMS = [
    f"movej({Q}, a=1.4, v=1.05)\n",
    f"\n    movej({Q}, a=1.4, v=1.05)\n    ",
    f"def f():\n movej({Q})\nend\n",
    f"def f():\n movej({Q}, 1.4, 1.05)\nend\n",
    f"def f():\n q = {Q}\n movej(q, a=1.4, v=1.05)\nend\n",
    f"def f():\r\n movej({Q})\r\nend\r\n",
    f"def f():\n if True:\n movej({Q})\n end\nend\n",
    f"def rtde_control_loop():\n movej({Q})\nend\n",
    f"def f():\ndef g():\nmovej({Q})\nend\ng()\nend\n",
]


@pytest.fixture
def receive(controller):
    client = rtde_receive.RTDEReceiveInterface(controller.host)
    yield client
    client.disconnect()


@pytest.mark.parametrize("port", [30001, 30002, 30003])
@pytest.mark.parametrize("program", PROGRAMS, ids=range(len(PROGRAMS)))
def test_a_program_moves_the_arm(dial, receive, wait_until, port, program):
    dial(port, program.encode())
    wait_until(lambda: abs(receive.getActualQ()[5] - 0.4) < 1e-9)


def test_one_connection_takes_one_program_after_another(dial, receive, wait_until):
    client = dial(30002, f"movej({Q})\n".encode())
    wait_until(lambda: abs(receive.getActualQ()[5] - 0.4) < 1e-9)
    client.sendall(b"def f():\n set_digital_out(3, True)\nend\n")
    wait_until(lambda: receive.getDigitalOutState(3))
    client.sendall(b"set_digital_out(3, False)\n")
    wait_until(lambda: not receive.getDigitalOutState(3))


@pytest.mark.parametrize("port", [30001, 30002, 30003])
def test_a_client_that_sends_and_hangs_up(dial, receive, wait_until, port):
    for number in range(5):
        dial(port, f"set_standard_digital_out({number}, True)\n".encode()).close()
        wait_until(lambda number=number: receive.getDigitalOutState(number))


def test_a_program_in_pieces(dial, receive, wait_until):
    client = dial(30001)
    for piece in ("def f", "():\n movej(", Q, ")", "\nen", "d\n"):
        client.sendall(piece.encode())
        time.sleep(0.02)
    wait_until(lambda: abs(receive.getActualQ()[5] - 0.4) < 1e-9)


def messages(client):
    """Kind and body of every robot message that arrives."""
    buffer = b""
    while True:
        buffer += client.recv(65536)
        while len(buffer) >= 4 and len(buffer) >= (size := struct.unpack_from(">i", buffer)[0]):
            packet, buffer = buffer[:size], buffer[size:]
            if packet[4] == 20:
                yield packet[14], packet[15:]


def first(heard, wanted):
    """The body of the next message of a kind."""
    return next(body for kind, body in heard if kind == wanted)


def test_what_cannot_be_executed_is_said_everywhere(dial, controller, wait_until):
    heard = messages(dial(30001))
    first(heard, 3)
    dial(30002, b"def f():\n set_digital_out(0, True)\n conveyor_pulse_decode(1, 0, 1)\nend\n")
    line, column = struct.unpack(">ii", (body := first(heard, 10))[:8])
    assert (line, column) == (3, 0)
    assert body[8:].decode().startswith("'conveyor_pulse_decode' is not defined")
    log = controller.ask("log")
    assert "program error: line 3: 'conveyor_pulse_decode'" in log
    dashboard = dial(29999, b"programState\n").makefile()
    dashboard.readline()
    assert dashboard.readline().startswith("STOPPED")


def test_texts_and_windows_reach_the_primary_client_only(dial):
    heard, secondary = messages(dial(30001)), dial(30002)
    first(heard, 3)
    dial(30002, b'def f():\n textmsg("hello ", 3)\n popup("careful", title="Note", warning=True)\nend\n')
    assert first(heard, 0) == b"hello 3"
    window = first(heard, 2)
    assert struct.unpack(">IB???B", window[:9]) == (0, 1, True, False, False, 4)
    assert window[9:] == b"Notecareful"
    states = b""
    while len(states) < 20_000:
        states += secondary.recv(65536)
    assert b"URControl" in states
    assert b"hello" not in states
    assert b"careful" not in states


def test_a_read_only_port_executes_nothing(dial, controller, wait_until):
    dial(30011, f"movej({Q})\n".encode())
    wait_until(lambda: "port 30011 is read-only" in controller.ask("log"))
    assert "motion" not in controller.ask("log")


def test_local_control_takes_no_programs(dial, controller, wait_until):
    controller.fault("local_mode")
    dial(30002, f"movej({Q})\n".encode())
    wait_until(lambda: "the arm is in local control" in controller.ask("log"))


def test_a_client_that_leaves_in_the_middle_is_on_record(dial, controller, wait_until):
    dial(30002, b"def half():\n movej(").close()
    wait_until(lambda: "the client left in the middle of 'def half():'" in controller.ask("log"))


def test_values_answer_their_own_question(controller, receive, wait_until):
    """The client reads these before the controller has answered: it finds NaN, not the answer before."""
    outputs = rtde_io.RTDEIOInterface(controller.host)
    control = rtde_control.RTDEControlInterface(controller.host)
    try:
        control.moveJ([-1.54, -1.83, -2.28, -0.59, 1.60, 0.023])
        outputs.setAnalogOutputVoltage(0, 0.25)
        wait_until(lambda: receive.getStandardAnalogOutput0() == 0.25)
        control.getForwardKinematics()
        joints = receive.getActualQ()
        weight = Dynamics(ARMS["ur5e"]).gravity(joints, [0.0, 0.0, 9.82])
        for ask, right in (
            (control.getJointTorques, weight),
            (lambda: control.getActualJointPositionsHistory(0), joints),
            (control.getTargetJointAccelerations, [0.0] * 6),
            (control.getCoriolisAndCentrifugalTorques, [0.0] * 6),
        ):
            right = pytest.approx(right, abs=1e-9)
            first = ask()
            assert np.isnan(first).all() or first == right, first
            wait_until(lambda ask=ask, right=right: ask() == right)
            time.sleep(0.3)
    finally:
        control.stopScript()
        control.disconnect()
        outputs.disconnect()


def test_a_tool_speed_is_reported_while_it_lasts(controller, receive, wait_until):
    control = rtde_control.RTDEControlInterface(controller.host)
    try:
        control.moveJ([-1.54, -1.83, -2.28, -0.59, 1.60, 0.023])
        control.speedL([0, 0, 0.01, 0, 0, 0], 0.25, 1.0)
        wait_until(lambda: receive.getActualTCPSpeed()[2] == pytest.approx(0.01, abs=2e-4))
        control.speedStop()
        wait_until(lambda: receive.getActualTCPSpeed() == [0.0] * 6)
    finally:
        control.stopScript()
        control.disconnect()


def test_sockets_of_a_program_reach_this_computer(dial, controller, wait_until):
    with socket.create_server(("127.0.0.1", 0)) as server:
        server.settimeout(20.0)
        program = f"""def talk():
 ok = socket_open("127.0.0.1", {server.getsockname()[1]}, "pc")
 socket_send_line("hello", "pc")
 numbers = socket_read_binary_integer(2, "pc", 20)
 answer = socket_read_ascii_float(2, "pc", 20)
 textmsg(ok, numbers)
 textmsg(answer)
 socket_send_int(7, "pc")
end
"""
        dial(30002, program.encode())
        peer, _ = server.accept()
        with peer:
            peer.settimeout(20.0)
            assert peer.makefile("rb").readline() == b"hello\n"
            peer.sendall(struct.pack(">ii", 5, -6))
            for piece in (b"(1.5,", b" 2.5)"):
                time.sleep(0.05)
                peer.sendall(piece)
            assert peer.recv(4) == b"\x00\x00\x00\x07"
    wait_until(lambda: "textmsg: True[2, 5, -6]" in controller.ask("log"))
    assert "textmsg: [2, 1.5, 2.5]" in controller.ask("log")
