"""What a training run leaves: a model's folder with weights, card, curve and sample pictures."""

from __future__ import annotations

import csv
import hashlib
import io
import shlex
import sys
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hecbench.system import files
from hecbench_plugins.perception.card import FORMAT, ModelCard, write_card
from hecbench_plugins.perception.card_text import write_page
from hecbench_plugins.perception.model import PerceptionModel
from hecbench_plugins.perception.onnx_export import to_onnx
from hecbench_plugins.perception.pictures import PictureMaker
from hecbench_plugins.perception.run import Run
from hecbench_plugins.perception.training import Training

WEIGHTS, CURVE, SAMPLES = "perception.onnx", "curve.csv", "samples.png"
SAMPLE_SEED, _SAMPLE_ROWS, _SAMPLE_COLUMNS = 4711, 4, 4
"""The sample pictures are drawn with a seed of their own: the network was not trained on them."""


def write_model(training: Training) -> Path:
    """Write `training.plan.out`/model and return it."""
    folder, family = training.plan.out / "model", training.family
    weights = to_onnx(training.averaged_network())
    files.write_bytes(folder / WEIGHTS, weights)
    card = ModelCard(
        format=FORMAT,
        robots=family.names,
        palette=tuple((float(r), float(g), float(b)) for r, g, b in family.palette),
        keypoints={arm.model.name: arm.keypoints for arm in family.arms},
        weights=WEIGHTS,
        sha256=hashlib.sha256(weights).hexdigest(),
        training=facts(training),
    )
    write_card(folder, card)
    write_page(folder, card)
    write_curve(folder, training)
    _write_samples(folder, PictureMaker(family, training.plan.size, SAMPLE_SEED, training.plan.backgrounds))
    return folder


def facts(training: Run) -> dict[str, Any]:
    """How a network was made, for its card."""
    progress = training.progress
    losses = progress.curve[-1][2:] if progress.curve else []
    return {
        "command": shlex.join(["hecbench", *sys.argv[1:]]),
        "date": datetime.now(UTC).date().isoformat(),
        "settings": list(dict.fromkeys(progress.history)),
        "seed": progress.seed,
        "hours": round(progress.seconds / 3600, 2),
        "steps": progress.step,
        "pictures": progress.drawn,
        "losses": dict(zip(training.term_names, losses, strict=False)),
    }


def write_curve(folder: Path, training: Run) -> None:
    """The losses over time as a table and as a picture."""
    from matplotlib.figure import Figure

    curve, names = training.progress.curve, training.term_names
    table = io.StringIO()
    csv.writer(table).writerows([["seconds", "steps", *names], *curve])
    files.write_text(folder / CURVE, table.getvalue())
    if not curve:
        return
    figure = Figure(figsize=(8, 2.4), layout="constrained")
    rows = np.array(curve)
    for axes, name, values in zip(figure.subplots(1, len(names)), names, rows.T[2:], strict=True):
        axes.plot(rows[:, 0] / 60, values)
        axes.set(title=name, xlabel="min")
    content = io.BytesIO()
    figure.savefig(content, format="png", dpi=100)
    files.write_bytes(folder / "curve.png", content.getvalue())


def _write_samples(folder: Path, maker: PictureMaker) -> None:
    """New training pictures beside what the model sees in them: its mask's outline and its colours."""
    import cv2

    model = PerceptionModel(folder)
    rows = []
    for _ in range(_SAMPLE_ROWS):
        tiles = []
        for _ in range(_SAMPLE_COLUMNS):
            sight = model.see(maker.example().image)
            outlined = np.ascontiguousarray(sight.image.copy())
            mask = (sight.visible() > 0.5).astype(np.uint8)
            outlines, _ = cv2.findContours(mask, cv2.RETR_LIST, cv2.CHAIN_APPROX_NONE)
            cv2.drawContours(outlined, outlines, -1, (0, 255, 0), 1)
            tiles += [outlined, _bytes(sight.colours() * sight.whole()[..., None])]
        rows.append(np.hstack(tiles))
    write_picture(folder / SAMPLES, np.vstack(rows))


def write_picture(path: Path, picture: NDArray[np.uint8]) -> None:
    """Write a picture (H, W, 3) RGB as PNG."""
    import cv2

    ok, content = cv2.imencode(".png", picture[..., ::-1])
    assert ok
    files.write_bytes(path, content.tobytes())


def _bytes(picture: NDArray[np.float32]) -> NDArray[np.uint8]:
    return np.asarray(np.rint(np.clip(picture, 0, 1) * 255), np.uint8)
