"""Pictures of a trial: what the camera saw with the tag and the planned grasp drawn in, and a GIF of the motion."""

from __future__ import annotations

import io
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from hecbench import files, se3
from hecbench.recording import CameraModel
from hecbench.recording_io import encode_png
from hecbench.se3 import Array
from hecbench_hardware import limits as bounds
from hecbench_hardware import tag_edges, tags
from hecbench_hardware.lab import cells
from hecbench_hardware.lab.cells import Station
from hecbench_hardware.lab.eye import Eye, Sensor
from hecbench_hardware.lab.scene import Scene
from hecbench_hardware.trials import solids, tasks
from hecbench_hardware.trials.solids import Box
from hecbench_hardware.trials.tasks import Task

Image = NDArray[np.uint8]

_TAG_RGB, _GRASP_RGB = (235, 60, 60), (60, 220, 90)
_AROUND_PX = 130
_FRAMES, _FRAME_MS = 36, 90
_ON_PEG_RAD = 0.62
"""The finger joint at which the Robotiq's pads are as far apart as the peg is thick."""


def planned_grasp(image: Image, camera: CameraModel, seen: tags.TagPose, station: Station) -> Image:
    """The picture around the tag with its outline, its axes, and the gripper where it will grasp."""
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
    camera_T_tool = camera_T_workpiece @ tasks.workpiece_T_tool(Task.GRASP)
    pixels = [outline.astype(float)]
    for solid in station.gripper.solids():
        if isinstance(solid, Box):
            corners, edges = _edges(solid)
            found = tag_edges.project(camera, camera_T_tool, corners)
            pixels.append(found)
            for first, second in edges:
                cv2.line(drawn, _pixel(found[first]), _pixel(found[second]), _GRASP_RGB, 1, cv2.LINE_AA)
    every = np.concatenate(pixels)
    low = np.maximum(every.min(0) - _AROUND_PX, 0).astype(int)
    high = np.minimum(every.max(0) + _AROUND_PX, [camera.width, camera.height]).astype(int)
    return np.ascontiguousarray(drawn[low[1] : high[1], low[0] : high[0]])


def _pixel(point: Array) -> tuple[int, int]:
    u, v = np.rint(point).astype(int)
    return int(u), int(v)


def _edges(box: Box) -> tuple[Array, list[tuple[int, int]]]:
    """Corners (8, 3) m and the pairs of them that an edge joins."""
    signs = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
    pairs = [(i, j) for i in range(8) for j in range(i) if np.abs(signs[i] - signs[j]).sum() == 2]
    return np.array(box.centre_m) + signs * np.array(box.half_m), pairs


def insertion_frames(station: Station, width: int = 480, height: int = 360) -> list[Image]:
    """From home above the hole, down, and up again, seen from nearby."""
    base_T_workpiece = station.workpiece_pose(1)
    end = base_T_workpiece @ tasks.workpiece_T_tool(Task.INSERTION)
    flange = end @ se3.inverse(station.gripper.flange_T_tool)
    start = tasks.above(flange, tasks.stroke_m(Task.INSERTION))
    above = station.arm.inverse(start, station.home_rad)[0]
    down = bounds.linear_path(station.arm, above, flange)
    parts = bounds.joint_path(station.home_rad, above), down, down[::-1]
    path = np.concatenate([part[np.linspace(0, len(part) - 1, _FRAMES // 3).astype(int)] for part in parts])
    scene = Scene(
        station.robot,
        joint_names=station.joint_names,
        base_link=station.base_link,
        flange_link=station.flange_link,
        gripper=None if station.draws_gripper_meshes else station.gripper,
        peg_of=station.gripper,
        workpiece=True,
        surroundings=station.surroundings,
    )
    look_at = base_T_workpiece[:3, 3] + [0.0, 0.0, 0.16]
    base_T_camera = cells.looking_at(
        look_at + station.base_T_room[:3, :3] @ np.array([0.75, 0.55, 0.45]), look_at
    )
    eye = Eye(scene, cells.camera_model(width, height, 0.9 * width), Sensor(2))
    frames = []
    try:
        for joints in path:
            scene.place(joints, base_T_workpiece, _ON_PEG_RAD if station.draws_gripper_meshes else 0.0)
            frames.append(eye.image(base_T_camera))
    finally:
        eye.close()
    return frames


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


def write(folder: Path) -> list[Path]:
    """Draw `grasp.png` and `insertion.gif` of the UR5e into a folder."""
    from hecbench_hardware.lab.trial_cell import lab_camera

    station, camera = cells.ur5e(), cells.camera_model()
    lab = lab_camera(station, camera, Sensor(2, 2.0), 0)
    lab.base_T_camera, lab.base_T_workpiece = station.camera_pose(7), station.workpiece_pose(1)
    try:
        image = lab.grab().image
    finally:
        lab.close()
    seen = tags.locate(image, camera, solids.TAG)
    paths = [folder / "grasp.png", folder / "insertion.gif"]
    files.write_bytes(paths[0], encode_png(planned_grasp(image, camera, seen, station)))
    files.write_bytes(paths[1], gif(insertion_frames(station)))
    return paths
