"""Whatever one client sends costs that client its connection at most."""

import contextlib
import os
import random
import socket
import struct
import subprocess
import sys
import time

import psutil
import pytest
from hecbench_hardware.controller_sim.process import SimulatedController

PORTS = (29999, 30001, 30002, 30003, 30004, 30011, 30012, 63352, 30099)

ODD = [
    (63352, b"GET\n"),
    (63352, b"SET POS abc\n"),
    (63352, b"SET POS 256\n"),
    (63352, b"SET POS \xff\xfe\n"),
    (63352, b"SET " + b"X 1 " * 5000 + b"\n"),
    (30002, b"def f():\n movej([q1, q2, q3, q4, q5, q6], a=1, v=1)\nend\n"),
    (30002, b"def f():\n write_output_integer_register(i, 1)\nend\n"),
    (30002, b"def f():\n write_output_integer_register(480, 1)\nend\n"),
    (30002, b"def f():\n write_output_integer_register(1, 5e9)\nend\n"),
    (30002, b"def f():\n write_output_float_register(1, 1e308 * 10)\nend\n"),
    (30002, b"def f():\n movej([0, 0, 0], a=1, v=1)\nend\n"),
    (30002, b"def f():\n sleep(\n"),
    (30001, b"end\nend\nend\n"),
    (30001, b"def f(:\nend\n"),
    (30001, b"def f():\n f()\nend\n"),
    (30001, b"def f():\n x = " + b"(" * 5000 + b"\nend\n"),
    (30001, b"def f():\n x = 1" + b"+1" * 20000 + b"\nend\n"),
    (30001, b'def f():\n s = "x"\n while True:\n  s = str_cat(s, s)\n end\nend\n'),
    (30001, b"def f():\n x = [1]\n while True:\n  x = [x, x]\n end\nend\n"),
    (30001, b"def f():\n x = [1]\n while True:\n  x = struct(a=x, b=x)\n end\nend\n"),
    (30001, b"def f():\n x = [1, 1]\n while True:\n  x[0] = x\n  x[1] = x\n end\nend\n"),
    (30001, b"def f():\n x = make_list(4000, 0)\n while True:\n  x = x + x\n end\nend\n"),
    (30001, b"def f():\n while True:\n  get_inverse_kin(get_actual_tcp_pose())\n end\nend\n"),
    (30001, b"def f():\n x = 2\n while True:\n  x = x * x\n end\nend\n"),
    (30001, b"def f():\n while True:\n end\nend\n"),
    (30001, b"def f():\n enter_critical\n while True:\n end\nend\n"),
    (30001, b"def f():\n while True:\n  run g()\n end\nend\ndef g():\n sleep(9)\nend\n"),
    (30003, b"speedl([1e308, 1e308, 0, 0, 0, 0], 1e308)\n"),
    (30003, b"movel(p[1e308, 0, 0, 0, 0, 0])\n"),
    (30003, b"movej([1e400, 0, 0, 0, 0, 0])\n"),
    (30003, b"\x00\xff\x80\n" * 50),
    (30004, bytes([0, 4, ord("O"), 0])),
    (30004, bytes([0, 11, ord("O"), *[0x7F, 0xF8], *[0] * 6])),
    (30004, bytes([0, 5, ord("I"), 255, 254])),
    (30004, bytes([0, 0, ord("V")])),
    (30004, bytes([0, 2, ord("V")])),
    (30004, bytes([0, 3, ord("U")])),
    (30004, bytes([0, 3, 200])),
    (29999, b"\xff\xfe\n"),
    (29999, b"load \n" * 100),
    (29999, b"\x00" * 1000),
    (30099, b"slow nan\n"),
    (30099, b"hand inf inf inf inf inf inf\n"),
    (30099, b"link_loss nan\n"),
    (30099, b"gripper_object 1e99\n"),
    (30099, b"place nan 0 0 0 0 0\n"),
]


@pytest.mark.parametrize(("port", "data"), ODD, ids=range(len(ODD)))
def test_odd_input_ends_nothing(dial, is_alive, port, data):
    """37 inputs; a dozen like them ended the process for everybody once."""
    dial(port, data)
    time.sleep(0.05)
    assert is_alive()
    assert is_alive()


def test_what_was_dropped_is_on_record(dial, controller, wait_until):
    dial(30004, bytes([0, 0, ord("V")]))
    wait_until(lambda: "port 30004: an RTDE frame of length 0; connection closed" in controller.ask("log"))
    dial(29999, b"x" * 70_000)
    wait_until(lambda: "port 29999: a line of more than 65536 bytes" in controller.ask("log"))
    dial(30001, b"def f():\n" + b"#\n" * 600_000)
    wait_until(lambda: "port 30001: a program of more than 1048576 bytes" in controller.ask("log"))


