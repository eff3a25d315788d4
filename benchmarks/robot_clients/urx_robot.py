"""python-urx: motions, outputs, its real-time monitor and its gripper programs."""

import sys

from urx.robotiq_two_finger_gripper import Robotiq_Two_Finger_Gripper
from urx.urrobot import URRobot

robot = URRobot(sys.argv[1], use_rt=True)
try:
    robot.movej([0.1, -1.4, 1.5, -1.6, -1.5, 0.2], acc=2.0, vel=2.0)
    assert abs(robot.getj()[0] - 0.1) < 1e-3
    pose = robot.getl()
    pose[2] += 0.05
    robot.movel(pose, acc=0.5, vel=0.5)
    assert abs(robot.getl()[2] - pose[2]) < 1e-3
    robot.movexs("movel", [pose, [*pose[:2], pose[2] - 0.05, *pose[3:]]], acc=0.5, vel=0.5, radius=0.0)
    robot.set_tcp((0, 0, 0.1, 0, 0, 0))
    robot.set_payload(0.5, (0, 0, 0.05))
    robot.set_digital_out(3, True)
    robot.rtmon.wait()
    assert len(robot.rtmon.q_actual()) == 6
    gripper = Robotiq_Two_Finger_Gripper(robot)
    gripper.close_gripper()
finally:
    robot.close()
