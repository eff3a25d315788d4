"""Robot masks by Segment Anything (Kirillov et al. 2023), prompted by the robot drawn at the start.

The weights are the user's: an encoder and a decoder as ONNX graphs, in the form of the authors' own export. They were
not at hand when this was written: the adapter is tested with stand-in graphs of the same inputs and outputs.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field, replace
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hecbench.errors import InputError, Refusal
from hecbench.recording import Recording
from hecbench.registry import hookimpl
from hecbench.se3 import Array
from hecbench.specs import Need, Option, SegmenterSpec
from hecbench_plugins.views.uncertainty import Uncertainty

Floats = NDArray[np.float32]
Mask = NDArray[np.bool_]

_SIDE_PX, _LOW_RES_PX = 1024, 256
"""Of the encoder's square picture and of the decoder's mask prompt."""
_MEAN, _DEVIATION = (123.675, 116.28, 103.53), (58.395, 57.12, 57.375)
"""Of the pictures that the authors trained on, RGB of 255."""
_LOGIT = 6.0
"""Of the drawn robot in the mask prompt."""
_INSIDE, _OUTSIDE = 8, 8
"""Points on the drawn robot, and where no start draws it."""
_BACKGROUND, _FOREGROUND, _TOP_LEFT, _BOTTOM_RIGHT = 0, 1, 2, 3
"""The decoder's labels of points."""
_NEEDS = {Need.INITIAL, Need.ROBOT_MODEL, Need.JOINTS, Need.INTRINSICS, Need.IMAGES}
_DECODER_INPUTS = (
    "image_embeddings",
    "point_coords",
    "point_labels",
    "mask_input",
    "has_mask_input",
    "orig_im_size",
)


@dataclass(frozen=True)
class SegmentAnything:
    """The segmenter. `encoder` and `decoder` are ONNX files; `uncertainty` is that of the start."""

    encoder: str | None = None
    decoder: str | None = None
    uncertainty: Uncertainty = field(default_factory=Uncertainty)

    def __call__(self, recording: Recording) -> Recording:
        """The recording with a mask for every image with joints.

        Raises:
            InputError: a graph is not given, is not readable, or has other inputs.
            Refusal: the recording lacks a start or something else that draws the robot.
        """
        if self.encoder is None or self.decoder is None:
            raise InputError("segmenter 'sam': give both graphs, sam[encoder=FILE.onnx,decoder=FILE.onnx]")
        if missing := _NEEDS - recording.offers():
            raise Refusal(f"{recording.name}: sam needs {', '.join(sorted(missing))}")
        from hecbench_plugins.views.silhouettes import Silhouettes

        encoder, decoder = _session(Path(self.encoder)), _session(Path(self.decoder), _DECODER_INPUTS)
        silhouettes = Silhouettes(recording)
        starts = self.uncertainty.around(recording.present.initial_parent_T_camera)
        masks: list[NDArray[np.uint8] | None] = [None] * len(recording)
        for sample in silhouettes.samples.tolist():
            if recording.images is None or recording.images[sample] is None:
                continue
            drawn, reach = silhouettes.draw(sample, starts[0]), silhouettes.reach(sample, starts)
            if not drawn.any():
                raise Refusal(f"{recording.name}: samples[{sample}]: at the start the robot is out of sight")
            found = _mask(encoder, decoder, recording.image(sample), drawn, reach)
            masks[sample] = np.where(found & reach, np.uint8(255), np.uint8(0))
        note = "masks: Segment Anything about the robot drawn at the start"
        return replace(recording, masks=tuple(masks), notes=(*recording.notes, note))


def _mask(encoder: Any, decoder: Any, image: NDArray[np.uint8], drawn: Mask, reach: Mask) -> Mask:
    """Where the robot is in an image (H, W, 3), prompted by where it is `drawn` and may `reach` (H, W)."""
    scale = _SIDE_PX / max(image.shape[:2])
    points, labels = _points(drawn, reach)
    (embedding,) = encoder.run(None, {encoder.get_inputs()[0].name: _squared(image, scale)})
    given = {
        "image_embeddings": embedding,
        "point_coords": (points * scale)[None].astype(np.float32),
        "point_labels": labels[None].astype(np.float32),
        "mask_input": _low_res(drawn, scale),
        "has_mask_input": np.ones(1, np.float32),
        "orig_im_size": np.array(image.shape[:2], np.float32),
    }
    masks, scores = decoder.run(["masks", "iou_predictions"], given)
    return np.asarray(masks[0, int(scores[0].argmax())] > 0)


