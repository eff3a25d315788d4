"""Where the robot may be, at low resolution: which pixels changed, and which colours go with which materials.

Two measures of a pose, neither with a prior of the robot's colours. Motion consistency, for a fixed camera and three
views or more: pixels covered in some views must differ from the background there and nowhere else. Mutual information
(Viola and Wells 1997) of the drawn material and the pixel's colour, less its bias (Miller 1955). Both are searched
within the start's uncertainty by random draws and then CMA-ES (Hansen 2016, "The CMA evolution strategy: a tutorial")
from the best draws that are far from each other.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
from numpy.typing import NDArray

from hecbench import se3
from hecbench.rendering import Renderer, RenderMesh
from hecbench.rendering.undistort import shrunk_intrinsics
from hecbench.se3 import Array
from hecbench.system import threads
from hecbench_plugins.maskless import search_kernels
from hecbench_plugins.maskless.ball import Ball
from hecbench_plugins.maskless.settings import SEARCH, SearchSettings
from hecbench_plugins.views.canvas import Canvas


class Score:
    """The cost of poses, px-like per view; smaller is better. One renderer per view and thread."""

    def __init__(
        self,
        mesh: RenderMesh,
        canvas: Canvas,
        foreground: NDArray[np.float32] | None,
        rng: np.random.Generator,
    ) -> None:
        """`foreground` (N, H, W): how much each pixel of the canvas differs from the background, None if unknown."""
        import cv2

        height = round(SEARCH.width_px * canvas.valid.shape[0] / canvas.valid.shape[1])
        size = (SEARCH.width_px, height)
        factors = size[0] / canvas.valid.shape[1], size[1] / canvas.valid.shape[0]
        self._size, self._canvas = size, canvas
        self.evaluations = 0
        self.has_motion = foreground is not None

        def small(picture: NDArray[np.generic]) -> NDArray[np.float32]:
            return np.asarray(cv2.resize(picture, size, interpolation=cv2.INTER_AREA), np.float32)

        self._valid = small(canvas.valid.astype(np.float32)) > 0.9
        self._foreground = np.zeros((0, *self._valid.shape), np.float32)
        if foreground is not None:
            self._foreground = np.stack([small(view) for view in foreground])
        self._still = (self._foreground.max(0, initial=0.0) < SEARCH.still).astype(np.float32)
        self._colour = _clustered([small(image) for image in canvas.images], self._valid, rng)
        self._limit_to(np.repeat(self._valid[None], len(canvas), 0))
        _, material = np.unique(mesh.colours.round(3), axis=0, return_inverse=True)
        self._materials = int(material.max()) + 1
        self._face_material = material.reshape(-1)[mesh.face_part].astype(np.int32)
        K = shrunk_intrinsics(canvas.K, *factors)
        self._renderers = [Renderer(mesh, K, *size) for _ in range(threads.count())]

    def limit_region(self, camera_T_parents: Array) -> None:
        """Count mutual information only where some of these poses (n, 4, 4) put the robot, and a little around it.

        Without that limit it is best to fly the camera into the robot.
        """
        import cv2

        region = self._region.copy()
        for view, links in enumerate(self._canvas.parent_T_link):
            seen = np.zeros(self._valid.shape, np.uint8)
            for pose in camera_T_parents:
                self._renderers[0].rasterise(pose @ links)
                seen |= self._renderers[0].face >= 0
            grown = cv2.dilate(seen, np.ones((SEARCH.region_grow_px,) * 2, np.uint8))
            region[view] = self._valid & (grown > 0)
        self._limit_to(region)

    def _limit_to(self, region: NDArray[np.bool_]) -> None:
        self._region = region
        self._colours_in_region = np.bincount(self._colour[region], minlength=SEARCH.colours).astype(float)

    def __call__(self, camera_T_parents: Array) -> Array:
        """Costs (n,) of poses (n, 4, 4)."""
        self.evaluations += len(camera_T_parents)
        shares = np.array_split(np.asarray(camera_T_parents), len(self._renderers))
        pairs = zip(self._renderers, shares, strict=True)
        return np.concatenate(threads.each(lambda pair: self._costs(*pair), pairs))

    def _costs(self, renderer: Renderer, poses: Array) -> Array:
        costs = np.empty(len(poses))
        search_kernels.pose_costs(
            renderer.scene,
            renderer.sight,
            poses,
            self._canvas.parent_T_link,
            self._face_material,
            self._colour,
            self._region,
            self._colours_in_region,
            self._foreground,
            self._still,
            self._valid,
            SEARCH.motion_weight,
            np.zeros(self._colour.shape, np.uint8),
            np.zeros((self._materials + 1, SEARCH.colours)),
            costs,
        )
        return costs


def _clustered(
    images: list[NDArray[np.float32]], valid: NDArray[np.bool_], rng: np.random.Generator
) -> NDArray[np.int32]:
    """The nearest of k-means' colours (N, h, w) for every pixel."""
    import cv2

    lab = [
        cv2.cvtColor(image / np.float32(255), cv2.COLOR_RGB2LAB) * np.array(SEARCH.lab_weights, np.float32)
        for image in images
    ]
    pixels = np.concatenate([picture[valid] for picture in lab])
    chosen = pixels[rng.permutation(len(pixels))[: SEARCH.kmeans_pixels]]
    cv2.setRNGSeed(int(rng.integers(1 << 30)))
    stop = (cv2.TERM_CRITERIA_EPS + cv2.TERM_CRITERIA_MAX_ITER, SEARCH.kmeans_rounds, 0.1)
    _, _, centres = cv2.kmeans(chosen, SEARCH.colours, None, stop, 1, cv2.KMEANS_PP_CENTERS)
    squares = (centres**2).sum(1)
    nearest = [(squares - 2 * picture.reshape(-1, 3) @ centres.T).argmin(1) for picture in lab]
    return np.stack(nearest).reshape(len(images), *valid.shape).astype(np.int32)


