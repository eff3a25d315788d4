"""Robot masks by GrabCut, seeded with the robot drawn at the start.

Rother, Kolmogorov and Blake 2004, "GrabCut"; OpenCV's implementation. Wherever a start within the given uncertainty
would draw the robot it may be; what is farther than that is background for sure.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from hecbench.errors import Refusal
from hecbench.recording import Recording
from hecbench.registry import hookimpl
from hecbench.specs import Need, SegmenterSpec
from hecbench_plugins.views.uncertainty import Uncertainty

if TYPE_CHECKING:
    from hecbench_plugins.views.silhouettes import Silhouettes

_SHRINK = 2
"""Pixels of the image per pixel of the segmentation."""
_FEWEST_PIXELS = 50


@dataclass(frozen=True)
class GrabCut:
    """The segmenter.

    Attributes:
        uncertainty: of the start; outside all that starts within it draw there is background for sure.
        rounds: of GrabCut.
    """

    uncertainty: Uncertainty = field(default_factory=Uncertainty)
    rounds: int = 5

    def __call__(self, recording: Recording) -> Recording:
        """The recording with a mask for every image with joints.

        Raises:
            Refusal: no start, no images, or the robot is out of sight at the start.
        """
        from hecbench_plugins.views.silhouettes import Silhouettes

        needed = {Need.INITIAL, Need.ROBOT_MODEL, Need.JOINTS, Need.INTRINSICS, Need.IMAGES}
        if missing := needed - recording.offers():
            raise Refusal(f"{recording.name}: grabcut needs {', '.join(sorted(missing))}")
        silhouettes = Silhouettes(recording, _SHRINK)
        starts = self.uncertainty.around(recording.present.initial_parent_T_camera)
        masks: list[NDArray[np.uint8] | None] = [None] * len(recording)
        for sample in silhouettes.samples.tolist():
            if recording.images is not None and recording.images[sample] is not None:
                masks[sample] = self._mask(recording, sample, silhouettes, starts)
        note = "masks: GrabCut about the robot drawn at the start; they are no better than the start"
        return replace(recording, masks=tuple(masks), notes=(*recording.notes, note))

    def _mask(
        self, recording: Recording, sample: int, silhouettes: Silhouettes, starts: list[NDArray[np.float64]]
    ) -> NDArray[np.uint8]:
        import cv2

        drawn = silhouettes.draw(sample, starts[0])
        if drawn.sum() < _FEWEST_PIXELS:
            raise Refusal(f"{recording.name}: samples[{sample}]: at the start the robot is out of sight")
        labels = np.full(drawn.shape, cv2.GC_BGD, np.uint8)
        labels[silhouettes.reach(sample, starts)] = cv2.GC_PR_BGD
        labels[drawn] = cv2.GC_PR_FGD
        image = recording.image(sample)
        small = cv2.resize(image, labels.shape[::-1], interpolation=cv2.INTER_AREA)
        cv2.setRNGSeed(0)
        cv2.grabCut(
            np.ascontiguousarray(small[..., ::-1]),
            labels,
            None,
            np.zeros((1, 65)),
            np.zeros((1, 65)),
            self.rounds,
            cv2.GC_INIT_WITH_MASK,
        )
        robot = np.isin(labels, (cv2.GC_FGD, cv2.GC_PR_FGD)).astype(np.uint8) * np.uint8(255)
        return np.asarray(cv2.resize(robot, image.shape[1::-1], interpolation=cv2.INTER_LINEAR))


@hookimpl
def hecbench_segmenters() -> Iterable[SegmenterSpec]:
    """This file's segmenter."""
    yield SegmenterSpec(
        name="grabcut", summary="GrabCut about the robot drawn at the recording's start", factory=GrabCut
    )
