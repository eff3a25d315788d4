"""Run a trained translator by OpenCV: the square around the mask is translated and put back on black."""

from __future__ import annotations

import hashlib
from pathlib import Path

import cv2
import msgspec
import numpy as np
from numpy.typing import NDArray

from hecbench.errors import InputError
from hecbench.system import files
from hecbench_plugins.perception.graph import runnable

Picture = NDArray[np.float32]

CARD, WEIGHTS, FORMAT = "model.json", "generator.onnx", 1
_MARGIN = 0.1
"""Of the robot's extent, around it."""


class TranslatorCard(msgspec.Struct, frozen=True, kw_only=True):
    """What is checked of a model's card."""

    format: int
    method: str
    size: int
    sha256: str


class TrainedTranslator:
    """A generator from its folder.

    Raises:
        InputError: the folder's files are missing or damaged, or are of another method.
    """

    def __init__(self, folder: Path, method: str) -> None:
        path = folder / CARD
        try:
            self.card = msgspec.json.decode(files.read_bytes(path), type=TranslatorCard)
        except msgspec.DecodeError as error:
            raise InputError(
                f"{path}: not the card of a translator ({error}); give the folder of a run"
            ) from None
        if self.card.format != FORMAT or self.card.method != method:
            raise InputError(
                f"{path}: a {self.card.method} of format {self.card.format}, not a {method}: train one"
            )
        graph = files.read_bytes(folder / WEIGHTS)
        if hashlib.sha256(graph).hexdigest() != self.card.sha256:
            raise InputError(f"{folder / WEIGHTS}: not the file that {CARD} describes: train it again")
        with runnable(folder / WEIGHTS):
            self._net = cv2.dnn.readNetFromONNX(np.frombuffer(graph, np.uint8))

    def __call__(
        self, image: Picture, mask: Picture, *, part: NDArray[np.int32], colours: NDArray[np.float64]
    ) -> Picture:
        """The translated picture, black where the mask is 0."""
        y, x = np.nonzero(mask > 0)
        out = np.zeros_like(image, np.float32)
        if len(y) == 0:
            return out
        low, high = np.array([x.min(), y.min()]), np.array([x.max(), y.max()])
        side, size = (high - low).max() * (1 + 2 * _MARGIN) + 1, self.card.size
        image_T_square = np.c_[np.eye(2) * side / size, (low + high) / 2 - side / 2]
        cut = np.asarray(image * mask[..., None], np.float32)
        square = _moved(cut, image_T_square, (size, size), cv2.WARP_INVERSE_MAP | cv2.INTER_AREA)
        self._net.setInput(np.ascontiguousarray(2 * square.transpose(2, 0, 1)[None] - 1))
        made = (self._net.forward()[0].transpose(1, 2, 0) + 1) / 2
        back = _moved(
            np.ascontiguousarray(made, np.float32), image_T_square, image.shape[1::-1], cv2.INTER_LINEAR
        )
        return np.asarray(np.clip(back, 0, 1) * mask[..., None], np.float32)


def _moved(picture: Picture, transform: NDArray[np.float64], size: tuple[int, int], flags: int) -> Picture:
    return np.asarray(cv2.warpAffine(picture, transform, size, flags=flags), np.float32)
