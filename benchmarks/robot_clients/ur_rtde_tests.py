"""ur_rtde: what its own tests assert (joints, line, path, force mode, blended path, outputs)."""

import sys
import time

import dashboard_client
import numpy as np
import rtde_control
import rtde_io
import rtde_receive
from rtde_control import Path, PathEntry

host = sys.argv[1]
dashboard = dashboard_client.DashboardClient(host)
dashboard.connect()
dashboard.brakeRelease()
control = rtde_control.RTDEControlInterface(host)
receive = rtde_receive.RTDEReceiveInterface(host)
outputs = rtde_io.RTDEIOInterface(host)
time.sleep(0.2)
control.moveJ([-1.54, -1.83, -2.28, -0.59, 1.60, 0.023])
time.sleep(0.1)
start_q, start_pose = receive.getActualQ(), receive.getActualTCPPose()


def close(actual, target, epsilon=0.005):
    time.sleep(0.1)
    assert np.allclose(actual(), target, rtol=epsilon, atol=epsilon), (actual(), target)


target_q = [start_q[0] + 0.5235, *start_q[1:]]
assert control.moveJ(target_q, 1.05, 1.4)
close(receive.getActualQ, target_q)
control.moveL(start_pose, 3, 3)
target = [*start_pose[:2], start_pose[2] + 0.1, *start_pose[3:]]
assert control.moveL(target, 0.25, 0.5)
close(receive.getActualTCPPose, target)

path, pose, line, joint = Path(), PathEntry.PositionTcpPose, PathEntry.MoveL, PathEntry.MoveJ
path.addEntry(PathEntry(joint, pose, [-0.140, -0.400, 0.100, 0, 3.14, 0, 0.5, 4, 0]))
path.addEntry(PathEntry(line, pose, [-0.140, -0.400, 0.300, 0, 3.14, 0, 0.5, 4, 0.099]))
path.addEntry(PathEntry(line, pose, [-0.140, -0.600, 0.300, 0, 3.14, 0, 0.5, 4, 0.099]))
path.addEntry(PathEntry(line, pose, [0.280, -0.400, 0.100, 0, 3.14, 0, 0.5, 4, 0]))
assert control.movePath(path, False)
close(receive.getActualTCPPose, [0.280, -0.400, 0.100, 0, 3.14, 0])

joints = [-1.54, -1.83, -2.28, -0.59, 1.60, 0.023]
assert control.moveJ(joints)
time.sleep(0.1)
resting = receive.getActualTCPPose()
lowest = resting[2]
for i in range(1000):
    begin = control.initPeriod()
    wrench = [0, 0, 10.0 if i > 500 else -10.0, 0, 0, 0]
    control.forceMode([0] * 6, [0, 0, 1, 0, 0, 0], wrench, 2, [2, 2, 1.5, 1, 1, 1])
    lowest = min(lowest, receive.getActualTCPPose()[2])
    control.waitPeriod(begin)
control.forceModeStop()
assert lowest < resting[2] - 0.005
close(receive.getActualTCPPose, resting, 0.05)

blended = [
    [-0.143, -0.435, 0.20, -0.001, 3.12, 0.04, 0.5, 0.5, 0.0],
    [-0.32, -0.61, 0.31, -0.001, 3.12, 0.04, 0.5, 0.5, 0.0],
]
assert control.moveL(blended)
close(receive.getActualTCPPose, blended[-1][:6])

for i in range(8):
    outputs.setStandardDigitalOut(i, True)
    outputs.setConfigurableDigitalOut(i, True)
outputs.setToolDigitalOut(0, True)
outputs.setToolDigitalOut(1, True)
time.sleep(0.5)
assert all(receive.getDigitalOutState(i) for i in range(18))
control.stopScript()
for client in (control, receive, outputs):
    client.disconnect()
