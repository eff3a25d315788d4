"""Pictures of a trial: what the camera saw with the tag and the planned grasp drawn in, and a GIF of the motion."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from hecbench import se3
from hecbench.errors import InputError
from hecbench.recording import CameraModel
from hecbench.se3 import Array
from hecbench.storage import trial_record
from hecbench.system import files
from hecbench.system.pictures import encode_png
from hecbench_hardware import tag_edges, tags
from hecbench_hardware.lab import cells
from hecbench_hardware.lab.cells import Station
from hecbench_hardware.lab.eye import Eye, Sensor
from hecbench_hardware.motions import LineMotion
from hecbench_hardware.trials import solids, tasks
from hecbench_hardware.trials.cell import Calibration, believed_workpiece
from hecbench_hardware.trials.solids import Box, Solid
from hecbench_hardware.trials.tasks import Task
from hecbench_hardware.trials.trial import reach

Image = NDArray[np.uint8]

_TAG_RGB, _TOOL_RGB = (235, 60, 60), (60, 220, 90)
_AROUND_PX = 130
_PART, _FRAME_MS = 12, 90
"""Frames of each third of the motion, and how long one is shown."""
_ON_PEG_RAD, _ON_BLOCK_RAD = 0.62, 0.43
"""The finger joint at which the Robotiq's pads are as far apart as the peg or the block is thick."""


def planned(
    image: Image, camera: CameraModel, seen: tags.TagPose, gripper: solids.Gripper, task: Task
) -> Image:
    """The picture around the tag with its outline, its axes, and the tool where it is to end."""
    import cv2

    drawn = image.copy()
    outline = np.rint(seen.corners_px).astype(np.int32)
    cv2.polylines(drawn, [outline], True, _TAG_RGB, 2, cv2.LINE_AA)
    half = solids.TAG.size_m / 2
    axes = tag_edges.project(
        camera, seen.camera_T_tag, half * np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, -1]])
    )
    for end, colour in zip(axes[1:], ((255, 0, 0), (0, 200, 0), (0, 80, 255)), strict=True):
        cv2.line(drawn, _pixel(axes[0]), _pixel(end), colour, 2, cv2.LINE_AA)
    camera_T_workpiece = seen.camera_T_tag @ se3.inverse(solids.workpiece_T_tag())
    camera_T_tool = camera_T_workpiece @ tasks.workpiece_T_tool(task)
    pixels = [outline.astype(float)]
    for solid in (*gripper.solids(), *([solids.peg()] if task is Task.INSERTION else [])):
        corners, edges = _edges(solid)
        found = tag_edges.project(camera, camera_T_tool, corners)
        pixels.append(found)
        for first, second in edges:
            cv2.line(drawn, _pixel(found[first]), _pixel(found[second]), _TOOL_RGB, 1, cv2.LINE_AA)
    every = np.concatenate(pixels)
    low = np.maximum(every.min(0) - _AROUND_PX, 0).astype(int)
    high = np.minimum(every.max(0) + _AROUND_PX, [camera.width, camera.height]).astype(int)
    return np.ascontiguousarray(drawn[low[1] : high[1], low[0] : high[0]])


def _pixel(point: Array) -> tuple[int, int]:
    u, v = np.rint(point).astype(int)
    return int(u), int(v)


def _edges(solid: Solid) -> tuple[Array, list[tuple[int, int]]]:
    """Corners (8, 3) m of a box, or of the one around a cylinder, and the pairs of them that an edge joins."""
    signs = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    pairs = [(i, j) for i in range(8) for j in range(i) if np.abs(signs[i] - signs[j]).sum() == 2]
    half = solid.half_m if isinstance(solid, Box) else (solid.radius_m, solid.radius_m, solid.half_length_m)
    return np.array(solid.centre_m) + signs * np.array(half), pairs


def frames(
    station: Station,
    task: Task,
    base_T_workpiece: Array,
    believed: Array,
    width: int = 480,
    height: int = 360,
) -> list[Image]:
    """From home to where the workpiece is believed to be, seen from near where it is: a peg goes in and out, and
    fingers close.

    Raises:
        InputError: The arm cannot go there.
    """
    inserts = task is Task.INSERTION
    wanted = believed @ tasks.workpiece_T_tool(task)
    above, end = reach(station.arm, station.home_rad, station.gripper, task, wanted)
    down = LineMotion(station.arm, above, end @ se3.inverse(station.gripper.flange_T_tool)).joints
    last = down[::-1] if inserts else down[-1:]
    parts = np.linspace(station.home_rad, above, _PART), down, last
    path = np.concatenate([part[np.linspace(0, len(part) - 1, _PART).astype(int)] for part in parts])
    closing = np.full(_PART, _ON_PEG_RAD) if inserts else np.linspace(0, _ON_BLOCK_RAD, _PART)
    fingers = np.concatenate([np.full(2 * _PART, _ON_PEG_RAD if inserts else 0.0), closing])
    scene = station.scene(workpiece=True, peg=inserts)
    look_at = base_T_workpiece[:3, 3] + [0.0, 0.0, 0.16]
    base_T_camera = cells.looking_at(
        look_at + station.base_T_room[:3, :3] @ np.array([0.75, 0.55 if inserts else -0.55, 0.45]), look_at
    )
    eye = Eye(scene, cells.camera_model(width, height, 0.9 * width), Sensor(2))
    drawn = []
    try:
        for joints, finger in zip(path, fingers, strict=True):
            scene.place(joints, base_T_workpiece, finger if station.draws_gripper_meshes else 0.0)
            drawn.append(eye.image(base_T_camera))
    finally:
        eye.close()
    return drawn


def gif(frames: list[Image]) -> bytes:
    """An endless GIF."""
    from PIL import Image as PillowImage

    palette = PillowImage.fromarray(np.concatenate(frames)).quantize(128)
    first, *others = (
        PillowImage.fromarray(frame).quantize(palette=palette, dither=PillowImage.Dither.NONE)
        for frame in frames
    )
    stream = io.BytesIO()
    first.save(stream, "GIF", save_all=True, append_images=others, duration=_FRAME_MS, loop=0)
    return stream.getvalue()


def write(
    folder: Path,
    task: Task,
    calibration: Calibration,
    station: Station,
    model: CameraModel | None = None,
    sensor: Sensor | None = None,
    place: int = 0,
) -> list[Path]:
    """Draw one trial into a folder, `<arm>_<task>.png` and `.gif`, whatever of it can be drawn.

    The first is what the camera sees; the second is left out when the arm cannot go there.
    """
    from hecbench_hardware.lab.trial_cell import lab_camera

    model = model or cells.camera_model()
    base_T_workpiece = station.workpiece_pose(place)
    camera = lab_camera(station, model, sensor or Sensor(2, 2.0), 0)
    camera.base_T_camera = station.camera_pose(calibration.number)
    camera.base_T_workpiece = base_T_workpiece
    try:
        image = camera.grab().image
    finally:
        camera.close()
    png, moving = (
        folder / trial_record.picture_name(station.name, task, suffix) for suffix in ("png", "gif")
    )
    try:
        seen = tags.locate(image, model, solids.TAG)
    except tag_edges.TagRefused:
        return []
    files.write_bytes(png, encode_png(planned(image, model, seen, station.gripper, task)))
    believed = believed_workpiece(calibration, seen.camera_T_tag)
    try:
        shown = frames(station, task, base_T_workpiece, believed)
    except InputError:
        return [png]
    files.write_bytes(moving, gif(shown))
    return [png, moving]
