"""A trained network from its folder: what it sees, and what is refused."""

import hashlib

import msgspec
import numpy as np
import pytest
from hecbench_plugins.networks.ur import WEIGHTS
from hecbench_plugins.perception.card import CARD, ModelCard, read_card, write_card
from hecbench_plugins.perception.family import Family
from hecbench_plugins.perception.model import PerceptionModel
from hecbench_plugins.perception.pictures import PictureMaker

from hecbench.conformance.photographs import photographs
from hecbench.errors import InputError, Refusal

EMPTY_PICTURES = 20


@pytest.fixture
def folder(tmp_path):
    """A copy of the shipped network that may be spoiled."""
    card, weights = read_card(WEIGHTS)
    (tmp_path / card.weights).write_bytes(weights)
    write_card(tmp_path, card)
    return tmp_path


def spoil(folder, weights=None, **changes):
    """Put other weights or facts in, with a right checksum."""
    card, old = read_card(folder)
    content = old if weights is None else weights(old)
    (folder / card.weights).write_bytes(content)
    write_card(folder, msgspec.structs.replace(card, sha256=hashlib.sha256(content).hexdigest(), **changes))


def test_masks_of_drawn_robots_are_right(network):
    maker, overlaps = PictureMaker(Family.of(["ur5e", "ur3e"]), 224, 99), []
    while len(overlaps) < 10:
        example = maker.example()
        truth = np.kron(example.shares[..., -1] > 127, np.ones((2, 2), bool))
        if truth.mean() > 0.05:
            found = network.see(example.image).visible() > 0.5
            overlaps.append((found & truth).sum() / (found | truth).sum())
    assert np.median(overlaps) > 0.85


def test_pictures_without_a_robot_have_empty_masks(network):
    maker = PictureMaker(Family.of(["ur5e"]), 224, 7)
    pictures = [np.rint(255 * maker._background(448)).astype(np.uint8) for _ in range(EMPTY_PICTURES)]
    seen = [network.see(picture) for picture in pictures]
    hallucinated = [n for n, sight in enumerate(seen) if (sight.visible() > 0.5).any() or sight.whole().any()]
    assert not hallucinated


def test_photographs_without_this_robot_have_empty_masks(network, shared):
    cv2 = pytest.importorskip("cv2")
    folders = ("apriltag_photos", "industrial_10x10", "pupil_tags", "visp_franka")
    paths = [p for name in folders for p in sorted((shared / "data" / name).rglob("*.[jp][pn]*g"))]
    images = [image for path in paths if (image := cv2.imread(str(path))) is not None][-EMPTY_PICTURES:]
    assert len(images) == EMPTY_PICTURES
    seen = [(network.see(np.ascontiguousarray(image[..., ::-1])).visible() > 0.5).any() for image in images]
    assert sum(seen) == 0


def test_the_mask_moves_with_the_robot(network):
    recording = photographs()
    for sample in range(len(recording)):
        image, truth = recording.image(sample), recording.mask(sample)
        height, width = truth.shape
        wide = np.pad(image, ((40, 8), (10, 60), (0, 0)), mode="edge")
        inside = network.see(wide).visible()[40 : 40 + height, 10 : 10 + width] > 0.5
        alone = network.see(image).visible() > 0.5
        assert (inside & alone).sum() > 0.9 * (inside | alone).sum()
        assert (inside & truth).sum() > 0.85 * (inside | truth).sum()


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda folder: (folder / CARD).unlink(), "does not exist"),
        (lambda folder: (folder / CARD).write_text("{"), "not a model card"),
        (lambda folder: (folder / CARD).write_text('{"format": 1}'), "not a model card"),
        (lambda folder: (folder / "perception.onnx").unlink(), "does not exist"),
        (lambda folder: (folder / "perception.onnx").write_bytes(b"\x00" * 100), "not the file that"),
        (lambda folder: spoil(folder, lambda old: old[: len(old) // 2]), "cannot run this graph"),
        (lambda folder: spoil(folder, lambda old: b"not a graph"), "cannot run this graph"),
        (lambda folder: spoil(folder, format=2), "format 2"),
        (lambda folder: spoil(folder, robots=("ur16e",)), "keypoints of each"),
        (lambda folder: spoil(folder, palette=((0.0, 0.0, 0.0), (1.0, 1.0, 1.0))), "its card wants"),
    ],
)
def test_damaged_models_are_one_line(folder, change, message):
    change(folder)
    with pytest.raises(InputError, match=message) as refused:
        PerceptionModel(folder)
    assert "\n" not in str(refused.value)
    assert str(folder) in str(refused.value)


@pytest.mark.parametrize("shape", [(480, 640), (480, 640, 4), (16, 640, 3)])
def test_other_pictures_are_refused(network, shape):
    with pytest.raises(InputError, match="32 x 32 px RGB"):
        network.see(np.zeros(shape, np.uint8))


def test_another_robot_is_refused(network):
    with pytest.raises(Refusal, match="knows ur5e, ur3e"):
        network.keypoint_positions("vs060", ("base",), np.eye(4)[None])


def test_the_card_says_how_the_weights_were_made():
    card, weights = read_card(WEIGHTS)
    assert isinstance(card, ModelCard)
    assert len(weights) < 6e6
    assert {"command", "seed", "hours", "steps", "pictures"} <= set(card.training)
    assert card.figures
    assert (WEIGHTS / "README.md").is_file()
