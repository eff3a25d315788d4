"""Grippers over their real protocols: the Robotiq socket, Modbus TCP, a digital output."""

import socketserver
import struct
import threading
import time

import pytest
from hecbench_hardware.controller_sim.robotiq import RobotiqSocket
from hecbench_hardware.devices import DeviceFault, Fault, GripperStatus
from hecbench_hardware.grippers import robotiq
from hecbench_hardware.grippers.onrobot import UNIT, OnRobotGripper
from hecbench_hardware.grippers.robotiq import RobotiqGripper

from hecbench.errors import InputError
from hecbench.registry import load
from hecbench.specs import DeviceSpec, Kind

rtde_receive = pytest.importorskip("rtde_receive", reason="ur-rtde has no wheel for this Python")


def gripper(name, **options):
    return load().get(Kind.GRIPPER, name, DeviceSpec).open({k: str(v) for k, v in options.items()})


@pytest.fixture
def two_finger(controller):
    device = gripper("robotiq", host=controller.host, timeout_s=1)
    device.enable()
    yield device
    device.close()


def test_robotiq_opens_and_closes(two_finger):
    two_finger.open_fingers()
    assert two_finger.status() == GripperStatus(pytest.approx(robotiq.STROKE_M), moving=False, holding=False)
    two_finger.open_fingers(0.04)
    assert two_finger.status().width_m == pytest.approx(0.04, abs=2e-4)
    closed = two_finger.close_fingers()
    assert closed.width_m == 0
    assert not closed.holding


def test_robotiq_feels_an_object(two_finger, controller):
    two_finger.open_fingers()
    controller.fault("gripper_object 120")
    status = two_finger.close_fingers(100.0)
    assert status.holding
    assert 0.03 < status.width_m < 0.05
    two_finger.stop()


@pytest.mark.parametrize(
    ("verb", "complaint"), [("gripper_jam", "do not arrive"), ("gripper_silent", "no answer")]
)
def test_robotiq_faults_end_in_time(controller, verb, complaint):
    device = RobotiqGripper(controller.host, timeout_s=0.2)
    device.enable()
    controller.fault(verb)
    with pytest.raises(DeviceFault, match=complaint) as caught:
        device.close_fingers()
    assert caught.value.fault is Fault.GRIPPER
    device.close()


def test_robotiq_bad_input(two_finger, controller):
    with pytest.raises(InputError, match="width"):
        two_finger.open_fingers(0.2)
    with pytest.raises(InputError, match="force"):
        two_finger.close_fingers(1.0)
    with pytest.raises(DeviceFault, match="Robotiq URCap"):
        RobotiqGripper("127.0.0.250")
    with pytest.raises(InputError, match="host="):
        gripper("robotiq")
    with pytest.raises(InputError, match="not a number"):
        gripper("robotiq", host=controller.host, timeout_s="soon")


class PieceByPiece(socketserver.BaseRequestHandler):
    """A gripper whose answers arrive in pieces, as TCP may deliver them."""

    def handle(self):
        simulated = RobotiqSocket()
        for line in self.request.makefile("r"):
            answer = simulated.answer(line)
            simulated.step(10.0)
            for at in range(len(answer)):
                self.request.sendall(answer[at : at + 1])
                time.sleep(0.002)


def test_robotiq_answers_in_pieces(monkeypatch):
    with socketserver.ThreadingTCPServer(("127.0.0.1", 0), PieceByPiece) as server:
        thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.01})
        thread.start()
        monkeypatch.setattr(robotiq, "PORT", server.server_address[1])
        device = RobotiqGripper("127.0.0.1", timeout_s=20.0)
        device.enable()
        device.open_fingers(0.04)
        assert device.status().width_m == pytest.approx(0.04, abs=2e-4)
        device.close()
        server.shutdown()
        thread.join()


class HangsUp(socketserver.BaseRequestHandler):
    def handle(self):
        self.request.recv(100)
        self.request.sendall(b"ac")


def test_robotiq_half_an_answer_is_none(monkeypatch):
    with socketserver.ThreadingTCPServer(("127.0.0.1", 0), HangsUp) as server:
        thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.01})
        thread.start()
        monkeypatch.setattr(robotiq, "PORT", server.server_address[1])
        device = RobotiqGripper("127.0.0.1", timeout_s=20.0)
        with pytest.raises(DeviceFault, match="connection closed"):
            device.enable()
        device.close()
        server.shutdown()
        thread.join()


class ComputeBox(socketserver.StreamRequestHandler):
    """The registers of an RG2 behind Modbus TCP: enough of functions 3 and 16 to open, close and hold."""

    def handle(self):
        box = self.server
        while header := self.rfile.read(7):
            transaction, _, length, unit = struct.unpack(">HHHB", header)
            request = self.rfile.read(length - 1)
            reply = box.answer(request) if unit == UNIT else bytes([request[0] | 0x80, 11])
            self.wfile.write(struct.pack(">HHHB", transaction, 0, len(reply) + 1, unit) + reply)


