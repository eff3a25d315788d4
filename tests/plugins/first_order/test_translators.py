"""What translators promise: identity changes nothing on the robot, part_colours takes back light."""

import numpy as np
import pytest
from hecbench_plugins.first_order.simlike import cut_out
from hecbench_plugins.views.pyramid import prepare

from hecbench import registry, se3
from hecbench.specs import Kind, TranslatorSpec


@pytest.fixture(scope="module")
def drawn(exact):
    """A picture, its mask, its parts and their colours, at the true pose."""
    view = prepare(exact)[1][0]
    renderer = view.levels[1].renderer
    renderer.draw(se3.inverse(exact.truth_parent_T_camera) @ view.parent_T_link)
    image, mask = cut_out(view)
    return image, mask, renderer.part, renderer.mesh.colours


def translate(name, image, mask, part, colours):
    spec = registry.load().get(Kind.TRANSLATOR, name, TranslatorSpec)
    return spec.factory()(image, mask, part=part, colours=colours)


def test_identity_is_the_picture_cut_out(drawn):
    image, _, part, colours = drawn
    np.testing.assert_array_equal(
        translate("identity", image, np.ones(part.shape, np.float32), part, colours), image
    )
    cut = translate("identity", image + np.float32(0.1), np.float32(part >= 0), part, colours)
    np.testing.assert_array_equal(cut[part < 0], 0)
    np.testing.assert_allclose(cut[part >= 0], image[part >= 0] + 0.1, atol=1e-6)


def test_before_black_the_soft_edge_is_kept(drawn):
    image, mask, _, _ = drawn
    np.testing.assert_array_equal(image * mask[..., None], image)


@pytest.mark.parametrize("gain", [0.6, 1.0, 1.3])
def test_part_colours_takes_back_a_gain(drawn, gain):
    image, mask, part, colours = drawn
    bright = np.clip(gain * image, 0, 1.0)
    off = np.abs(translate("part_colours", bright, mask, part, colours) - image)
    unclipped = (gain * image).max(-1) < 1
    assert np.median(off[(part >= 0) & unclipped]) < 0.005
    assert off[unclipped].mean() < 0.002


def test_part_colours_takes_back_a_light_of_each_part(drawn, rng):
    image, mask, part, colours = drawn
    gains = rng.uniform(0.5, 0.9, len(colours))
    lit = np.where((part >= 0)[..., None], gains[part, None] * image, image).astype(np.float32)
    before, after = np.abs(lit - image), np.abs(translate("part_colours", lit, mask, part, colours) - image)
    assert after.mean() < 0.2 * before.mean()


def test_part_colours_does_not_paint_a_wrong_pose_right(drawn):
    """With the parts drawn 40 px to the side the picture stays itself, instead of becoming the drawing."""
    image, mask, part, colours = drawn
    shifted = np.roll(part, 40, axis=1)
    translated = translate("part_colours", image, mask, shifted, colours)
    drawing = np.where((shifted >= 0)[..., None], colours[shifted], 0)
    assert np.abs(translated - image).mean() < 0.5 * np.abs(translated - drawing).mean()


def test_without_a_drawn_robot_the_picture_is_cut_out_only(drawn):
    image, mask, part, colours = drawn
    nothing = np.full_like(part, -1)
    np.testing.assert_array_equal(
        translate("part_colours", image, mask, nothing, colours), image * mask[..., None]
    )
