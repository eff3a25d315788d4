"""The states on 30001-30003 and 30011-30013, and RTDE in both versions."""

import socket
import struct
import time

import numpy as np
import pytest
from hecbench_hardware.controller_sim.arm import HOME_RAD
from hecbench_hardware.controller_sim.outputs import READERS
from hecbench_hardware.controller_sim.process import SimulatedController
from hecbench_hardware.controller_sim.signals import FORMATS, INPUTS, OUTPUTS

# Length of each package of a state, by its number (maker's "Client interfaces", software 5.10).
SIZES = {0: 47, 1: 251, 2: 37, 3: 75, 4: 101, 5: 225, 6: 445, 7: 61, 8: 9, 11: 26, 12: 8, 13: 7}


def exactly(client, count):
    content = b""
    while len(content) < count:
        piece = client.recv(count - len(content))
        assert piece
        content += piece
    return content


def packet(client):
    head = exactly(client, 4)
    return head + exactly(client, struct.unpack(">i", head)[0] - 4)


def state(client):
    """The packages of the next state by number."""
    while (message := packet(client))[4] != 16:
        pass
    packages, rest = {}, message[5:]
    while rest:
        size, number = struct.unpack_from(">iB", rest)
        packages[number], rest = rest[:size], rest[size:]
    return packages


@pytest.mark.parametrize("port", [30001, 30002, 30011, 30012])
def test_the_state_has_the_documented_packages(dial, controller, port):
    client = dial(port)
    version = packet(client)
    assert version[4] == 20
    assert version[15:25] == b"\x09URControl"
    assert struct.unpack(">BBi", version[25:31]) == (5, 11, 6)
    packages = state(client)
    assert {number: len(content) for number, content in packages.items()} == SIZES
    joints = [struct.unpack_from(">dddffffB", packages[1], 5 + 41 * i) for i in range(6)]
    np.testing.assert_allclose([joint[0] for joint in joints], HOME_RAD)
    assert {joint[7] for joint in joints} == {253}
    flags = struct.unpack_from(">7?BB", packages[0], 13)
    assert flags == (True, True, True, False, False, False, False, 7, 0)


def test_states_follow_the_arm(dial, controller, wait_until):
    client = dial(
        30002, b"def f():\n set_tcp(p[0, 0, 0.1, 0, 0, 0])\n set_digital_out(1, True)\n sleep(9000)\nend\n"
    )
    wait_until(lambda: state(client)[0][18])  # a program runs
    packages = state(client)
    assert struct.unpack_from(">12d", packages[4], 5)[8] == pytest.approx(0.1)
    assert struct.unpack_from(">ii", packages[3], 5) == (0, 2)
    controller.fault("protective_stop")
    wait_until(lambda: state(client)[0][17])


def test_the_real_time_state(dial):
    client = dial(30003)
    frames = [packet(client) for _ in range(3)]
    assert {len(frame) for frame in frames} == {1220}
    numbers = np.array(struct.unpack(">152d", frames[-1][4:]))
    np.testing.assert_allclose(numbers[1:7], HOME_RAD)
    np.testing.assert_allclose(numbers[31:37], HOME_RAD)
    assert numbers[94] == 7  # robot mode
    assert numbers[101] == 1  # safety mode
    assert numbers[131] == 1  # no program
    assert frames[0] != frames[1]


@pytest.mark.parametrize(("version", "size", "mode"), [((3, 4, 5, 0), 1060, 46), ((3, 15, 8, 0), 1220, 47)])
def test_older_software_has_shorter_states(version, size, mode):
    with SimulatedController(version=version) as old:
        with socket.create_connection((old.host, 30003), timeout=20.0) as client:
            assert len(packet(client)) == size
        with socket.create_connection((old.host, 30002), timeout=20.0) as client:
            packages = state(client)
            assert len(packages[0]) == mode
            assert 11 not in packages