def search(
    score: Score,
    start: Array,
    ball: Ball,
    restarts: int,
    rng: np.random.Generator,
    settings: SearchSettings = SEARCH,
) -> Iterator[tuple[Array, float]]:
    """The best parent_T_camera of each descent and its cost, descents from the best draws first."""
    draws = settings.draws if score.has_motion else settings.draws_without_motion
    coordinates = np.concatenate([np.zeros((1, 6)), ball.draw(rng, draws)])

    def poses(x: Array) -> Array:
        return se3.inverse(ball.pose(start, x))

    def cost(x: Array) -> Array:
        off = np.linalg.norm((x / ball.scale).reshape(-1, 2, 3), axis=2)
        beyond = np.maximum(off - settings.limit, 0).sum(1)
        return np.asarray(
            score(poses(x)) + settings.prior_weight * (off**2).sum(1) + settings.beyond_weight * beyond
        )

    score.limit_region(poses(coordinates[: settings.region_poses]))
    order = cost(coordinates).argsort()
    seeds: list[Array] = []
    for x in coordinates[order]:
        if len(seeds) == restarts:
            break
        if all(np.linalg.norm((x - seed) / ball.scale) > settings.apart for seed in seeds):
            seeds.append(x)
    for seed in seeds:
        x, lowest = minimise(cost, seed, settings.first_sigma * ball.scale, rng, settings)
        yield ball.pose(start, x), lowest


def minimise(
    cost: Callable[[Array], Array],
    start: Array,
    sigma: Array,
    rng: np.random.Generator,
    settings: SearchSettings = SEARCH,
) -> tuple[Array, float]:
    """The lowest point (d,) that CMA-ES meets, and its cost; `cost` takes (n, d), `sigma` (d,) scales the axes.

    Parameters as Hansen 2016, table 1, without negative weights.
    """
    d, n, parents = len(start), settings.population, settings.population // 2
    weights = np.log(parents + 0.5) - np.log(np.arange(1, parents + 1))
    weights /= weights.sum()
    effective = 1 / (weights**2).sum()
    keep_path = (4 + effective / d) / (d + 4 + 2 * effective / d)
    keep_step = (effective + 2) / (d + effective + 5)
    rank_one = 2 / ((d + 1.3) ** 2 + effective)
    rank_many = min(1 - rank_one, 2 * (effective - 2 + 1 / effective) / ((d + 2) ** 2 + effective))
    damping = 1 + 2 * max(0, np.sqrt((effective - 1) / (d + 1)) - 1) + keep_step
    expected = np.sqrt(d) * (1 - 1 / (4 * d) + 1 / (21 * d * d))
    mean, covariance, step = start.astype(float), np.eye(d), 1.0
    path, step_path = np.zeros(d), np.zeros(d)
    best, lowest = mean, np.inf
    for generation in range(settings.generations):
        values, axes = np.linalg.eigh(covariance)
        lengths = np.sqrt(np.maximum(values, 1e-20))
        moves = rng.normal(size=(n, d)) * lengths @ axes.T
        x = mean + step * moves * sigma
        costs = cost(x)
        order = costs.argsort()
        if costs[order[0]] < lowest:
            best, lowest = x[order[0]], float(costs[order[0]])
        chosen = moves[order[:parents]]
        move = weights @ chosen
        mean = mean + step * move * sigma
        whitened = axes @ ((axes.T @ move) / lengths)
        step_path = (1 - keep_step) * step_path + np.sqrt(keep_step * (2 - keep_step) * effective) * whitened
        length = np.linalg.norm(step_path)
        settled = (
            length / np.sqrt(1 - (1 - keep_step) ** (2 * (generation + 1))) < (1.4 + 2 / (d + 1)) * expected
        )
        path = (1 - keep_path) * path + settled * np.sqrt(keep_path * (2 - keep_path) * effective) * move
        covariance = (
            (1 - rank_one - rank_many) * covariance
            + rank_one * np.outer(path, path)
            + rank_many * (chosen.T * weights) @ chosen
        )
        step *= float(np.exp(keep_step / damping * (length / expected - 1)))
        if step * lengths.max() < settings.settled:
            break
    return best, lowest
