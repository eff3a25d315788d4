"""Opens the cell that ``hecbench trial`` names: the lab with its own arm or a driver, or a real table."""

from __future__ import annotations

from contextlib import ExitStack
from dataclasses import dataclass

from hecbench import registry
from hecbench.commands.devices import device_settings, open_device
from hecbench.errors import InputError
from hecbench.specs import DeviceSpec, Kind
from hecbench_hardware.arming import Operator, take_control
from hecbench_hardware.devices import Robot
from hecbench_hardware.lab import cells
from hecbench_hardware.lab.arm import LabRobot
from hecbench_hardware.lab.cells import Station
from hecbench_hardware.lab.eye import Sensor
from hecbench_hardware.lab.trial_cell import LabCell, lab_camera
from hecbench_hardware.trials import calibrations, solids
from hecbench_hardware.trials.cell import Calibration, TrialCell
from hecbench_hardware.trials.options import TrialOptions
from hecbench_hardware.trials.real_cell import RealCell


@dataclass(frozen=True)
class Opened:
    """A cell under control, what is tried in it, and who is asked."""

    cell: TrialCell
    calibrations: list[Calibration]
    notes: list[str]
    operator: Operator


def open_cell(options: TrialOptions, opened: ExitStack) -> Opened:
    """Open every device and take control; `opened` closes them.

    Raises:
        InputError: The options do not fit together, or the arm may not move.
        DeviceFault: A device does not answer or is not ready.
    """
    spec = registry.load().get(Kind.ROBOT, options.robot, DeviceSpec)
    return _lab_cell(options, opened) if spec.simulated else _real_cell(options, opened)


def _lab_cell(options: TrialOptions, opened: ExitStack) -> Opened:
    station = cells.station(options.station, options.urdf)
    model = cells.camera_model(*options.size_px)
    notes: list[str] = []
    if options.offset_mm is not None:
        found = calibrations.moved_truth(
            station.calibrations, station.camera_pose, options.offset_mm, options.seed
        )
    else:
        found, notes = calibrations.from_estimates(
            options.estimates,
            parent_link=station.base_link,
            camera=model,
            number=options.calibration,
            truth=station.camera_pose,
        )
    robot = _lab_robot(options, station)
    opened.callback(robot.close)
    camera = None
    if options.render:
        camera = lab_camera(station, model, Sensor(options.supersample, options.noise), options.seed)
        opened.callback(camera.close)
    operator = Operator(robot, options.yes)
    take_control(robot, "trials", armed=options.arm, confirm=operator.confirm)
    return Opened(LabCell(station, robot, camera, options.seed, options.dynamics), found, notes, operator)


def _lab_robot(options: TrialOptions, station: Station) -> Robot:
    """The lab's own arm, or the UR driver on a simulated controller with the lab's limits."""
    if options.robot == "lab":
        return LabRobot(station)
    given = device_settings(options.settings)["robot"]
    robot: Robot = open_device(Kind.ROBOT, options.robot, {"max_age_s": "2", **given, **options.host_option})
    if robot.arm.name != station.name:
        robot.close()
        raise InputError(
            f"--robot {options.robot} is not the lab's {station.name}: choose sim_{station.name}"
        )
    robot.limits = station.limits
    return robot


def _real_cell(options: TrialOptions, opened: ExitStack) -> Opened:
    if options.camera is None or options.gripper is None or not options.estimates:
        missing = {"--camera": options.camera, "--gripper": options.gripper}
        needed = [name for name, value in missing.items() if value is None]
        raise InputError(f"a real cell needs {' and '.join([*needed, '--estimate'])}")
    found, notes = calibrations.from_estimates(
        options.estimates, parent_link="base", camera=None, number=0, truth=None
    )
    model = next((item.estimate.camera for item in found if item.estimate), None)
    if model is None:
        raise InputError(f"{options.estimates[0]}: has no answer with a camera: calibrate again")
    settings = device_settings(options.settings)
    camera = open_device(Kind.CAMERA, options.camera, settings["camera"])
    opened.callback(camera.close)
    robot = open_device(Kind.ROBOT, options.robot, settings["robot"] | options.host_option)
    opened.callback(robot.close)
    takes_host = "host" in registry.load().get(Kind.GRIPPER, options.gripper, DeviceSpec).options
    host = options.host_option if takes_host else {}
    gripper = open_device(Kind.GRIPPER, options.gripper, host | settings["gripper"])
    opened.callback(gripper.close)
    shape = solids.GRIPPERS["robotiq_2f_85" if "robotiq" in options.gripper else "rg2"]
    robot.carry(shape.envelope())
    operator = Operator(robot, options.yes)
    what = "trials from where it stands, which becomes its home"
    take_control(robot, what, armed=options.arm, confirm=operator.confirm, gripper=gripper)
    cell = RealCell(robot, gripper, camera, model, shape, places=options.places, ask=operator.ask)
    return Opened(cell, found, notes, operator)
