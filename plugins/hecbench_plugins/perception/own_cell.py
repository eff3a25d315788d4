"""Photographs of one's own cell as training pictures, labelled by the one camera that explains all of them.

A calibration without masks or markers finds the camera, and its own verification says whether it is right; the robot's
model, drawn there, then says what every pixel shows. What hides the robot is not known, so that these pictures do not
teach what is visible.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from hecbench import registry, se3
from hecbench.errors import InputError, Refusal
from hecbench.estimate import Status
from hecbench.preparation import load_recording
from hecbench.recording import Recording
from hecbench.rendering import Renderer
from hecbench.robots.posed import PosedRobot
from hecbench.running import solving
from hecbench.se3 import Array
from hecbench.specs import Kind, SolverSpec
from hecbench_plugins.perception.camera_faults import photographed
from hecbench_plugins.perception.choice import robot_of
from hecbench_plugins.perception.family import Arm, Family
from hecbench_plugins.perception.pictures import Example, PictureMaker, shares_of
from hecbench_plugins.perception.scene import SUPERSAMPLING, pixels_of, supersampled
from hecbench_plugins.perception.skeleton import LINK_RADIUS_M
from hecbench_plugins.views.canvas import Canvas, undistorted_canvas

_OWN = 0.25
"""Share of the pictures."""
_SIDE = (0.35, 1.1)
"""The robot's extent as a share of the picture's side, on a logarithmic scale."""


@dataclass(frozen=True, eq=False)
class Cell:
    """The photographs of a recording, and where the robot is in each.

    Attributes:
        arm: the robot.
        canvas: N photographs without the lens, all but those that the whole robot is behind.
        camera_T_link: (N, L, 4, 4) m, in the order of the arm's links.
    """

    arm: Arm
    canvas: Canvas
    camera_T_link: Array

    @staticmethod
    def of(path: Path, family: Family) -> Cell:
        """The cell of a recording with photographs and joints.

        Raises:
            InputError: it cannot be read, its robot is not of the family, or its photographs confirm no camera.
        """
        recording = load_recording(path)
        try:
            name = robot_of(recording)
            arm = next((arm for arm in family.arms if arm.model.name == name), None)
            if arm is None:
                raise InputError(
                    f"{path}: its robot is {name}, the network is for {', '.join(family.names)}: add --robot {name}"
                )
            posed = PosedRobot.of(recording, meshes=False)
            canvas = undistorted_canvas(recording, posed)
        except Refusal as reason:
            raise InputError(f"{path}: {reason}") from None
        links = [posed.model.link_index(link) for link in arm.model.links]
        camera_T_link = se3.inverse(_camera(path, recording)) @ canvas.parent_T_link[:, links]
        shown = np.flatnonzero((arm.keypoint_positions(camera_T_link)[..., 2] > 0).any(1))
        return Cell(arm, canvas.subset(shown), camera_T_link[shown])


def _camera(path: Path, recording: Recording) -> Array:
    """parent_T_camera (4, 4) m that the photographs confirm; the target, masks and the truth are not looked at."""
    alone = replace(recording.without_truth(), masks=None, corners_px=None, target=None, camera_T_target=None)
    name = "render_gn_free" if recording.initial_parent_T_camera is None else "render_gn"
    spec = registry.load().get(Kind.SOLVER, name, SolverSpec)
    estimate = solving.solve(alone, [spec], solving.Options(held_out=False))[0]
    if estimate.status is not Status.OK or estimate.parent_T_camera is None:
        raise InputError(
            f"{path}: nothing can be learned from it, for {name} finds no camera: {estimate.reason}"
        )
    return estimate.parent_T_camera


class WithOwnCells:
    """Examples of which some are photographs of one's own cells; the others are drawn."""

    def __init__(self, drawn: PictureMaker, cells: Sequence[Cell]) -> None:
        self.family, self.size = drawn.family, drawn.size
        self._drawn, self._cells = drawn, cells

    def example(self) -> Example:
        """The next one."""
        rng = self._drawn.rng
        if rng.random() >= _OWN:
            return self._drawn.example()
        cell = self._cells[int(rng.integers(len(self._cells)))]
        return self._own(cell, int(rng.integers(len(cell.canvas))), rng)

    def _own(self, cell: Cell, view: int, rng: np.random.Generator) -> Example:
        """A square part of a photograph with at least some of the robot."""
        poses = cell.camera_T_link[view]
        points = cell.arm.keypoint_positions(poses)
        pixels = pixels_of(points, cell.canvas.K)
        left, top, side = _part(pixels, points, cell.canvas, rng)
        scale = self.size / side
        K = np.diag([scale, scale, 1.0]) @ cell.canvas.K
        K[:2, 2] = (cell.canvas.K[:2, 2] - [left, top] + 0.5) * scale - 0.5
        fine = SUPERSAMPLING * self.size
        renderer = Renderer(cell.arm.mesh, supersampled(K), fine, fine)
        renderer.rasterise(poses)
        classes = cell.arm.classes(renderer.face)
        photograph = cell.canvas.images[view][top : top + side, left : left + side]
        way = cv2.INTER_AREA if scale < 1 else cv2.INTER_LINEAR
        small = cv2.resize(photograph, (self.size, self.size), interpolation=way).astype(np.float32) / 255
        shares = shares_of(classes, classes > 0, len(self.family.palette), self.size // 2)
        return Example(photographed(small, rng), shares, pixels_of(points, K), visible_known=False)


def _part(
    pixels: NDArray[np.float32], points_c: Array, canvas: Canvas, rng: np.random.Generator
) -> tuple[int, int, int]:
    """Left, top and side px of a square inside the photograph, about a robot with these keypoints (K, 2) px."""
    valid = np.nonzero(canvas.valid)
    first, last = np.array([axis.min() for axis in valid]), np.array([axis.max() + 1 for axis in valid])
    seen = np.isfinite(pixels).all(1)
    low, high = pixels[seen].min(0), pixels[seen].max(0)
    margin = LINK_RADIUS_M * canvas.K[0, 0] / float(np.median(points_c[seen, 2]))
    extent = float((high - low).max()) + 2 * margin
    side = int(min(extent / np.exp(rng.uniform(*np.log(_SIDE))), *(last - first)))
    middle = (low + high) / 2 + rng.uniform(-0.3, 0.3, 2) * side
    corner = np.clip((middle - side / 2)[::-1].round().astype(int), first, last - side)
    return int(corner[1]), int(corner[0]), side
