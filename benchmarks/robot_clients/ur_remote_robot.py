"""ur-remote: its dashboard, all of it, and its primary client."""

import sys

from ur_remote.URRobot import URRobot

robot = URRobot(sys.argv[1])
dashboard = robot.Dashboard
robot.powerOff()
robot.powerOn()
assert dashboard.getSafetyStatus()
assert "5.11" in dashboard.getPolyscopeVersion()
assert dashboard.getRobotModel() == "UR5"
dashboard.addToLog("hello")
dashboard.popupDisplay("hello")
dashboard.popupClose()
dashboard.setOperationalMode("manual")
assert "MANUAL" in str(dashboard.getOperationalMode())
dashboard.clearOperationalMode()
assert "File not found" in dashboard.load("missing")
assert not dashboard.isRunning()
for _ in range(10):
    robot.Primary.readPort()
dashboard.quit()
