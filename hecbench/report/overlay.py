"""Pictures of an answer: the robot drawn over a recording's images, and the way of a descent."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hecbench import se3
from hecbench.errors import InputError
from hecbench.estimate import Estimate
from hecbench.recording import Recording
from hecbench.rendering import Renderer, RenderMesh
from hecbench.rendering.undistort import Undistortion
from hecbench.robots.posed import PosedRobot
from hecbench.se3 import Array
from hecbench.system import files

Picture = NDArray[np.uint8]

_CONTOUR_RGB = np.array([1.0, 0.2, 0.1])
_TINT = 0.25
_FRAME_MS = 350


class Overlay:
    """Draws the robot of a recording over its undistorted images.

    Raises:
        InputError: the recording has no robot model, joints, images or intrinsics.
    """

    def __init__(self, recording: Recording) -> None:
        robot, camera, images = PosedRobot.of(recording), recording.camera, recording.images or ()
        if camera is None:
            raise InputError(f"{recording.name}: has no camera")
        self.recording = recording
        self.samples = [i for i in robot.samples.tolist() if i < len(images) and images[i] is not None]
        if not self.samples:
            raise InputError(f"{recording.name}: no sample has both an image and joints")
        self._parent_T_link = robot.link_poses(robot.joints_rad[self.samples])
        self._lens = Undistortion.of(camera)
        self._renderer = Renderer(RenderMesh.of(robot.model), self._lens.K, camera.width, camera.height)

    def draw(self, sample: int, parent_T_camera: Array) -> Picture:
        """One image (H, W, 3) with the robot tinted in its own colours and its contour in red."""
        place = self.samples.index(sample)
        picture = self._lens.image(np.asarray(self.recording.image(sample)))
        self._renderer.draw(se3.inverse(parent_T_camera) @ self._parent_T_link[place])
        drawn = self._renderer.image()
        cover = _TINT * drawn[..., 3:]
        mixed = (1 - cover) * picture + _TINT * drawn[..., :3]
        crossings = self._renderer.crossings
        contour = np.unique(crossings.pixels[(crossings.parts < 0).any(1)])
        mixed.reshape(-1, 3)[contour] = _CONTOUR_RGB
        return np.asarray(np.round(255 * np.clip(mixed, 0, 1)), np.uint8)


def render(recording: Recording, estimate: Estimate, folder: Path) -> list[Path]:
    """Write ``<sample id>.png`` per sample with an image, and the descent where the estimate tells it.

    Returns the files written: the overlays, then ``filmstrip.png`` and ``filmstrip.gif``.
    """
    if estimate.parent_T_camera is None:
        raise InputError(f"{estimate.solver or 'the estimate'}: has no answer to draw: {estimate.reason}")
    overlay = Overlay(recording)
    folder.mkdir(parents=True, exist_ok=True)
    written = []
    for sample in overlay.samples:
        path = folder / f"{files.safe_name(recording.sample_ids[sample])}.png"
        _save([overlay.draw(sample, estimate.parent_T_camera)], path)
        written.append(path)
    if steps := estimate.diagnostics.get("path"):
        frames = film(overlay, steps)
        strip = [np.concatenate([frame[::2, ::2] for frame in row], 1) for row in _rows(frames, 4)]
        _save([np.concatenate(strip)], folder / "filmstrip.png")
        _save(frames, folder / "filmstrip.gif")
        written += [folder / "filmstrip.png", folder / "filmstrip.gif"]
    return written


def film(overlay: Overlay, steps: Sequence[Any], frames: int = 8) -> list[Picture]:
    """The first sample at some `frames` steps of a descent, from the start to the end, denser at first.

    Each step is ``[stage, cost, [phi, rho]]``: parent_T_camera as the logarithm of the transform, rad and m.
    """
    spaced = np.geomspace(1, max(len(steps), 1), frames) - 1
    chosen = np.unique([*np.round(spaced).astype(int), *range(min(frames // 2, len(steps)))])
    return [overlay.draw(overlay.samples[0], se3.exp(np.asarray(steps[i][2], float))) for i in chosen]


def _rows(frames: list[Picture], columns: int) -> list[list[Picture]]:
    blank = np.zeros_like(frames[0])
    padded = frames + [blank] * (-len(frames) % columns)
    return [padded[i : i + columns] for i in range(0, len(padded), columns)]


def _save(frames: list[Picture], path: Path) -> None:
    """A picture, or an animation of several; whole or not at all."""
    from PIL import Image

    pictures = [Image.fromarray(frame) for frame in frames]
    options: dict[str, Any] = {}
    if len(pictures) > 1:
        options = {"save_all": True, "append_images": pictures[1:], "duration": _FRAME_MS, "loop": 0}
    with files.replacing(path) as stream:
        pictures[0].save(stream, format=path.suffix[1:].upper(), **options)
