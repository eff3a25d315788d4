"""Random faults at random moments of random work on a simulated arm: every one must end well.

Well means: done or a named state, in time, with the arm at rest, no process left, every file whole, and an
interrupted recording that a second run completes.
"""

from __future__ import annotations

import contextlib
import json
import os
import shutil
import signal
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from hecbench.errors import HecbenchError, InputError
from hecbench.recording import CameraModel, Mounting, Recording
from hecbench.storage import recording_io
from hecbench.system import pictures
from hecbench_hardware.cameras.images import ImageFolder
from hecbench_hardware.controller_sim.process import SimulatedController
from hecbench_hardware.devices import DeviceFault
from hecbench_hardware.grippers.robotiq import RobotiqGripper
from hecbench_hardware.kinematics import ARMS
from hecbench_hardware.recorder.record import Recorder
from hecbench_hardware.recorder.session import FILE_NAME
from hecbench_hardware.ur.robot import UrRobot
from hecbench_hardware.ur.stream import Supervision
from hecbench_hardware.ur.worker import CONNECT_S

TIME_SCALE = 20.0
PAST_EXPECTED_S = 2.0
"""How long after its expected time a piece of work may end."""
_GRIPPER_S = 1.0
_REST_RAD_S = 1e-6
_READY = np.array([0.3, -1.4, 1.5, -1.6, -1.5, 0.2])
_ANYWHERE = (
    "protective_stop",
    "emergency_stop",
    "link_loss 0.3",
    "link_loss 5",
    "local_mode",
    "stale",
    "program",
    "end_program",
    "kill control",
    "kill stream",
    "hang control",
    "hang stream",
)
_MOVING = ("slow 0.01", "contact 0.6", "push 120")


@dataclass
class Outcome:
    """One trial. `state` is `done`, `refused` or the name of a fault."""

    number: int
    work: str
    fault: str
    at_s: float
    state: str = "unnamed"
    message: str = ""
    elapsed_s: float = 0.0
    allowed_s: float = 0.0
    complaints: list[str] = field(default_factory=list)

    @property
    def fine(self) -> bool:
        """Whether nothing is to complain of."""
        return not self.complaints


@dataclass
class _Trial:
    """The cell of one trial: an arm, a plan, a folder of images, and the place of the recording."""

    controller: SimulatedController
    folder: Path
    robot: UrRobot | None = None

    def connect(self) -> UrRobot:
        supervision = Supervision(max_age_s=0.4, late_s=0.7)
        self.robot = UrRobot(self.controller.host, ARMS["ur5e"], supervision=supervision)
        self.robot.enable()
        return self.robot

    def recorder(self, robot: UrRobot) -> Recorder:
        joints = _READY + 0.1 * np.eye(6)[:3]
        plan = Recording(
            name="campaign",
            mounting=Mounting.EYE_IN_HAND,
            sample_ids=("a", "b", "c"),
            joints_rad=joints,
            camera=CameraModel(16, 12),
        )
        return Recorder(robot, ImageFolder(self.folder / "pictures", loop=True), plan, self.folder / "out")

    def break_something(self, fault: str) -> None:
        """Inject a fault; one that finds nothing to break is harmless."""
        verb, _, role = fault.partition(" ")
        if verb in ("kill", "hang"):
            control = self.robot and self.robot._control
            worker: Any = (
                control and control.worker if role == "control" else self.robot and self.robot._stream
            )
            if worker:
                with contextlib.suppress(ProcessLookupError):
                    os.kill(worker.pid, signal.SIGKILL if verb == "kill" else signal.SIGSTOP)
        elif fault == "torn image":
            (self.folder / "pictures" / "1.png").write_bytes(b"\x89PNG")
        else:
            self.controller.fault(fault)


def _move_joints(trial: _Trial, robot: UrRobot) -> None:
    robot.move_joints(_READY + np.eye(6)[0], speed_rad_s=0.2)
    robot.settle()


def _move_linear(trial: _Trial, robot: UrRobot) -> None:
    target = robot.state().base_T_flange.copy()
    target[2, 3] += 0.1
    robot.move_linear(target, speed_m_s=0.02)
    robot.settle()


def _freedrive(trial: _Trial, robot: UrRobot) -> None:
    with robot.freedrive():
        time.sleep(0.2)
        robot.settle()


def _grip(trial: _Trial, robot: UrRobot) -> None:
    gripper = RobotiqGripper(robot.host, timeout_s=_GRIPPER_S)
    try:
        gripper.enable()
        for _ in range(3):
            gripper.open_fingers()
            gripper.close_fingers()
    finally:
        gripper.close()


def _record(trial: _Trial, robot: UrRobot) -> None:
    trial.recorder(robot).drive()


@dataclass(frozen=True)
class _Work:
    """What is done, when faults fall into it, its expected time with its own time-outs, and what may break."""

    do: Callable[[_Trial, UrRobot], None] | None
    faults_until_s: float
    expected_s: float
    faults: tuple[str, ...]


