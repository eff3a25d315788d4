"""Training pictures: a robot of the family in a random place, as a random camera sees it, and what is to be learned.

Domain randomisation (Tobin et al. 2017): whatever the network shall not rely on is drawn at random.
"""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from hecbench.rendering.normal_map import normal_map
from hecbench.se3 import Array
from hecbench_plugins.perception import props
from hecbench_plugins.perception.appearance import Appearance, photographs
from hecbench_plugins.perception.camera_faults import photographed
from hecbench_plugins.perception.clutter import Clutter
from hecbench_plugins.perception.family import Family
from hecbench_plugins.perception.scene import SUPERSAMPLING, Scene, random_scene

Floats = NDArray[np.float32]
Bytes = NDArray[np.uint8]

_EMPTY = 0.12
"""Share of pictures without a robot."""
_LABORATORY = 0.6
"""Share of backgrounds that are crowded with grey things."""
_FLANGE_KEYPOINT = -1
_ODD_COLOURS = 0.12
"""Share of robots in colours of their own."""


@dataclass(frozen=True, eq=False)
class Truth:
    """The robot and the camera of an example.

    Attributes:
        joints_rad: (J,) of the model's joints.
        camera_T_root: (4, 4) m, of the robot's first link.
        K: (3, 3) px of the picture, pixel centres at integers.
    """

    joints_rad: Array
    camera_T_root: Array
    K: Array


@dataclass(frozen=True, eq=False)
class Example:
    """A picture and what is to be learned from it.

    Attributes:
        image: (S, S, 3) RGB.
        shares: (S/2, S/2, 2 + C): shares of area, of 255, of the background and the C colour classes of the whole
            robot as if nothing hid it, and last of the visible robot.
        keypoints: (K, 2) px of the image, NaN behind the camera.
        truth: None in a picture without a robot, and in a photograph.
        visible_known: whether the last of the shares is to be learned.
    """

    image: Bytes
    shares: Bytes
    keypoints: Floats
    truth: Truth | None = None
    visible_known: bool = True


