"""pyrobotiqur: the gripper's socket."""

import sys

from pyrobotiqur import RobotiqGripper

gripper = RobotiqGripper(sys.argv[1])
gripper.connect()
gripper.activate()
position, _ = gripper.close()
assert position == 255
position, _ = gripper.open()
assert position == 0
gripper.disconnect()
