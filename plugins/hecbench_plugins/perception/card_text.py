"""A model card as a page (Mitchell et al. 2019): what the network is for, how it was made, what was measured."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from textwrap import wrap
from typing import Any

from hecbench.system import files
from hecbench_plugins.perception.card import NetworkCard

PAGE = "README.md"
_WIDTH = 110


@dataclass(frozen=True)
class Words:
    """What a page says about every network of a kind.

    Attributes:
        purpose: what it answers, and to whom.
        limits: where it fails.
    """

    purpose: str
    limits: tuple[str, ...]


PERCEPTION = Words(
    "Finds the robot in photographs: where it is visible, its whole outline, the colours of its model, and keypoints"
    " of its skeleton. Used by the segmenter and the translator `learned` and by the solver `keypoints`.",
    (
        "The settings around it (sizes of the passes, thresholds) were chosen while looking at the recordings of the"
        " figures: these are figures of development, not of a test.",
        "It was trained on drawn pictures alone. A robot with a cover, a dress pack or other colours may be seen in"
        " part.",
        "What a robot holds (a board, a gripper) is not robot. What lies behind it is guessed poorly.",
        "Pictures in which the robot takes less than about 2 % are often seen as pictures without a robot.",
        "Grey machines, tripods and other arms are sometimes taken for the robot where there is none, and then with a"
        " low confidence.",
        "Keypoints of the wrist are found less often than those of base, shoulder and elbow.",
    ),
)


def write_page(folder: Path, card: NetworkCard, words: Words = PERCEPTION) -> None:
    """Write the page beside the card."""
    files.write_text(folder / PAGE, "\n".join(_lines(card, words)) + "\n")


def _lines(card: NetworkCard, words: Words) -> Iterator[str]:
    yield f"# Network for {' and '.join(card.robots)}"
    yield ""
    yield from wrap(f"{words.purpose} The weights are an ONNX graph with halves, which OpenCV runs.", _WIDTH)
    yield ""
    yield "## Training"
    yield ""
    yield from wrap(
        f"Data: pictures drawn at random by `hecbench train {card.verb}`; no photograph of a robot. Photographs that"
        " other packages bring along stand behind some of the robots. Licence of the weights: that of hecbench.",
        _WIDTH,
    )
    yield ""
    for name, value in card.training.items():
        yield from _fact(name, value)
    yield ""
    yield "## Figures"
    yield ""
    if not card.figures:
        yield "None were measured."
    for name, figures in card.figures.items():
        yield f"- {name}: {_figures(figures)}"
    yield ""
    yield "## Limits"
    yield ""
    for limit in words.limits:
        yield f"- {limit}"


def _fact(name: str, value: Any) -> Iterator[str]:
    if isinstance(value, list):
        yield f"- {name}:"
        yield from (f"  - {item}" for item in value)
    elif isinstance(value, dict):
        yield f"- {name}: {', '.join(f'{key} {number}' for key, number in value.items())}"
    else:
        yield f"- {name}: `{value}`" if name == "command" else f"- {name}: {value}"


def _figures(figures: dict[str, Any]) -> str:
    """Numbers in the order in which they were measured; the command last."""
    parts = []
    for name, value in figures.items():
        if isinstance(value, dict):
            parts.append(f"{name} ({_figures(value)})")
        elif isinstance(value, list):
            parts.append(f"{name.replace('_', ' ')} {value[0]} to {value[1]}")
        elif name == "command":
            parts.append(f"by `{value}`")
        else:
            parts.append(f"{name.replace('_', ' ')} {value}")
    return ", ".join(parts)
