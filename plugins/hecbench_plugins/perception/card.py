"""What a model's folder says about its weights: `model.json`, read before they are used."""

from __future__ import annotations

import hashlib
from pathlib import Path
from typing import Any, ClassVar, TypeVar

import msgspec
import numpy as np
from numpy.typing import NDArray

from hecbench.errors import InputError, Refusal
from hecbench.system import files
from hecbench_plugins.perception.skeleton import Keypoint

CARD = "model.json"
FORMAT = 1


class NetworkCard(msgspec.Struct, frozen=True, kw_only=True):
    """About one network, whatever it answers.

    Attributes:
        format: of this file.
        robots: that it was trained for.
        weights: file name of the ONNX graph, beside the card.
        sha256: of that file.
        training: how it was made: command, history of settings, steps, hours, pictures, losses at the end.
        figures: what was measured, by name of the data.
    """

    format: int
    robots: tuple[str, ...]
    weights: str
    sha256: str
    training: dict[str, Any] = {}
    figures: dict[str, Any] = {}

    verb: ClassVar[str]
    """Of `hecbench train`, which makes such a network."""

    def require(self, robot: str, subject: str) -> None:
        """Refuse a robot that the network does not know.

        Raises:
            Refusal: naming those that it knows.
        """
        if robot not in self.robots:
            raise Refusal(
                f"{subject}: the robot is {robot}, and the network knows {', '.join(self.robots)}: train one by"
                f" 'hecbench train {self.verb} --robot {robot}'"
            )

    def fault(self) -> str | None:
        """What the card lacks."""
        return None if self.robots else "needs robots"


class ModelCard(NetworkCard, frozen=True, kw_only=True):
    """About a network that sees robots.

    Attributes:
        palette: (1 + C, 3) RGB of its colour classes, the background first.
        keypoints: for each robot.
    """

    palette: tuple[tuple[float, float, float], ...]
    keypoints: dict[str, tuple[Keypoint, ...]]

    verb = "perception"

    @property
    def outputs(self) -> int:
        """Channels of the network's answer."""
        return len(self.palette) + 1 + len(self.keypoints[self.robots[0]])

    def colours(self) -> NDArray[np.float32]:
        """The palette as an array."""
        return np.array(self.palette, np.float32)

    def fault(self) -> str | None:
        """What the card lacks."""
        complete = self.robots and not set(self.robots) - set(self.keypoints)
        return None if complete else "needs robots, and keypoints of each"


Card = TypeVar("Card", bound=NetworkCard)


def write_card(folder: Path, card: NetworkCard) -> None:
    """Write `model.json`."""
    content = msgspec.json.format(msgspec.json.encode(card), indent=1)
    files.write_bytes(folder / CARD, content + b"\n")


def read_card(folder: Path) -> tuple[ModelCard, bytes]:
    """The card of a network that sees robots, and the ONNX graph that it describes; errors as `read_network`'s."""
    return read_network(folder, ModelCard)


def read_network(folder: Path, kind: type[Card]) -> tuple[Card, bytes]:
    """A card of some kind and the ONNX graph that it describes.

    Raises:
        InputError: a file is missing or damaged, or the two do not belong together.
    """
    path = folder / CARD
    try:
        card = msgspec.json.decode(files.read_bytes(path), type=kind)
    except msgspec.DecodeError as error:
        raise InputError(f"{path}: not a model card ({error}); give the folder of a trained model") from None
    if card.format != FORMAT:
        raise InputError(
            f"{path}: format {card.format}, this version reads {FORMAT}: train or fetch the model again"
        )
    if (fault := card.fault()) is not None:
        raise InputError(f"{path}: {fault}; fetch or train the model again")
    weights = files.read_bytes(folder / card.weights)
    if hashlib.sha256(weights).hexdigest() != card.sha256:
        raise InputError(
            f"{folder / card.weights}: not the file that {CARD} describes: fetch or train the model again"
        )
    return card, weights
