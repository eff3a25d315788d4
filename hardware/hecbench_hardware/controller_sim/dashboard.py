"""The dashboard of the simulated controller: a line in, a line out (maker's "Dashboard Server")."""

from __future__ import annotations

from dataclasses import dataclass

from hecbench_hardware.controller_sim.program import ProgramRunner
from hecbench_hardware.controller_sim.signals import RobotMode, RuntimeState, SafetyMode

GREETING = "Connected: Universal Robots Dashboard Server"
SIMULATED = "(hecbench simulated)"
"""The end of the answer to PolyscopeVersion: by it a client knows that no metal moves."""
SERIAL_NUMBER = "20205501234"

_FIXED = {
    "close safety popup": "closing safety popup",
    "close popup": "closing popup",
    "restart safety": "Restarting safety",
    "get serial number": SERIAL_NUMBER,
    "play": "Failed to execute: play",
    "quit": "Disconnected",
}


@dataclass
class Dashboard:
    """Answers the operator's commands. `remote` is the switch between remote and local control."""

    program: ProgramRunner
    version: tuple[int, int, int, int]
    remote: bool = True
    marked: bool = True
    """Whether the version says that no metal moves; without the mark it is taken for a real controller."""

    def answer(self, line: str) -> str:
        """The controller's answer to one command."""
        command = line.strip().lower()
        arm, program = self.program.arm, self.program
        if command == "polyscopeversion":
            major, minor, bugfix, build = self.version
            mark = f" {SIMULATED}" if self.marked else ""
            return f"URSoftware {major}.{minor}.{bugfix}.{1_090_000 + build}{mark}"
        if command == "get robot model":
            return arm.arm.name.upper().rstrip("E")
        if command == "is in remote control":
            return str(self.remote).lower()
        if command == "running":
            return f"Program running: {str(program.runtime is RuntimeState.PLAYING).lower()}"
        if command == "programstate":
            return f"{program.runtime.name} <unnamed>"
        if command == "robotmode":
            return f"Robotmode: {arm.robot_mode.name}"
        if command in ("safetymode", "safetystatus"):
            return f"{command.capitalize()}: {arm.safety.name}"
        if command in ("stop", "power on", "brake release", "power off", "unlock protective stop"):
            return self._act(command)
        if command.startswith("popup"):
            return "showing popup"
        if command.startswith("load "):
            return f"File not found: {command[5:]}"
        return _FIXED.get(command, f"could not understand: '{line.strip()}'")

    def _act(self, command: str) -> str:
        arm, program = self.program.arm, self.program
        arm.note(f"dashboard: {command}")
        if command == "stop":
            program.kill()
            return "Stopped"
        if command == "power off":
            program.kill()
            arm.robot_mode = RobotMode.POWER_OFF
            return "Powering off"
        if command == "unlock protective stop":
            if arm.unlock():
                return "Protective stop releasing"
            return "Cannot unlock protective stop until 5s after occurrence. Always inspect the cause first"
        powered = arm.robot_mode is not RobotMode.POWER_OFF
        if arm.safety is SafetyMode.NORMAL and command == "power on" and not powered:
            arm.robot_mode = RobotMode.IDLE
        if arm.safety is SafetyMode.NORMAL and command == "brake release" and powered:
            arm.robot_mode = RobotMode.RUNNING
        return "Powering on" if command == "power on" else "Brake releasing"
