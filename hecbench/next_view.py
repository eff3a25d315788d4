"""Which joints to look at next: where the robot's contour tells most about the camera.

Two criteria on the same drawings. D-optimal: the contour information of the new view added to what is known, by its
determinant (Pukelsheim 2006, "Optimal Design of Experiments", ch. 6; the contour as in `docs/next-view.md`). Mask
variance: where drawings from several possible cameras differ most (Chen et al. 2023, "EasyHeC", space exploration).
Self-collision is not modelled, nor what else stands in the cell: the caller filters the candidates.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from hecbench import se3
from hecbench.errors import InputError
from hecbench.estimate import Estimate
from hecbench.recording import Recording
from hecbench.rendering import Renderer, RenderMesh
from hecbench.rendering.undistort import shrunk_intrinsics
from hecbench.robots.posed import PosedRobot
from hecbench.se3 import Array

Mask = NDArray[np.bool_]

CONTOUR_NOISE_PX = 1.0
CORRELATION_PX = 15.0
"""How well a contour point is seen, and along how many pixels of contour its error stays the same."""
SPREAD_PX = 8.0
"""Typical contour motion, full size, between the cameras that the mask variance compares."""
_SHRINK, _CELL_M = 4, 0.006
"""Of the contours."""
_COARSE_SHRINK, _COARSE_CELL_M = 8, 0.012
"""Of masks, and of the canvas on which the robot's share in view is counted."""
_CANVAS = 2
"""How many times as wide and high as the image that canvas is."""
_CAMERAS = 10
"""Possible cameras that are compared; EasyHeC's code takes as many."""
_PRIOR_RAD, _PRIOR_M = 0.2, 0.2
"""What is known of a camera without any picture."""


@dataclass(frozen=True, eq=False)
class ViewInformation:
    """What one joint vector would show.

    Attributes:
        information: (6, 6) about left perturbations [phi rad, rho m] of camera_T_parent.
        contour_px: length of the robot's outer contour, px of the full size.
        in_view: share of the robot's pixels that lie in the image; 0 when it reaches behind the camera.
        filled: share of the image that the robot covers.
    """

    information: Array
    contour_px: float
    in_view: float
    filled: float


