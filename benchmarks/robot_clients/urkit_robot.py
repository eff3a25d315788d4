"""urkit: motions and its gripper, whose functions it uploads as 1,300 lines of URScript for each command."""

import sys

from urkit.gripper.presets import ROBOTIQ_2F_85
from urkit.robot import URRobot

robot = URRobot(sys.argv[1], gripper=ROBOTIQ_2F_85)
before = robot.rtde_receive.getActualTCPPose()
robot.move_relative(dz=0.03)
assert abs(robot.rtde_receive.getActualTCPPose()[2] - before[2] - 0.03) < 1e-3
robot.gripper.activate(timeout=30.0)
robot.gripper.close()
robot.gripper.open()
robot.disconnect()
