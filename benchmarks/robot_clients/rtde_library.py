"""The maker's RTDE client library: every field it lists, and its control loop against a program on the controller."""

import socket
import sys
import time

from rtde import rtde

host = sys.argv[1]
FIELDS = [
    "timestamp",
    "target_q",
    "actual_q",
    "actual_TCP_pose",
    "actual_TCP_speed",
    "joint_mode",
    "safety_status",
    "tcp_offset",
    "tcp_force_scalar",
    "joint_position_deviation_ratio",
    "output_bit_registers0_to_31",
    "output_bit_register_64",
    "output_int_register_0",
]
LOOP = """def loop():
  write_output_integer_register(0, 1)
  while read_input_integer_register(0) == 0:
    sync()
  end
  goal = p[0, 0, 0, 0, 0, 0]
  i = 0
  while i < 6:
    goal[i] = read_input_float_register(i)
    i = i + 1
  end
  movej(get_inverse_kin(goal), a=4, v=2)
  write_output_integer_register(0, 0)
end
"""

connection = rtde.RTDE(host, 30004)
connection.connect()
assert connection.get_controller_version()[0] == 5
assert connection.send_output_setup(FIELDS, frequency=125)
names = [f"input_double_register_{i}" for i in range(6)]
target = connection.send_input_setup(names, ["DOUBLE"] * 6)
trigger = connection.send_input_setup(["input_int_register_0"], ["INT32"])
assert connection.send_start()
goal = [-0.12, -0.43, 0.14, 0, 3.11, 0.04]
for name, value in zip(names, goal, strict=True):
    setattr(target, name, value)
trigger.input_int_register_0 = 0
connection.send(target)
connection.send(trigger)
with socket.create_connection((host, 30002)) as client:
    client.sendall(LOOP.encode())
    deadline = time.monotonic() + 30
    state = connection.receive()
    while state.output_int_register_0 != 1:
        state = connection.receive()
        assert time.monotonic() < deadline
    trigger.input_int_register_0 = 1
    connection.send(trigger)
    while state.output_int_register_0 != 0:
        state = connection.receive()
        assert time.monotonic() < deadline
assert max(abs(a - b) for a, b in zip(state.actual_TCP_pose[:3], goal[:3], strict=True)) < 1e-6
connection.send_pause()
connection.disconnect()