class RobotView:
    """Draws the robot of a recording for other joints; the lens is left out.

    Raises:
        InputError: the recording names no robot model or intrinsics.
    """

    def __init__(self, recording: Recording) -> None:
        camera, self._robot = recording.camera, PosedRobot.of(recording)
        if camera is None or camera.K is None:
            raise InputError(f"{recording.name}: camera.K is needed to plan views of the robot")
        size = camera.width, camera.height
        coarse = RenderMesh.of(self._robot.model, cell_m=_COARSE_CELL_M)
        self._near = Renderer(
            RenderMesh.of(self._robot.model, cell_m=_CELL_M), *_sized(camera.K, size, 1, _SHRINK)
        )
        self._wide = Renderer(coarse, *_sized(camera.K, size, _CANVAS, _COARSE_SHRINK))
        self._small = Renderer(coarse, *_sized(camera.K, size, 1, _COARSE_SHRINK))

    def look(self, joints_rad: ArrayLike, parent_T_camera: Array) -> ViewInformation:
        """What these joints (J,) would show to a camera."""
        poses = se3.inverse(parent_T_camera) @ self._robot.link_poses(np.asarray(joints_rad, float))
        self._wide.rasterise(poses)
        drawn = self._wide.face >= 0
        height, width = drawn.shape
        top, left = (height - height // _CANVAS) // 2, (width - width // _CANVAS) // 2
        inside = drawn[top : top + height // _CANVAS, left : left + width // _CANVAS]
        hidden = self._wide.dropped > 0 or not drawn.any()
        in_view = 0.0 if hidden else float(inside.sum() / drawn.sum())
        self._near.draw(poses)
        filled = float((self._near.face >= 0).mean())
        return ViewInformation(*contour_information(self._near, _SHRINK), in_view, filled)

    def masks(self, joints_rad: ArrayLike, cameras: Array) -> Mask:
        """Where (K, h, w) the robot would be drawn by cameras parent_T_camera (K, 4, 4), an eighth of the size."""
        parent_T_link = self._robot.link_poses(np.asarray(joints_rad, float))
        found = np.empty((len(cameras), *self._small.face.shape), bool)
        for camera_T_parent, mask in zip(se3.inverse(cameras), found, strict=True):
            self._small.rasterise(camera_T_parent @ parent_T_link)
            np.greater_equal(self._small.face, 0, out=mask)
        return found


def _sized(K: Array, size: tuple[int, int], canvas: int, shrink: int) -> tuple[Array, int, int]:
    """K, width and height of a canvas about the image, shrunk."""
    width, height = (canvas * (side // shrink) for side in size)
    small = shrunk_intrinsics(K, 1 / shrink)
    small[:2, 2] += [(canvas - 1) * (side // shrink) / 2 for side in size]
    return small, width, height


def contour_information(renderer: Renderer, shrink: int = 1) -> tuple[Array, float]:
    """I (6, 6) of the outer contour drawn last, and its length, px of the full size.

    I is the sum over the length of J'J / (noise^2 * correlation length).

    J is the derivative of a contour point along its normal, px of the full size, by a left perturbation of
    camera_T_parent. Each stretch of contour counts once, by the axis that it crosses more steeply.
    """
    crossings = renderer.crossings
    used = (crossings.parts < 0).any(1) & (np.abs(crossings.slope) <= 1)
    tilt = np.sqrt(1 + crossings.slope[used].astype(float) ** 2)
    along_normal = crossings.pose_columns()[used] * (shrink / tilt)[:, None]
    length = shrink * tilt
    information = (along_normal * length[:, None]).T @ along_normal / (CONTOUR_NOISE_PX**2 * CORRELATION_PX)
    return np.asarray(information), float(length.sum())


def information_of(estimate: Estimate) -> Array:
    """What an estimate knows, (6, 6) about left perturbations of camera_T_parent: the inverse of its covariance.

    Raises:
        InputError: it has no answer, or no covariance.
    """
    if estimate.parent_T_camera is None or estimate.covariance is None:
        raise InputError(
            f"{estimate.solver}: has no covariance, so that what is known of the camera cannot be computed"
        )
    return np.asarray(np.linalg.inv(se3.inverse_covariance(estimate.parent_T_camera, estimate.covariance)))


def prior_information() -> Array:
    """Of a rough start, as a guess by eye is: 0.2 rad and 0.2 m."""
    return np.diag([_PRIOR_RAD**-2.0] * 3 + [_PRIOR_M**-2.0] * 3)


def log_determinants(known: Array, looks: Sequence[ViewInformation]) -> Array:
    """log det (M,) of what would be known after each look, nats: the D-optimal criterion."""
    return np.asarray(np.linalg.slogdet(known + np.array([look.information for look in looks]))[1])


def expected_error_m(known: Array, parent_T_camera: Array, points_m: Array) -> float:
    """Expected rms displacement of points (P, 3) of the parent frame under what is known (6, 6)."""
    carried = se3.adjoint(parent_T_camera)
    covariance = carried @ np.linalg.inv(known) @ carried.T
    x, y, z = points_m.T
    zero = np.zeros_like(x)
    turned = np.array([[zero, z, -y], [-z, zero, x], [y, -x, zero]]).transpose(2, 0, 1)
    columns = np.concatenate([turned, np.tile(np.eye(3), (len(points_m), 1, 1))], -1)
    variances = np.einsum("pij,jk,pik->p", columns, covariance, columns)
    return float(np.sqrt(variances.mean()))


def possible_cameras(
    known: Array, parent_T_camera: Array, look: ViewInformation, count: int, rng: np.random.Generator
) -> Array:
    """Cameras (count, 4, 4) drawn from what is known about one, spread so that a mask can distinguish them.

    A second-order solver knows the camera better than a mask can show: the spread is scaled, its shape kept, until the
    contour of a look moves by `SPREAD_PX` typically.
    """
    covariance = np.linalg.inv(known)
    summed = float(np.trace(look.information @ covariance)) * CONTOUR_NOISE_PX**2 * CORRELATION_PX
    motion_px = np.sqrt(summed / max(look.contour_px, 1.0))
    draws = rng.multivariate_normal(np.zeros(6), (SPREAD_PX / motion_px) ** 2 * covariance, count)
    return np.asarray(se3.inverse(se3.exp(draws) @ se3.inverse(parent_T_camera)))


def mask_variance(view: RobotView, joints_rad: ArrayLike, cameras: Array) -> float:
    """EasyHeC's score V(q): the sum over pixels of the unbiased variance of the masks seen by several cameras."""
    share = view.masks(joints_rad, cameras).mean(0)
    return float((share * (1 - share)).sum() * len(cameras) / (len(cameras) - 1))


@dataclass(frozen=True)
class Visible:
    """Which looks count: how much of the robot is in the image, and how much of the image it fills."""

    least_in_view: float = 0.6
    least_filled: float = 0.01

    def __call__(self, look: ViewInformation) -> bool:
        return look.in_view >= self.least_in_view and look.filled >= self.least_filled


@dataclass(frozen=True, eq=False)
class Choice:
    """Joint vectors in the order in which they tell most, and what would be known after all of them."""

    joints_rad: Array
    """(count, J)"""
    indices: list[int]
    known: Array
    """(6, 6)"""


def most_informative(
    view: RobotView,
    parent_T_camera: Array,
    candidates_rad: Array,
    known: Array,
    count: int = 1,
    visible: Visible = Visible(),
) -> Choice:
    """The joints to look at next: D-optimal, one after the other, each given those before it.

    Args:
        view: of the robot.
        parent_T_camera: the best guess of the camera.
        candidates_rad: (M, J), within the limits and free of collisions.
        known: (6, 6), from `information_of` an estimate or `prior_information`.
        count: how many; a candidate may be chosen once.
        visible: which candidates the camera sees well enough.

    Raises:
        InputError: fewer than `count` candidates can be seen.
    """
    looks = _seen(view, parent_T_camera, candidates_rad, count, visible)

    def best(known: Array, left: list[int]) -> int:
        return left[int(np.argmax(log_determinants(known, [looks[i] for i in left])))]

    return _one_by_one(best, looks, candidates_rad, known, count)


def most_uncertain(
    view: RobotView,
    parent_T_camera: Array,
    candidates_rad: Array,
    known: Array,
    count: int = 1,
    visible: Visible = Visible(),
    *,
    rng: np.random.Generator,
) -> Choice:
    """The joints at which the masks seen by the possible cameras vary most (EasyHeC); arguments as above.

    The cameras are drawn again after each choice, from what would be known then.

    Raises:
        InputError: fewer than `count` candidates can be seen.
    """
    looks = _seen(view, parent_T_camera, candidates_rad, count, visible)
    typical = looks[min(looks)]

    def best(known: Array, left: list[int]) -> int:
        cameras = possible_cameras(known, parent_T_camera, typical, _CAMERAS, rng)
        return max(left, key=lambda i: mask_variance(view, candidates_rad[i], cameras))

    return _one_by_one(best, looks, candidates_rad, known, count)


def _seen(
    view: RobotView, parent_T_camera: Array, candidates_rad: Array, count: int, visible: Visible
) -> dict[int, ViewInformation]:
    looks = {i: view.look(joints, parent_T_camera) for i, joints in enumerate(candidates_rad)}
    seen = {i: look for i, look in looks.items() if visible(look)}
    if len(seen) < count:
        raise InputError(
            f"only {len(seen)} of {len(looks)} candidate poses show {100 * visible.least_in_view:.0f} % of the"
            " robot, large enough: give another start, wider limits or a rough camera pose nearer to the truth"
        )
    return seen


def _one_by_one(
    best: Callable[[Array, list[int]], int],
    looks: Mapping[int, ViewInformation],
    candidates_rad: Array,
    known: Array,
    count: int,
) -> Choice:
    chosen: list[int] = []
    for _ in range(count):
        chosen.append(best(known, [i for i in looks if i not in chosen]))
        known = known + looks[chosen[-1]].information
    return Choice(candidates_rad[chosen], chosen, known)
