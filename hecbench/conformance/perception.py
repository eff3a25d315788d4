"""The checks that every trained network passes: shapes, ranges, and laws that hold whatever it was trained on."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial

import numpy as np
from numpy.typing import NDArray

from hecbench import se3
from hecbench.conformance.outcome import Check, run
from hecbench.errors import Refusal
from hecbench.rendering import Renderer, RenderMesh
from hecbench.robots.model import KNOWN_ARMS, RobotModel, load_robot
from hecbench.specs import Perceiver, PerceptionSpec

_SIZE = 240, 320
_K = np.array([[320.0, 0, 159.5], [0, 320, 119.5], [0, 0, 1]])
_DISTANCE_M = 1.8
_GREY, _AMBIENT = 110, 0.5
_POSTURE_RAD = (0.6, -1.2, 1.3, -1.4, -1.2, 0.3)
_LEAST_OVERLAP = 0.7
"""Of the mask of a robot drawn before one grey: much easier than a photograph."""
_SHIFT = se3.from_rotvec(np.array([0.1, -0.2, 0.3]), np.array([1.0, 2.0, 3.0]))
_FEW = 0.002
"""Share of an empty picture that may be mask."""


def check_perception(spec: PerceptionSpec) -> list[Check]:
    """Run every check on a trained network, with those of its robots that are known by name.

    Raises:
        Refusal: it knows none of these.
    """
    if not _known(spec):
        raise Refusal(f"{spec.name} knows none of the robots {', '.join(KNOWN_ARMS)}, which the checks draw")
    return run({name: partial(check, spec) for name, check in _CHECKS.items()}, spec.factory())


def _shapes(spec: PerceptionSpec, perceiver: Perceiver) -> Iterator[str]:
    sight = perceiver.see(_grey())
    for name, picture, shape in (
        ("visible", sight.visible(), _SIZE),
        ("whole", sight.whole(), _SIZE),
        ("colours", sight.colours(), (*_SIZE, 3)),
    ):
        if picture.shape != shape or picture.dtype != np.float32:
            yield f"{name} is {picture.dtype} {picture.shape}, expected float32 {shape}"
        elif not ((picture >= 0) & (picture <= 1)).all():
            yield f"{name} has values outside [0, 1]"
    if sight.keypoints.shape != (len(sight.trust), 2):
        yield f"{sight.keypoints.shape} keypoints for {len(sight.trust)} values of trust"


def _nothing_in_grey(spec: PerceptionSpec, perceiver: Perceiver) -> Iterator[str]:
    share = float((perceiver.see(_grey()).visible() > 0.5).mean())
    if share > _FEW:
        yield f"{100 * share:.1f} % of an empty grey picture is robot"


def _same_twice(spec: PerceptionSpec, perceiver: Perceiver) -> Iterator[str]:
    image, _ = _drawn(load_robot(_known(spec)[0]))
    first, second = perceiver.see(image), perceiver.see(image)
    if not np.array_equal(first.visible(), second.visible()) or not np.array_equal(first.trust, second.trust):
        yield "the same picture is seen in two ways"


def _finds_a_drawn_robot(spec: PerceptionSpec, perceiver: Perceiver) -> Iterator[str]:
    image, truth = _drawn(load_robot(_known(spec)[0]))
    found = perceiver.see(image).visible() > 0.5
    overlap = (found & truth).sum() / max((found | truth).sum(), 1)
    if overlap < _LEAST_OVERLAP:
        yield f"the mask of a robot before grey overlaps it by {overlap:.2f}, {_LEAST_OVERLAP} wanted"


def _keypoints_of_each_robot(spec: PerceptionSpec, perceiver: Perceiver) -> Iterator[str]:
    count = len(perceiver.see(_grey()).trust)
    for name in _known(spec):
        model = load_robot(name, meshes=False)
        poses = model.link_poses(np.zeros(len(model.joint_names)))
        points = perceiver.keypoint_positions(name, model.links, poses)
        if points.shape != (count, 3):
            yield f"{name}: positions {points.shape} of {count} keypoints"
        elif not np.allclose(
            perceiver.keypoint_positions(name, model.links, _SHIFT @ poses),
            se3.transform_points(_SHIFT, points),
        ):
            yield f"{name}: the keypoints do not move with the frame of the links"


def _known(spec: PerceptionSpec) -> list[str]:
    return [name for name in spec.robots if name in KNOWN_ARMS]


def _grey() -> NDArray[np.uint8]:
    return np.full((*_SIZE, 3), _GREY, np.uint8)


def _drawn(robot: RobotModel) -> tuple[NDArray[np.uint8], NDArray[np.bool_]]:
    """A picture of the robot before grey, lit from the camera, and where it is."""
    root_T_link = robot.link_poses(np.array(_POSTURE_RAD[: len(robot.joint_names)]))
    middle = root_T_link[:, :3, 3].mean(0)
    R = np.array([[0, 1, 0], [0, 0, -1], [-1, 0, 0]], float)
    camera_T_root = se3.make(R, np.array([0, 0, _DISTANCE_M]) - R @ middle)
    renderer = Renderer(RenderMesh.of(robot), _K, _SIZE[1], _SIZE[0], _AMBIENT)
    renderer.draw(camera_T_root @ root_T_link)
    picture = renderer.image(background=(_GREY / 255,) * 3)
    return np.rint(np.clip(picture[..., :3], 0, 1) * 255).astype(np.uint8), picture[..., 3] > 0.5


_CHECKS: dict[str, Callable[[PerceptionSpec, Perceiver], Iterator[str]]] = {
    "shapes and ranges": _shapes,
    "nothing in an empty picture": _nothing_in_grey,
    "the same picture twice": _same_twice,
    "finds a robot before grey": _finds_a_drawn_robot,
    "keypoints of each robot": _keypoints_of_each_robot,
}
