"""ur_rtde with FLAG_USE_EXT_UR_CAP: the controller fetches the client's own control script and interprets it."""

import subprocess
import sys
import time

import rtde_control
import rtde_receive

host = sys.argv[1]
OPERATOR = """
import socket, sys, time
with socket.create_connection((sys.argv[1], 29999)) as client:
    lines = client.makefile("rw")
    say = lambda text: (lines.write(text + chr(10)), lines.flush(), lines.readline())[2]
    lines.readline()
    say("load external_control.urp")
    while "true" not in say("running"):
        say("play")
        time.sleep(0.5)
"""
"""Presses play until the program runs; in a process of its own, for the client's constructor keeps this one waiting."""

operator = subprocess.Popen([sys.executable, "-c", OPERATOR, host])
flags = rtde_control.RTDEControlInterface.FLAG_USE_EXT_UR_CAP
control = rtde_control.RTDEControlInterface(host, 500.0, flags)
operator.wait()
receive = rtde_receive.RTDEReceiveInterface(host)
target = [-1.54, -1.83, -2.28, -0.59, 1.60, 0.023]
assert control.moveJ(target)
time.sleep(0.1)
assert max(abs(a - b) for a, b in zip(receive.getActualQ(), target, strict=True)) < 1e-6
pose = receive.getActualTCPPose()
pose[2] += 0.05
assert control.moveL(pose)
assert control.isSteady()
assert control.getInverseKinematicsHasSolution(pose)
control.stopScript()
for client in (control, receive):
    client.disconnect()
