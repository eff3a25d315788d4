"""What the robot's own file gets wrong: meshes in another unit, joints a hair beyond limits, and starts in odd axes."""

from __future__ import annotations

from hecbench.diagnose.case import Examination
from hecbench.diagnose.finding import Finding, Severity
from hecbench.errors import InputError, Refusal
from hecbench.robots.extent import oversized
from hecbench.robots.posed import PosedRobot

ID = "robot_model"
_SHOW = "hecbench robot FILE --picture OUT.png shows how the robot is read"


def examine(case: Examination) -> tuple[Finding | None, Examination]:
    """Only a robot by its URDF is examined: those by name are known to be right."""
    recording = case.recording
    if recording.robot is None or recording.robot.urdf is None:
        return None, case
    try:
        robot = PosedRobot.of(recording)
        if too_large := oversized(robot.model):
            return Finding(ID, Severity.CRITICAL, "; ".join(too_large), _SHOW), case
        notes = (*robot.model.notes, *robot.model.beyond(robot.joints_rad[robot.samples], robot.joint_names))
        robot.check_start(recording)
    except (InputError, Refusal) as error:
        return Finding(ID, Severity.WARNING, str(error), "the renderer methods cannot use it as it is"), case
    if notes:
        return Finding(ID, Severity.INFO, "; ".join(notes), _SHOW), case
    links, parts = len(robot.model.links), len(robot.model.parts)
    return Finding(ID, Severity.OK, f"{links} links and {parts} visual parts are read"), case
