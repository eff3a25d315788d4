"""Robot masks by a network that was trained on drawn pictures of the robot; no start or background is needed."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from hecbench.errors import Refusal
from hecbench.recording import Recording
from hecbench.registry import hookimpl
from hecbench.specs import SegmenterSpec
from hecbench_plugins.perception.options import MODEL_OPTION

_ROBOT = 0.5


@dataclass(frozen=True)
class Learned:
    """The segmenter. `model` names a perception plugin or a folder; None: one that knows the robot."""

    model: str | None = None

    def __call__(self, recording: Recording) -> Recording:
        """The recording with a mask for every image; an empty one, and a note, where the network sees no robot.

        The network knows arms without tools: the robot of the recording becomes that.

        Raises:
            Refusal: there are no images, no network for the robot, or no robot in any image.
        """
        from hecbench_plugins.perception.choice import perceiver_for, robot_of

        samples = [i for i, source in enumerate(recording.images or ()) if source is not None]
        if not samples:
            raise Refusal(f"{recording.name}: has no images to find the robot in")
        perceiver = perceiver_for(recording, self.model)
        masks: list[NDArray[np.uint8] | None] = [None] * len(recording)
        empty = []
        for i in samples:
            found = perceiver.see(recording.image(i)).visible() > _ROBOT
            masks[i] = np.where(found, np.uint8(255), np.uint8(0))
            if not found.any():
                empty.append(recording.sample_ids[i])
        if len(empty) == len(samples):
            raise Refusal(
                f"{recording.name}: no robot is seen in any of the {len(samples)} images: another robot, or a camera"
                " that looks elsewhere?"
            )
        notes, robot = recording.notes, recording.present.robot
        if robot.model is not None and (arm := robot_of(recording)) != robot.model:
            robot = replace(robot, model=arm)
            notes = (*notes, f"masks: of the arm without its tool; the robot is taken as {arm}")
        if empty:
            notes = (
                *notes,
                f"masks: no robot is seen in {len(empty)} of {len(samples)} images: {', '.join(empty)}",
            )
        return replace(recording, masks=tuple(masks), robot=robot, notes=notes)


@hookimpl
def hecbench_segmenters() -> Iterable[SegmenterSpec]:
    """This file's segmenter."""
    yield SegmenterSpec(
        name="learned",
        summary="a network trained on drawn pictures of the robot; needs images alone",
        factory=Learned,
        options=(MODEL_OPTION,),
    )