@pytest.fixture
def compute_box():
    class Server(socketserver.ThreadingTCPServer):
        allow_reuse_address = True
        daemon_threads = True
        width, object_width, status, polls, jammed, writes = 500, None, 0, 0, False, 0

        def answer(self, request):
            function, address, count = struct.unpack_from(">BHH", request)
            if function == 3:
                self.polls += 1
                busy = self.jammed or self.polls < 3
                values = {267: self.width, 268: self.status | busy}
                words = [values[address + i] for i in range(count)]
                return struct.pack(f">BB{count}H", 3, 2 * count, *words)
            self.writes += 1
            if function == 16 and count == 3:
                _, width, command = struct.unpack_from(">3H", request, 6)
                assert command == 1
                held = self.object_width is not None and width < self.object_width
                self.width, self.status, self.polls = self.object_width if held else width, held << 1, 0
            return struct.pack(">BHH", 16, address, count)

    server = Server(("127.0.0.1", 0), ComputeBox)
    thread = threading.Thread(target=server.serve_forever, kwargs={"poll_interval": 0.01})
    thread.start()
    yield server
    server.shutdown()
    thread.join()
    server.server_close()


def test_onrobot(compute_box):
    port = compute_box.server_address[1]
    device = gripper("onrobot_rg2", host="127.0.0.1", port=port)
    device.enable()
    device.open_fingers()
    assert device.status().width_m == pytest.approx(0.11)
    compute_box.object_width = 300
    assert device.close_fingers(20.0) == GripperStatus(pytest.approx(0.03), moving=False, holding=True)
    with pytest.raises(InputError, match="width"):
        device.open_fingers(1.0)
    with pytest.raises(InputError, match="force"):
        device.close_fingers(100.0)
    compute_box.status = 0b100
    with pytest.raises(DeviceFault, match="safety switch"):
        device.status()
    device.close()


def test_onrobot_faults(compute_box):
    port = compute_box.server_address[1]
    device = OnRobotGripper("127.0.0.1", port, timeout_s=0.2)
    device.enable()
    compute_box.jammed = True
    with pytest.raises(DeviceFault, match="do not arrive"):
        device.open_fingers()
    compute_box.answer = lambda request: bytes([request[0] | 0x80, 2])
    with pytest.raises(DeviceFault, match="Modbus exception 2"):
        device.status()
    compute_box.answer = lambda request: bytes([3, 2, 0, 1])
    with pytest.raises(DeviceFault, match="4 bytes instead of 2 registers"):
        device.status()
    compute_box.answer = lambda request: time.sleep(0.5) or b"\x03"
    with pytest.raises(DeviceFault, match="no answer"):
        device.status()
    device.close()
    with pytest.raises(DeviceFault, match="Compute Box"):
        OnRobotGripper("127.0.0.250")


def shown(receive, output, on, timeout_s=10.0):
    """Whether the controller shows an output on or off within a time that is long for a busy machine."""
    deadline = time.monotonic() + timeout_s
    while receive.getDigitalOutState(output) is not on and time.monotonic() < deadline:
        time.sleep(0.01)
    return receive.getDigitalOutState(output) is on


def test_nothing_is_sent_to_fingers_before_they_are_enabled(controller, compute_box, registers):
    untouched, width = registers(), compute_box.width
    receive = rtde_receive.RTDEReceiveInterface(controller.host)
    outputs = receive.getActualDigitalOutputBits()
    devices = [
        gripper("robotiq", host=controller.host),
        gripper("onrobot_rg2", host="127.0.0.1", port=compute_box.server_address[1]),
        gripper("digital_output", host=controller.host, bank="tool", number=1, inverted="yes"),
    ]
    for device in devices:
        for command in (device.open_fingers, device.close_fingers):
            with pytest.raises(InputError, match="read-only"):
                command()
        device.stop()
        device.close()
    receive.disconnect()
    assert registers() == untouched
    assert compute_box.writes == 0
    assert compute_box.width == width
    assert receive.getActualDigitalOutputBits() == outputs


def test_digital_output(wait_until, controller):
    receive = rtde_receive.RTDEReceiveInterface(controller.host)
    device = gripper("digital_output", host=controller.host, bank="tool", number=1, stroke_s=0.1)
    device.enable()
    assert not device.close_fingers().moving
    assert shown(receive, 17, True)
    device.open_fingers()
    assert shown(receive, 17, False)
    with pytest.raises(InputError, match="one output"):
        device.open_fingers(0.02)
    with pytest.raises(InputError, match="one output"):
        device.close_fingers(5.0)
    device.stop()
    device.close()
    with pytest.raises(InputError, match="Tool 0-1"):
        gripper("digital_output", host=controller.host, bank="tool", number=5)


def test_none():
    device = gripper("none")
    device.enable()
    device.open_fingers()
    assert not device.close_fingers().holding
    device.stop()
    device.close()
