"""The dashboard of the simulated controller: a line in, a line out (maker's "Dashboard Server e-Series")."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

from hecbench_hardware.controller_sim.channel import Finished
from hecbench_hardware.controller_sim.external_control import PROGRAM, external_control
from hecbench_hardware.controller_sim.program import ProgramRunner
from hecbench_hardware.controller_sim.signals import RobotMode, RuntimeState, SafetyMode

GREETING = "Connected: Universal Robots Dashboard Server"
SIMULATED = "(hecbench simulated)"
"""The end of the answer to PolyscopeVersion: by it a client knows that no metal moves."""
SERIAL_NUMBER = "20205501234"
INSTALLATION = "default.installation"
_LONGEST_COMMAND = 4
_FLIGHT_REPORTS = ("controller", "software", "system")
_ACTS = frozenset({"play", "stop", "power on", "power off", "brake release", "unlock protective stop"})
"""What changes whether the arm may move, and is noted."""
_OPERATIONAL_MODES = ("manual", "automatic")


@dataclass
class Dashboard:
    """Answers the operator's commands. The runner's `remote` is the switch between remote and local control."""

    program: ProgramRunner
    version: tuple[int, int, int, int]
    loaded: str = ""
    operational_mode: str = ""
    marked: bool = True
    """Whether the version says that no metal moves; without the mark it is taken for a real controller."""
    _commands: dict[str, Callable[[str], str]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        """Name the commands; each takes the rest of its line."""
        self._commands = {
            "load installation": self._load_installation,
            "load": self._load,
            "play": lambda _: self._play(),
            "stop": lambda _: self._stop(),
            "pause": lambda _: "Pausing program" if self.program.pause() else "Failed to execute: pause",
            "shutdown": lambda _: self._power_off("Shutting down"),
            "running": lambda _: f"Program running: {self._is(RuntimeState.PLAYING)}",
            "robotmode": lambda _: f"Robotmode: {self.program.arm.robot_mode.name}",
            "get loaded program": lambda _: (
                f"Loaded program: {self.loaded}" if self.loaded else "No program loaded"
            ),
            "popup": self._popup,
            "close popup": lambda _: self._close_popup("closing popup"),
            "addtolog": self._add_to_log,
            "isprogramsaved": lambda _: f"true {self.loaded or '<unnamed>'}",
            "programstate": lambda _: f"{self.program.runtime.name} {self.loaded or self.program.name}",
            "polyscopeversion": lambda _: (
                f"URSoftware {self._number()}{f' {SIMULATED}' if self.marked else ''}"
            ),
            "version": lambda _: self._number(),
            "set operational mode": self._set_operational_mode,
            "get operational mode": lambda _: self.operational_mode.upper() or "NONE",
            "clear operational mode": lambda _: self._clear_operational_mode(),
            "power on": lambda _: self._power_on(),
            "power off": lambda _: self._power_off("Powering off"),
            "brake release": lambda _: self._release_brakes(),
            "safetystatus": lambda _: f"Safetystatus: {self.program.arm.safety.name}",
            "safetymode": lambda _: f"Safetymode: {self.program.arm.safety.name}",
            "unlock protective stop": lambda _: self._unlock(),
            "close safety popup": lambda _: self._close_popup("closing safety popup"),
            "restart safety": lambda _: "Restarting safety",
            "is in remote control": lambda _: str(self.program.remote).lower(),
            "get serial number": lambda _: SERIAL_NUMBER,
            "get robot model": lambda _: self.program.arm.arm.name.upper().rstrip("E"),
            "generate flight report": self._flight_report,
            "generate support file": lambda path: f"Error: no file system is simulated at '{path}'",
        }

    def reply(self, line: str) -> bytes:
        """The answer as it is sent; `quit` ends the conversation."""
        if line.strip().lower() == "quit":
            raise Finished(b"Disconnected\n")
        return f"{self.answer(line)}\n".encode()

    def answer(self, line: str) -> str:
        """The controller's answer to one command."""
        words = line.split()
        for count in range(min(_LONGEST_COMMAND, len(words)), 0, -1):
            name = " ".join(words[:count]).lower()
            if command := self._commands.get(name):
                if name in _ACTS:
                    self.program.arm.note(f"dashboard: {name}")
                return command(" ".join(words[count:]))
        return f"could not understand: '{line.strip()[:100]}'"

    def _number(self) -> str:
        major, minor, bugfix, build = self.version
        return f"{major}.{minor}.{bugfix}.{1_090_000 + build}"

    def _is(self, state: RuntimeState) -> str:
        return str(self.program.runtime is state).lower()

    def _load(self, name: str) -> str:
        if name.rpartition("/")[2] != PROGRAM:
            return f"File not found: {name}"
        self.program.kill()
        self.loaded = name
        return f"Loading program: {name}"

    def _load_installation(self, name: str) -> str:
        found = name.rpartition("/")[2] == INSTALLATION
        return f"Loading installation: {name}" if found else f"File not found: {name}"

    def _play(self) -> str:
        runner = self.program
        if not runner.resume() and self.loaded and runner.runtime is RuntimeState.STOPPED:
            runner.start(external_control(runner), self.loaded)
        return "Starting program" if runner.runtime is RuntimeState.PLAYING else "Failed to execute: play"

    def _stop(self) -> str:
        self.program.kill()
        return "Stopped"

    def _popup(self, text: str) -> str:
        self.program.popup = text
        return "showing popup"

    def _close_popup(self, answer: str) -> str:
        self.program.popup = None
        return answer

    def _add_to_log(self, text: str) -> str:
        if not text:
            return "No log message to add"
        self.program.arm.note(text)
        return "Added log message"

    def _set_operational_mode(self, mode: str) -> str:
        if mode.lower() not in _OPERATIONAL_MODES:
            return f"Failed setting operational mode: {mode}"
        self.operational_mode = mode.lower()
        return f"Setting operational mode: {mode.upper()}"

    def _clear_operational_mode(self) -> str:
        self.operational_mode = ""
        return "No longer controlling the operational mode. Current operational mode: 'NONE'."

    def _flight_report(self, kind: str) -> str:
        if kind and kind.lower() not in _FLIGHT_REPORTS:
            return f"Error: '{kind}' is not one of {', '.join(_FLIGHT_REPORTS)}"
        return f"Flight Report generated with id: {int(self.program.arm.time_s * 1000)}"

    def _power_on(self) -> str:
        arm = self.program.arm
        if arm.safety is SafetyMode.NORMAL and arm.robot_mode is RobotMode.POWER_OFF:
            arm.robot_mode = RobotMode.IDLE
        return "Powering on"

    def _power_off(self, answer: str) -> str:
        self.program.kill()
        self.program.arm.robot_mode = RobotMode.POWER_OFF
        return answer

    def _release_brakes(self) -> str:
        arm = self.program.arm
        if arm.safety is SafetyMode.NORMAL and arm.robot_mode is not RobotMode.POWER_OFF:
            arm.robot_mode = RobotMode.RUNNING
        return "Brake releasing"

    def _unlock(self) -> str:
        if self.program.arm.unlock():
            self.program.popup = None
            return "Protective stop releasing"
        return "Cannot unlock protective stop until 5s after occurrence. Always inspect the cause first"