WORK = {
    "connect": _Work(None, 0.15, CONNECT_S, _ANYWHERE),
    "move_joints": _Work(_move_joints, 0.25, 0.3, _ANYWHERE + _MOVING),
    "move_linear": _Work(_move_linear, 0.25, 0.3, (*_ANYWHERE, *_MOVING, "unreachable")),
    "freedrive": _Work(_freedrive, 0.2, 0.25, _ANYWHERE),
    "grip": _Work(_grip, 0.15, 0.2 + _GRIPPER_S, ("gripper_jam", "gripper_silent", *_ANYWHERE)),
    "record": _Work(_record, 0.15, 0.25, (*_ANYWHERE, *_MOVING, "torn image")),
}


def run(count: int, seed: int, folder: Path) -> Iterator[Outcome]:
    """Do `count` trials, each drawn from `seed` and its number alone; yields every outcome."""
    with SimulatedController(time_scale=TIME_SCALE) as controller:
        for number in range(count):
            rng = np.random.default_rng([seed, number])
            yield _one(controller, number, rng, folder / f"{number:04d}")


def _one(controller: SimulatedController, number: int, rng: np.random.Generator, folder: Path) -> Outcome:
    name = str(rng.choice(list(WORK)))
    work = WORK[name]
    outcome = Outcome(number, name, str(rng.choice(work.faults)), float(rng.uniform(0, work.faults_until_s)))
    outcome.allowed_s = work.expected_s + PAST_EXPECTED_S
    _make_pictures(folder / "pictures")
    trial = _Trial(controller, folder)
    controller.fault("reset")
    controller.fault("place " + " ".join(map(str, _READY.tolist())))
    if work.do:
        trial.connect()
    breaker = threading.Timer(outcome.at_s, trial.break_something, (outcome.fault,))
    began = time.monotonic()
    breaker.start()
    try:
        if work.do and trial.robot:
            work.do(trial, trial.robot)
        else:
            trial.connect()
        outcome.state = "done"
    except DeviceFault as error:
        outcome.state, outcome.message = error.fault.value, str(error)
    except InputError as error:
        outcome.state, outcome.message = "refused", str(error)
    except HecbenchError as error:
        outcome.message = str(error)
    outcome.elapsed_s = time.monotonic() - began
    breaker.join()
    if trial.robot:
        trial.robot.close()
    outcome.complaints = list(_complaints(outcome, trial))
    shutil.rmtree(folder)
    return outcome


def _make_pictures(folder: Path) -> None:
    folder.mkdir(parents=True)
    for k in range(3):
        picture = np.full((12, 16, 3), 80 * k, np.uint8)
        (folder / f"{k}.png").write_bytes(pictures.encode_png(picture))


def _complaints(outcome: Outcome, trial: _Trial) -> Iterator[str]:
    """What is wrong after a trial; leaves the controller without faults."""
    if outcome.state == "unnamed":
        yield "ended in no named state"
    if "\n" in outcome.message:
        yield "the message has more than one line"
    if outcome.elapsed_s > outcome.allowed_s:
        yield f"took {outcome.elapsed_s:.2f} s of {outcome.allowed_s:.2f} s"
    if orphans := _workers():
        yield f"left processes {orphans}"
    deadline = time.monotonic() + 1.0
    while float(trial.controller.ask("speed")) > _REST_RAD_S:
        if time.monotonic() > deadline:
            yield "the arm still moves"
            break
        time.sleep(0.01)
    out = trial.folder / "out"
    if outcome.work == "record" and out.exists():
        yield from _torn_files(out)
        yield from _not_resumed(trial)


def _workers() -> list[int]:
    """Worker processes of this process that are alive."""
    own = os.getpid()
    found = []
    for entry in Path("/proc").iterdir():
        if not entry.name.isdigit():
            continue
        with contextlib.suppress(OSError):
            parent = int((entry / "stat").read_text().rpartition(")")[2].split()[1])
            if parent == own and b"worker.py" in (entry / "cmdline").read_bytes():
                found.append(int(entry.name))
    return found


def _torn_files(out: Path) -> Iterator[str]:
    from PIL import Image

    for path in out.rglob(".*"):
        yield f"left the temporary file {path.name}"
    try:
        for sample in map(json.loads, (out / FILE_NAME).read_text().splitlines()[1:]):
            with Image.open(out / sample["image"]) as picture:
                picture.load()
        if (out / recording_io.FILE_NAME).exists():
            recording_io.load(out)
    except (OSError, ValueError, HecbenchError) as error:
        yield f"left a torn file: {error}"


def _not_resumed(trial: _Trial) -> Iterator[str]:
    """Mend everything and complete the recording."""
    trial.controller.fault("reset")
    shutil.rmtree(trial.folder / "pictures")
    _make_pictures(trial.folder / "pictures")
    try:
        trial.recorder(trial.connect()).drive()
        if len(recording_io.load(trial.folder / "out")) != 3:
            yield "the resumed recording is not complete"
    except HecbenchError as error:
        yield f"not resumed: {error}"
    finally:
        if trial.robot:
            trial.robot.close()
