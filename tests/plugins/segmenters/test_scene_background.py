"""The background of a fixed camera, and what is unlike it."""

from __future__ import annotations

import numpy as np
import pytest
from hecbench_plugins.views.scene_background import SAME_COLOUR, background, foreground

from hecbench.errors import InputError


def _crossing_scene(views: int, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A textured wall before which a square stands elsewhere in every view: pictures, wall, where the square is."""
    wall = np.kron(rng.integers(40, 200, (12, 16, 3)), np.ones((5, 5, 1)))
    pictures = np.repeat(wall[None], views, 0) + rng.normal(0, 2, (views, *wall.shape))
    moved = np.zeros(pictures.shape[:3], bool)
    for view in range(views):
        moved[view, 20:40, 12 * view : 12 * view + 10] = True
    pictures[moved] = (255, 20, 255)
    return np.clip(pictures.round(), 0, 255).astype(np.uint8), wall, moved


def test_the_mode_is_the_brute_force_one(rng: np.random.Generator) -> None:
    images = rng.integers(0, 60, (7, 9, 11, 3)).astype(np.uint8)
    scene, agree = background(images)
    wide = images.astype(int)
    alike = np.abs(wide[:, None] - wide[None]).max(-1) < SAME_COLOUR
    chosen = alike.sum(1).argmax(0)
    of_chosen = np.take_along_axis(alike, chosen[None, None], 0)[0]
    mean = (wide * of_chosen[..., None]).sum(0) / of_chosen.sum(0)[..., None]
    np.testing.assert_allclose(scene, mean, atol=1e-4)
    np.testing.assert_allclose(agree, alike.sum(1).max(0) / 7, atol=1e-6)


def test_what_moves_is_not_background(rng: np.random.Generator) -> None:
    images, wall, moved = _crossing_scene(6, rng)
    scene, agree = background(images)
    assert np.abs(scene - wall).max() < 8
    assert agree[50:].min() == 1
    assert agree[30, 5] == pytest.approx(5 / 6)
    unlike = foreground(images, scene)
    inside = np.zeros_like(moved)
    inside[:, 23:37] = moved[:, 23:37]
    inside &= np.roll(moved, 3, 2) & np.roll(moved, -3, 2)
    assert unlike[inside].min() > 0.9
    assert unlike[:, 50:].max() < 0.2


@pytest.mark.parametrize(
    ("images", "named"),
    [
        (np.zeros((2, 4, 4, 3), np.uint8), "2 views"),
        (np.zeros((5, 4, 4, 3)), "float64"),
        (np.zeros((5, 4, 4), np.uint8), "(5, 4, 4)"),
    ],
)
def test_bad_input_is_named(images: np.ndarray, named: str) -> None:
    with pytest.raises(InputError) as error:
        background(images)
    assert named in str(error.value)