def _squared(image: NDArray[np.uint8], scale: float) -> Floats:
    """(1, 3, 1024, 1024): the image shrunk, normalised, and filled up at the right or below."""
    import cv2

    height, width = (round(side * scale) for side in image.shape[:2])
    small = cv2.resize(
        image, (width, height), interpolation=cv2.INTER_AREA if scale < 1 else cv2.INTER_LINEAR
    )
    out = np.zeros((1, 3, _SIDE_PX, _SIDE_PX), np.float32)
    out[0, :, :height, :width] = ((small - np.array(_MEAN)) / _DEVIATION).transpose(2, 0, 1)
    return out


def _low_res(drawn: Mask, scale: float) -> Floats:
    """(1, 1, 256, 256) logits of the drawn robot, placed as the image is in the encoder's square."""
    import cv2

    shrink = scale * _LOW_RES_PX / _SIDE_PX
    height, width = (round(side * shrink) for side in drawn.shape)
    out = np.full((1, 1, _LOW_RES_PX, _LOW_RES_PX), -_LOGIT, np.float32)
    share = cv2.resize(drawn.astype(np.float32), (width, height), interpolation=cv2.INTER_AREA)
    out[0, 0, :height, :width] = _LOGIT * (2 * share - 1)
    return out


def _points(drawn: Mask, reach: Mask) -> tuple[Array, NDArray[np.int64]]:
    """Points (P, 2) px, x first, and their labels (P,): on the robot, beyond its reach, and the corners of its box."""
    inside, outside = _deepest(drawn, _INSIDE), _deepest(~reach, _OUTSIDE)
    y, x = np.nonzero(reach)
    box = np.array([[x.min(), y.min()], [x.max(), y.max()]], float)
    labels = [_FOREGROUND] * len(inside) + [_BACKGROUND] * len(outside) + [_TOP_LEFT, _BOTTOM_RIGHT]
    return np.vstack([inside, outside, box]), np.array(labels)


def _deepest(mask: Mask, count: int) -> Array:
    """Up to `count` pixels (N, 2) in the middle of a mask's thick parts, apart from each other."""
    import cv2

    depth = cv2.distanceTransform(np.pad(mask, 1).astype(np.uint8), cv2.DIST_L2, 5)[1:-1, 1:-1]
    found: list[tuple[float, float]] = []
    while len(found) < count and depth.max() >= 1:
        y, x = np.unravel_index(depth.argmax(), depth.shape)
        found.append((float(x), float(y)))
        cv2.circle(depth, (int(x), int(y)), round(2 * float(depth[y, x])), 0.0, -1)
    return np.array(found).reshape(-1, 2)


@lru_cache(maxsize=4)
def _session(path: Path, inputs: tuple[str, ...] = ()) -> Any:
    """A graph ready to run.

    Raises:
        InputError: it is missing, damaged, or lacks one of the inputs.
    """
    import onnxruntime

    if not path.is_file():
        raise InputError(f"{path}: does not exist; give the ONNX file of Segment Anything")
    try:
        session = onnxruntime.InferenceSession(str(path), providers=["CPUExecutionProvider"])
    except Exception as error:  # the library's exceptions have no common base
        raise InputError(
            f"{path}: not an ONNX graph that can be run: {str(error).splitlines()[0][:160]}"
        ) from None
    has = [value.name for value in session.get_inputs()]
    if absent := [name for name in inputs if name not in has]:
        raise InputError(
            f"{path}: has no input '{absent[0]}' but {', '.join(has)}: give the authors' decoder"
        )
    return session


@hookimpl
def hecbench_segmenters() -> Iterable[SegmenterSpec]:
    """This file's segmenter."""
    yield SegmenterSpec(
        name="sam",
        summary="Segment Anything about the robot drawn at the start; its weights are given as ONNX files",
        imports=("onnxruntime",),
        factory=SegmentAnything,
        options=(
            Option("encoder", str, "ONNX file of the image encoder"),
            Option("decoder", str, "ONNX file of the prompt encoder and mask decoder"),
        ),
    )
