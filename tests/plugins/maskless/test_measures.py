"""The measures of the maskless search and refinement by their laws."""

import numpy as np
import pytest
from hecbench_plugins.maskless import contour_kernels, search_kernels
from hecbench_plugins.maskless.ball import Ball
from hecbench_plugins.maskless.contour_buffers import ContourPoints, KnownColours, KnownScene
from hecbench_plugins.maskless.search import minimise

from hecbench import se3

BINS = contour_kernels.BINS**3


def test_mutual_information_of_equal_labels_is_their_entropy():
    counts = np.diag([300.0, 300.0, 300.0])
    bias = 0.5 * 2 * 2
    assert search_kernels.mutual_information(counts) == pytest.approx(900 * np.log(3) - bias, rel=1e-6)


def test_mutual_information_of_independent_labels_is_nothing_on_average(rng):
    found = []
    for _ in range(200):
        labels, colours = rng.integers(0, 4, 2000), rng.integers(0, 8, 2000)
        counts = np.zeros((4, 8))
        np.add.at(counts, (labels, colours), 1)
        found.append(search_kernels.mutual_information(counts))
    assert abs(np.mean(found)) < 0.5


def test_cma_finds_the_bottom_of_a_narrow_valley(rng):
    turn = np.linalg.qr(rng.normal(size=(6, 6)))[0]
    bottom = rng.normal(size=6)
    steepness = np.geomspace(1, 100, 6)

    def cost(x):
        return (steepness * ((x - bottom) @ turn) ** 2).sum(1)

    found, lowest = minimise(cost, np.zeros(6), np.ones(6), rng)
    assert lowest < 1e-2 * cost(np.zeros((1, 6)))[0]
    assert np.linalg.norm(found - bottom) < 0.5


def test_a_pose_in_the_ball_is_as_far_off_as_its_coordinates_say(rng):
    ball, start = Ball(0.2, np.deg2rad(20)), se3.exp(rng.normal(size=6))
    for x in ball.draw(rng, 20):
        shift, turn = ball.away(start, ball.pose(start, x))
        assert shift == pytest.approx(np.linalg.norm(x[:3]) / 0.2)
        assert turn == pytest.approx(np.linalg.norm(x[3:]) / np.deg2rad(20))
        assert max(shift, turn) <= 1.1


def motion(covered, foreground):
    covered = np.asarray(covered, np.uint8)[:, None, None]
    foreground = np.asarray(foreground, np.float32)[:, None, None]
    still = (foreground.max(0) < 0.3).astype(np.float32)
    nowhere = foreground.sum() / len(foreground)
    everywhere = np.zeros(4, np.int32)
    return nowhere + search_kernels.motion_cost(covered, foreground, still, np.ones((1, 1), bool), everywhere)


def test_coverage_that_explains_what_changed_costs_nothing():
    assert motion([1, 0, 0, 0], [1, 0, 0, 0]) == pytest.approx(0)
    assert motion([0, 0, 0, 0], [0, 0, 0, 0]) == pytest.approx(0)


def test_coverage_elsewhere_costs_what_it_leaves_unexplained():
    assert motion([0, 0, 0, 0], [1, 0, 0, 0]) == pytest.approx(1 / 4)
    assert motion([0, 1, 0, 0], [1, 0, 0, 0]) == pytest.approx((1 + 0.7) / 4)


def test_a_pixel_that_every_view_covers_says_next_to_nothing():
    assert motion([1, 1, 1, 1], [0.5, 0.2, 0.4, 0.9]) == pytest.approx(0)
    assert motion([1, 1, 1, 1], [0, 0, 0, 0]) == pytest.approx(0.05)


def test_likelihoods_are_densities_and_lean_on_their_group(rng):
    counts = np.zeros((3, BINS), np.float32)
    counts[0, :100], counts[1, 2000:2100] = 50, 50
    out = np.zeros((3, BINS), np.float32)
    contour_kernels.likelihoods(counts, 0.3, np.array([0, 0, 1]), 50.0, out, np.zeros((4, BINS)))
    density = np.exp(out.astype(float))
    np.testing.assert_allclose(density.sum(1)[:2], 1, rtol=1e-3)
    assert density[0, 50] > density[1, 50] > 10 * density[2, 50]
    assert density[2].max() == pytest.approx(density[2].min())


@pytest.mark.parametrize("offset_px", [-3.0, 0.0, 2.0])
@pytest.mark.parametrize("background_known", [False, True])
def test_a_line_finds_a_displaced_edge(offset_px, background_known):
    height, width, edge = 40, 80, 40
    image = np.full((height, width, 3), 200, np.uint8)
    image[:, : int(edge + offset_px)] = (40, 60, 90)
    face = np.where(np.arange(width) < edge, 0, -1).astype(np.int32) * np.ones((height, 1), np.int32)
    log_inside, log_around = (np.full((1, BINS), np.log(0.03 / BINS), np.float32) for _ in range(2))
    log_inside[0, contour_kernels.colour_bin(image, 0, 0)] = np.log(0.97)
    log_around[0, contour_kernels.colour_bin(image, 0, width - 1)] = np.log(0.97)
    points = ContourPoints.of(1)
    points.place[0], points.parts[0] = (edge - 0.5, 20.0, 1.0, 0.0), (0, -1)
    rows = height if background_known else 0
    scene = KnownScene(
        valid=np.ones((height, width), bool),
        background=np.full((rows, width, 3), 200, np.uint8),
        agreement=np.ones((rows, width), np.float32),
        covered=np.zeros((height, width), np.int16),
        views=4,
    )
    colours = KnownColours(log_inside, log_around, np.exp(log_around).mean(0))
    contour_kernels.line_posteriors(
        points, 1, face, np.zeros(1, np.int32), image, image, colours, scene, 8, 1.0
    )
    mean, variance = points.mean, points.variance
    assert mean[0] == pytest.approx(offset_px, abs=0.3)
    assert 0 < variance[0] < 1