@pytest.mark.parametrize(("port", "hertz", "bytes_each"), [(30002, 10, 1297), (30003, 500, 1220)])
def test_rates(dial, port, hertz, bytes_each):
    """As many states in a second of the wall clock as documented, or fewer on a busy machine, never more."""
    client = dial(port)
    packet(client)
    begin, heard = time.monotonic(), 0
    while heard < 0.6 * hertz * bytes_each:
        heard += len(client.recv(65536))
    elapsed = time.monotonic() - begin
    assert heard / bytes_each <= hertz * elapsed + 3
    if port == 30002:
        assert sum(SIZES.values()) + 5 == bytes_each


def test_every_documented_name_has_a_value():
    """The guide's names of software 5.10 and later: 406 outputs (393 of them older), 175 inputs."""
    assert (len(OUTPUTS), len(INPUTS)) == (406, 175)
    assert READERS.keys() == OUTPUTS.keys()


@pytest.fixture
def ask(dial):
    """Sends one RTDE frame and returns the body of its answer."""
    client = dial(30004)

    def exchange(kind, body=b""):
        client.sendall(struct.pack(">HB", 3 + len(body), ord(kind)) + body)
        return frame(kind)

    def frame(kind):
        while True:
            size, found = struct.unpack(">HB", exactly(client, 3))
            body = exactly(client, size - 3)
            if found == ord(kind):
                return body

    exchange.next = frame
    exchange.client = client
    return exchange


def test_all_outputs_in_one_recipe(ask):
    assert ask("V", b"\x00\x02") == b"\x01"
    answer = ask("O", struct.pack(">d", 125.0) + ",".join(OUTPUTS).encode())
    assert answer[0] == 1
    assert answer[1:].decode().split(",") == list(OUTPUTS.values())
    assert ask("S") == b"\x01"
    layout = struct.Struct(">B" + "".join(FORMATS[kind] for kind in OUTPUTS.values()))
    assert len(ask.next("U")) == layout.size


def test_protocol_version_1(ask):
    """No frequency, no recipe number before the data, one line of text per message."""
    answer = ask("O", b"timestamp,actual_q,output_bit_register_64")
    assert answer == b"\x01DOUBLE,VECTOR6D,BOOL"
    assert ask("S") == b"\x01"
    body = ask.next("U")
    assert len(body) == struct.calcsize(">7d?")
    np.testing.assert_allclose(struct.unpack(">7d?", body)[1:7], HOME_RAD)
    assert ask("V", b"\x00\x01") == b"\x01"
    ask.client.sendall(b"\x00\x04U\x09")
    assert ask.next("M") == b"\x02input recipe 9 does not exist"


def test_inputs_reach_the_registers_and_come_back(ask):
    names = [
        "input_bit_registers0_to_31",
        "input_bit_register_64",
        "input_int_register_5",
        "input_double_register_6",
    ]
    assert ask("V", b"\x00\x02") == b"\x01"
    assert ask("I", ",".join(names).encode()) == b"\x01UINT32,BOOL,INT32,DOUBLE"
    assert ask("O", struct.pack(">d", 125.0) + ",".join(names).encode())[0] == 1
    assert ask("S") == b"\x01"
    values = (0x80000001, True, -7, 2.5)
    ask.client.sendall(struct.pack(">HBB", 4 + 17, ord("U"), 1) + struct.pack(">I?id", *values))
    deadline = time.monotonic() + 20
    while struct.unpack(">BI?id", ask.next("U"))[1:] != values:
        assert time.monotonic() < deadline


def test_an_unknown_frame_is_answered(ask):
    ask.client.sendall(b"\x00\x03\x01")
    assert ask.next("M") == b"\x02RTDE frame of unknown type 1"


def test_numbers_that_are_none_do_not_reach_the_arm(ask, controller):
    assert ask("I", b"speed_slider_mask,speed_slider_fraction") == b"\x01UINT32,DOUBLE"
    assert ask("O", b"target_speed_fraction")[0] == 1
    ask.client.sendall(struct.pack(">HBBId", 16, ord("U"), 1, 1, float("nan")))
    assert ask("S") == b"\x01"
    assert struct.unpack(">d", ask.next("U")) == (1.0,)