class PictureMaker:
    """Draws examples of `size` px, a share `empty` without a robot; the same seed draws the same sequence."""

    def __init__(
        self,
        family: Family,
        size: int,
        seed: int | tuple[int, ...],
        backgrounds: Path | None = None,
        empty: float = _EMPTY,
    ) -> None:
        self.family, self.size, self.empty = family, size, empty
        self.rng = np.random.default_rng(seed)
        self.appearance = Appearance(self.rng, family.palette[1:], photographs(backgrounds))

    def restart(self, seed: int | tuple[int, ...]) -> None:
        """Go on with the sequence of another seed."""
        self.rng.bit_generator.state = np.random.default_rng(seed).bit_generator.state

    def example(self) -> Example:
        """The next one."""
        rng, side = self.rng, self.size * SUPERSAMPLING
        arm = self.family.arms[rng.integers(len(self.family.arms))]
        scene = random_scene(arm, self.size, rng)
        seen = scene.renderer.face >= 0
        classes = arm.classes(scene.renderer.face)
        background = self._background(side)
        if rng.random() < self.empty:
            nothing = np.zeros_like(seen)
            nowhere = np.full((self.family.keypoint_count, 2), np.nan, np.float32)
            return self._finished(background, np.zeros_like(classes), nothing, nowhere)
        flange = scene.camera_T_link[arm.model.link_index(arm.keypoints[_FLANGE_KEYPOINT].link)]
        canvas = props.Canvas(background, seen.copy(), scene.renderer.nearness.copy(), flange)
        if rng.random() < 0.75:
            props.lay_floor(canvas, scene, self.appearance)
        colours = self._coloured(scene, classes[seen])
        robot = np.zeros_like(background)
        robot[seen] = colours
        self._soil(robot, seen)
        canvas.picture[canvas.visible] = robot[canvas.visible]
        self._furnish(canvas, scene)
        truth = Truth(scene.joints_rad, scene.camera_T_base, scene.K)
        return self._finished(canvas.picture, classes, canvas.visible, scene.keypoint_pixels(), truth)

    def _background(self, side: int) -> Floats:
        rng, appearance = self.rng, self.appearance
        laboratory = rng.random() < _LABORATORY
        appearance.muted = rng.uniform(0, 0.4) if laboratory else None
        back = np.ascontiguousarray(cv2.resize(appearance.texture(self.size, self.size), (side, side)))
        if not laboratory:
            Clutter(back, appearance).scatter(int(rng.choice([0, 6, 20, 50])), (0.02, 0.5))
            return back
        for _ in range(rng.integers(0, 6)):
            width, height = (int(v) for v in rng.uniform(0.08, 0.5, 2) * side)
            x, y = rng.integers(0, side - width), rng.integers(0, side - height)
            back[y : y + height, x : x + width] = cv2.resize(appearance.texture(64, 64), (width, height))
        Clutter(back, appearance).scatter(int(rng.choice([30, 80, 160, 240])), (0.01, rng.uniform(0.1, 0.4)))
        appearance.muted = None
        return back

    def _coloured(self, scene: Scene, classes: Bytes) -> Floats:
        """The lit colours (N, 3) of the robot's N pixels of these classes."""
        rng, count = self.rng, len(self.family.palette)
        normals = normal_map(scene.renderer, scene.arm.normals)[scene.renderer.face >= 0]
        diffuse, gloss, bands = self.appearance.light(normals)
        palette = self.family.palette * (1 + rng.normal(0, 0.12, (count, 1))) + rng.normal(
            0, 0.025, (count, 3)
        )
        if rng.random() < _ODD_COLOURS:
            palette = np.array([self.appearance.colour() for _ in range(count)])
        brightness = self.family.palette.mean(1)
        metal = (rng.uniform(0, 1, count) * (0.3 + 1.2 * brightness)).astype(np.float32)[classes]
        lit = palette.astype(np.float32)[classes] * (diffuse * (1 + metal * bands))[:, None]
        return np.asarray(lit + (0.6 * metal * gloss)[:, None], np.float32)

    def _soil(self, robot: Floats, seen: NDArray[np.bool_]) -> None:
        """Shadows that fall on the robot, and letters."""
        rng, side = self.rng, len(robot)
        if rng.random() < 0.5:
            cells = (rng.random((int(rng.integers(3, 9)),) * 2) < 0.35).astype(np.float32)
            smooth = cv2.INTER_CUBIC if rng.random() < 0.7 else cv2.INTER_NEAREST
            dark = np.clip(cv2.resize(cells, (side, side), interpolation=smooth), 0, 1)
            robot *= (1 - np.float32(rng.uniform(0.2, 0.65)) * dark)[..., None]
        if rng.random() < 0.3:
            y, x = np.nonzero(seen)
            for place in rng.integers(len(y), size=rng.integers(1, 4)):
                where, ink = (int(x[place]), int(y[place])), (self.appearance.colour() * 0.4).tolist()
                cv2.putText(robot, "ROBOTICS", where, 2, rng.uniform(0.2, 0.6), ink, 1, cv2.LINE_AA)

    def _furnish(self, canvas: props.Canvas, scene: Scene) -> None:
        """What the robot holds, and what stands before it."""
        rng = self.rng
        if rng.random() < 0.25:
            props.hold_gripper(canvas, scene, rng)
        if rng.random() < 0.4:
            props.hold_board(canvas, scene, self.appearance)
        if rng.random() < 0.3:
            props.hang_cable(canvas, scene, self.appearance)
        if rng.random() < 0.25:
            before = Clutter(canvas.picture, self.appearance)
            before.scatter(int(rng.integers(1, 4)), (0.05, 0.4))
            canvas.visible &= before.covered == 0

    def _finished(
        self,
        picture: Floats,
        classes: Bytes,
        visible: NDArray[np.bool_],
        points: Floats,
        truth: Truth | None = None,
    ) -> Example:
        small = cv2.resize(picture, (self.size, self.size), interpolation=cv2.INTER_AREA)
        shares = shares_of(classes, visible, len(self.family.palette), self.size // 2)
        return Example(photographed(np.maximum(small, 0), self.rng), shares, points, truth)


def shares_of(classes: Bytes, visible: NDArray[np.bool_], count: int, side: int) -> Bytes:
    """Shares of area (side, side, count + 1), of 255: of each of `count` classes (H, H), and of the visible robot."""
    layers = [classes == c for c in range(count)] + [visible]
    shares = [cv2.resize(m.astype(np.float32), (side, side), interpolation=cv2.INTER_AREA) for m in layers]
    return np.asarray(np.rint(np.stack(shares, -1) * 255), np.uint8)
