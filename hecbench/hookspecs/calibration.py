"""Hooks of methods and of the recordings that feed them."""

from __future__ import annotations

from collections.abc import Iterable

from hecbench.hookspecs.marker import hookspec
from hecbench.specs import DatasetSpec, ObserverSpec, SolverSpec, SuiteSpec


@hookspec
def hecbench_solvers() -> Iterable[SolverSpec]:
    """Calibration methods.

    ```python
    import numpy as np

    from hecbench import se3
    from hecbench.errors import Refusal
    from hecbench.estimate import Estimate
    from hecbench.registry import hookimpl
    from hecbench.specs import Need, SolverSpec


    def two_steps(recording, *, rng):
        '''Rotation from the axes of relative motions (Park and Martin 1994), then translation, by least squares.'''
        hand, target = recording.hand_poses(), recording.camera_T_target
        seen = np.isfinite(hand).all((1, 2)) & np.isfinite(target).all((1, 2))
        i, j = np.nonzero(~np.eye(seen.sum(), dtype=bool))
        A = hand[seen][i] @ se3.inverse(hand[seen][j])
        B = target[seen][i] @ se3.inverse(target[seen][j])  # A X = X B
        a, b = se3.so3_log(A[:, :3, :3]), se3.so3_log(B[:, :3, :3])
        u, s, vt = np.linalg.svd(a.T @ b)
        if s[1] < 0.01 * max(s[0], 1):
            raise Refusal("the hand turned about one axis only: turn it about two that are not parallel")
        R = u @ np.diag([1, 1, np.linalg.det(u @ vt)]) @ vt
        left = np.concatenate(np.eye(3) - A[:, :3, :3])
        right = np.concatenate(A[:, :3, 3] - B[:, :3, 3] @ R.T)
        return Estimate(se3.make(R, np.linalg.lstsq(left, right, rcond=None)[0]))


    @hookimpl
    def hecbench_solvers():
        yield SolverSpec(
            name="two_steps",
            summary="rotation from motion axes, then translation",
            factory=lambda: two_steps,
            needs=frozenset({Need.TARGET_POSES}),
            reference="Park and Martin 1994, doi:10.1109/70.326576",
        )
    ```
    """
    raise NotImplementedError


@hookspec
def hecbench_observers() -> Iterable[ObserverSpec]:
    """Observations computed from rawer ones, once for all solvers: corners from images, poses from corners.

    ```python
    from dataclasses import replace

    import numpy as np

    from hecbench.registry import hookimpl
    from hecbench.specs import Need, ObserverSpec


    def centres(recording):
        '''The brightest pixel of each image as the only corner of a target of one point.'''
        corners = np.full((len(recording), 1, 2), np.nan)
        for i in range(len(recording)):
            image = recording.image(i).sum(2)
            corners[i, 0] = np.unravel_index(image.argmax(), image.shape)[::-1]
        return replace(recording, corners_px=corners)


    def applies(recording):
        one_point = recording.target is not None and len(recording.target.points_m) == 1
        return one_point and recording.corners_px is None and Need.IMAGES in recording.offers()


    @hookimpl
    def hecbench_observers():
        yield ObserverSpec(
            name="bright_spot",
            summary="a lamp as a target of one point",
            gives=Need.CORNERS,
            applies=applies,
            factory=lambda: centres,
        )
    ```
    """
    raise NotImplementedError


@hookspec
def hecbench_datasets() -> Iterable[DatasetSpec]:
    """Readers of recordings on disk.

    ```python
    import numpy as np

    from hecbench.errors import InputError
    from hecbench.recording import Mounting, Recording
    from hecbench.registry import hookimpl
    from hecbench.specs import DatasetSpec

    NAME = "poses.npz"


    def sniff(path):
        return (path / NAME).is_file()


    def load(path):
        '''Arrays base_T_flange and camera_T_target (N, 4, 4), metres, of a camera beside the robot.'''
        try:
            with np.load(path / NAME, allow_pickle=False) as arrays:
                robot, target = arrays["base_T_flange"], arrays["camera_T_target"]
        except (OSError, KeyError, ValueError) as error:
            raise InputError(f"{path}: is no folder with {NAME} of base_T_flange and camera_T_target ({error})")
        return Recording(
            name=path.name,
            mounting=Mounting.EYE_TO_HAND,
            sample_ids=tuple(f"{i:06d}" for i in range(len(robot))),
            base_T_flange=robot,
            camera_T_target=target,
            folder=path,
        )


    @hookimpl
    def hecbench_datasets():
        yield DatasetSpec(name="npz_poses", summary="pose pairs in an NPZ file", sniff=sniff, load=load)
    ```
    """
    raise NotImplementedError


@hookspec
def hecbench_suites() -> Iterable[SuiteSpec]:
    """Generated recordings by name and level.

    ```python
    import numpy as np

    from hecbench import se3
    from hecbench.recording import Mounting, Recording
    from hecbench.registry import hookimpl
    from hecbench.specs import SuiteSpec

    NOISE = {"exact": 0.0, "noisy": 1e-3}


    def make(level, index, seed):
        '''A camera beside the robot and twelve poses; depends on nothing but the three arguments.'''
        rng = np.random.default_rng([seed, index, len(level)])
        base_T_camera, flange_T_target = se3.exp(rng.normal(size=(2, 6)))
        camera_T_target = se3.exp(rng.normal(0, 0.4, (12, 6))) @ se3.from_rotvec([0, 0, 0], [0, 0, 1])
        noise = se3.exp(rng.normal(0, NOISE[level], (12, 6)))
        return Recording(
            name=f"turns_{level}_{index}",
            mounting=Mounting.EYE_TO_HAND,
            sample_ids=tuple(f"{i:06d}" for i in range(12)),
            base_T_flange=base_T_camera @ camera_T_target @ se3.inverse(flange_T_target),
            camera_T_target=noise @ camera_T_target,
            truth_parent_T_camera=base_T_camera,
        )


    @hookimpl
    def hecbench_suites():
        yield SuiteSpec(name="turns", summary="random poses", levels=tuple(NOISE), default_samples=20, make=make)
    ```
    """
    raise NotImplementedError