def fuzzed(dice):
    """A request that is almost one of the port's own."""
    port = dice.choice(PORTS[:-1])
    seed = dice.choice([data for number, data in ODD if number == port] or [b"get\n"])
    data = bytearray(seed[:300] or b"x")
    for _ in range(dice.randrange(8)):
        data[dice.randrange(len(data))] = dice.randrange(256)
    if port == 30004 and dice.random() < 0.7:
        body = bytes(dice.randrange(256) for _ in range(dice.randrange(40)))
        data = (
            struct.pack(">HB", dice.choice([3 + len(body), dice.randrange(80)]), dice.choice(b"VvOISPUM"))
            + body
        )
    return port, bytes(data)


def test_a_thousand_fuzzed_connections():
    """Their memory is given back, too."""
    dice = random.Random(15)
    with SimulatedController(time_scale=50.0) as own:
        process = psutil.Process(own._process.pid)

        def send(count):
            for _ in range(count):
                port, data = fuzzed(dice)
                with socket.create_connection((own.host, port), timeout=20.0) as client:
                    client.sendall(data)
                    if dice.random() < 0.3:
                        client.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
            assert own.ask("speed")

        send(500)
        before = process.memory_info().rss
        send(500)
        assert process.memory_info().rss - before < 8e6
        assert process.num_fds() < 60


def test_three_hundred_at_once(dial, is_alive):
    """Each sends half of something and waits."""
    clients = [dial(PORTS[i % len(PORTS)], b"\x00" if i % 2 else b"def f():") for i in range(300)]
    assert is_alive()
    for client in clients:
        client.close()
    assert is_alive()


def test_one_byte_at_a_time(dial, is_alive):
    client = dial(29999).makefile("rw")
    client.readline()
    for letter in "robotmode\n":
        client.write(letter)
        client.flush()
    assert client.readline() == "Robotmode: RUNNING\n"
    rtde = dial(30004)
    for byte in b"\x00\x05V\x00\x02":
        rtde.sendall(bytes([byte]))
    assert rtde.recv(10) == b"\x00\x04V\x01"


def test_a_client_that_never_reads_its_answers(dial, controller, wait_until):
    deaf = dial(29999)
    deaf.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, 4096)
    deaf.settimeout(0.5)
    with contextlib.suppress(OSError):  # nobody reads any more, or it was hung up
        for _ in range(1000):
            deaf.sendall(b"PolyscopeVersion\n" * 1000)
    wait_until(lambda: "it does not read its answers" in controller.ask("log"))


def test_no_file_descriptor_left():
    """Clients beyond the limit are refused; when others leave, new ones are served again."""
    code = (
        "import resource, sys; resource.setrlimit(resource.RLIMIT_NOFILE, (48, 48));"
        "from hecbench_hardware.controller_sim.server import serve; serve(sys.argv[1])"
    )
    host = "127.0.0.97"
    own = subprocess.Popen([sys.executable, "-c", code, host], env=os.environ)
    try:
        deadline = time.monotonic() + 60
        clients = []
        while not clients:
            assert time.monotonic() < deadline
            try:
                clients.append(socket.create_connection((host, 29999), timeout=20.0))
            except OSError:
                time.sleep(0.05)
        clients += [socket.create_connection((host, 29999), timeout=20.0) for _ in range(80)]
        refused = sum(client.recv(100) == b"" for client in clients)
        assert 30 < refused < 80
        assert own.poll() is None
        for client in clients:
            client.close()
        time.sleep(0.2)
        with socket.create_connection((host, 29999), timeout=20.0) as later:
            assert later.recv(100).startswith(b"Connected")
    finally:
        own.terminate()
        assert own.wait(20.0) == 0


def test_a_parent_that_died_at_once_gets_no_traceback():
    reading, writing = os.pipe()
    os.close(reading)
    command = [
        sys.executable,
        "-m",
        "hecbench_hardware.controller_sim",
        "127.0.0.61",
        "ur5e",
        "1",
        "5.11.0.0",
    ]
    process = subprocess.Popen(command, stdin=subprocess.PIPE, stdout=writing, stderr=subprocess.PIPE)
    os.close(writing)
    _, errors = process.communicate(timeout=60)
    assert process.returncode == 1
    assert errors == b""
