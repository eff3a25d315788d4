"""A stranger's solver: rotation from paired logs, translation by least squares, as Park and Martin 1994."""

import numpy as np

from hecbench import se3
from hecbench.errors import Refusal
from hecbench.estimate import Estimate
from hecbench.registry import hookimpl
from hecbench.specs import Need, SolverSpec


def toy(recording, *, rng):
    hand, camera_T_target = recording.hand_poses(), recording.camera_T_target
    if camera_T_target is None:
        raise Refusal("this toy takes only given camera_T_target")
    order = np.lexsort(hand[:, :3].reshape(len(hand), -1).T)
    hand, camera_T_target = hand[order], camera_T_target[order]
    i, j = np.triu_indices(len(hand), 1)
    A = hand[j] @ se3.inverse(hand[i])
    B = camera_T_target[j] @ se3.inverse(camera_T_target[i])
    logs_A, logs_B = se3.so3_log(A[:, :3, :3]), se3.so3_log(B[:, :3, :3])
    if np.append(np.linalg.svd(logs_A, compute_uv=False), 0)[1] < 0.02 * np.sqrt(len(A)):
        raise Refusal("the hand must turn about two axes")
    rotation = se3.nearest_rotation(logs_A.T @ logs_B)
    left = (A[:, :3, :3] - np.eye(3)).reshape(-1, 3)
    right = (B[:, :3, 3] @ rotation.T - A[:, :3, 3]).ravel()
    return Estimate(se3.make(rotation, np.linalg.lstsq(left, right, rcond=None)[0]))


@hookimpl
def hecbench_solvers():
    yield SolverSpec(
        name="toy",
        summary="a third-party example",
        factory=lambda: toy,
        needs=frozenset({Need.TARGET_POSES}),
        reference="Park, Martin 1994",
    )
