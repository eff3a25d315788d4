"""The hooks a plugin may implement; the docstring of each holds a whole plugin that works.

All but the last yield specs of `hecbench.specs`. Importing a plugin stays cheap: its factory imports what is heavy.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

import pluggy

from hecbench.specs import (
    DatasetSpec,
    DeviceSpec,
    EvaluatorSpec,
    ExporterSpec,
    ObserverSpec,
    PerceptionSpec,
    SegmenterSpec,
    SolverSpec,
    SuiteSpec,
    TranslatorSpec,
)

if TYPE_CHECKING:
    from hecbench.storage.trial_record import TrialRecord

GROUP = "hecbench"
"""The entry-point group and the prefix of every hook."""

hookspec = pluggy.HookspecMarker(GROUP)


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
def hecbench_evaluators() -> Iterable[EvaluatorSpec]:
    """Numbers computed from an estimate and its recording.

    ```python
    import numpy as np

    from hecbench.registry import hookimpl
    from hecbench.specs import Column, EvaluatorSpec, ResultSection


    def height(estimate, recording, *, solve, rng):
        '''How high above the parent's xy plane the camera lies, mm.'''
        return {"height_mm": 1e3 * float(np.asarray(estimate.parent_T_camera)[2, 3])}


    @hookimpl
    def hecbench_evaluators():
        yield EvaluatorSpec(
            name="height",
            summary="height of the camera",
            columns=(Column("height_mm", "mm", None),),
            factory=lambda: height,
            into=ResultSection.DIAGNOSTICS,
            applies=lambda recording: True,
        )
    ```
    """
    raise NotImplementedError


@hookspec
def hecbench_exporters() -> Iterable[ExporterSpec]:
    """Writers of an estimate in other people's formats.

    ```python
    from hecbench import se3
    from hecbench.registry import hookimpl
    from hecbench.specs import ExporterSpec


    def write(estimate, options):
        '''One line of CSV: x, y, z in metres, then the rotation vector in radians.'''
        pose = estimate.parent_T_camera
        numbers = [*pose[:3, 3], *se3.so3_log(pose[:3, :3])]
        return ",".join(f"{number:.9g}" for number in numbers) + "\\n"


    @hookimpl
    def hecbench_exporters():
        yield ExporterSpec(name="csv_line", summary="x, y, z, rx, ry, rz", suffix=".csv", write=write)
    ```
    """
    raise NotImplementedError


@hookspec
def hecbench_segmenters() -> Iterable[SegmenterSpec]:
    """Robot masks from images.

    ```python
    from dataclasses import replace

    import numpy as np

    from hecbench.registry import hookimpl
    from hecbench.specs import SegmenterSpec


    def by_motion(recording):
        '''Pixels that differ from the median of all pictures of a fixed camera.'''
        pictures = np.stack([recording.image(i) for i in range(len(recording))]).astype(int)
        moved = np.abs(pictures - np.median(pictures, 0)).max(3) > 25
        return replace(recording, masks=tuple(np.where(m, 255, 0).astype(np.uint8) for m in moved))


    @hookimpl
    def hecbench_segmenters():
        yield SegmenterSpec(name="by_motion", summary="what moves between views", factory=lambda: by_motion)
    ```
    """
    raise NotImplementedError


@hookspec
def hecbench_translators() -> Iterable[TranslatorSpec]:
    """Real-to-simulated image translation.

    ```python
    import numpy as np

    from hecbench.registry import hookimpl
    from hecbench.specs import TranslatorSpec


    def grey(image, mask, *, part, colours):
        '''The picture in grey, black outside the mask.'''
        level = image.mean(2, keepdims=True) * mask[..., None]
        return np.repeat(level, 3, 2).astype(np.float32)


    @hookimpl
    def hecbench_translators():
        yield TranslatorSpec(name="grey", summary="no colours", factory=lambda: grey)
    ```
    """
    raise NotImplementedError


@hookspec
def hecbench_perception() -> Iterable[PerceptionSpec]:
    """Trained networks that find a robot in photographs.

    ```python
    import numpy as np

    from hecbench.registry import hookimpl
    from hecbench.specs import PerceptionSpec


    class Nothing:
        '''What an empty picture shows.'''

        def __init__(self, height, width):
            self._size = height, width
            self.keypoints, self.trust = np.zeros((1, 2)), np.zeros(1)

        def visible(self):
            return np.zeros(self._size, np.float32)

        def whole(self):
            return np.zeros(self._size, np.float32)

        def colours(self):
            return np.zeros((*self._size, 3), np.float32)


    class Untaught:
        '''A network before its first lesson: it sees no robot anywhere.'''

        def see(self, image):
            return Nothing(*image.shape[:2])

        def keypoint_positions(self, robot, links, frame_T_link):
            return frame_T_link[..., -1:, :3, 3]


    @hookimpl
    def hecbench_perception():
        yield PerceptionSpec(name="untaught", summary="sees nothing", robots=("ur5e",), factory=Untaught)
    ```
    """
    raise NotImplementedError


@hookspec
def hecbench_robots() -> Iterable[DeviceSpec]:
    """Robot arms, simulated and real; the protocol is `hecbench_hardware.devices.Robot`.

    ```python
    import logging

    from hecbench.registry import hookimpl, load
    from hecbench.specs import DeviceSpec, Kind


    class Logged:
        '''The simulated UR5e, each motion written to the log before it begins.'''

        def __init__(self, options):
            self._robot = load().get(Kind.ROBOT, "sim_ur5e", DeviceSpec).open(options)

        def __getattr__(self, name):
            return getattr(self._robot, name)

        def move_joints(self, joints_rad, *, speed_rad_s=None):
            logging.getLogger(__name__).info("to joints %s", joints_rad)
            self._robot.move_joints(joints_rad, speed_rad_s=speed_rad_s)


    @hookimpl
    def hecbench_robots():
        yield DeviceSpec(
            name="logged_ur5e", kind=Kind.ROBOT, summary="sim_ur5e with a log", open=Logged, simulated=True
        )
    ```
    """
    raise NotImplementedError


@hookspec
def hecbench_grippers() -> Iterable[DeviceSpec]:
    """Grippers, simulated and real; the protocol is `hecbench_hardware.devices.Gripper`.

    ```python
    from hecbench.registry import hookimpl
    from hecbench.specs import DeviceSpec, Kind


    class Cup:
        '''A suction cup that is simulated: it holds whatever it is told to.'''

        name = "cup"

        def __init__(self):
            self._holding = False

        def enable(self):
            self._holding = False

        def open_fingers(self, width_m=None):
            self._holding = False

        def close_fingers(self, force_n=None):
            self._holding = True
            return self.status()

        def status(self):
            from hecbench_hardware.devices import GripperStatus

            return GripperStatus(width_m=None, moving=False, holding=self._holding)

        def stop(self):
            pass

        def close(self):
            pass


    @hookimpl
    def hecbench_grippers():
        yield DeviceSpec(
            name="cup", kind=Kind.GRIPPER, summary="a suction cup", open=lambda options: Cup(), simulated=True
        )
    ```
    """
    raise NotImplementedError


@hookspec
def hecbench_cameras() -> Iterable[DeviceSpec]:
    """Cameras, simulated and real; the protocol is `hecbench_hardware.devices.Camera`.

    ```python
    import time

    import numpy as np

    from hecbench.recording import CameraModel
    from hecbench.registry import hookimpl
    from hecbench.specs import DeviceSpec, Kind


    class Noise:
        '''A camera with its cap on.'''

        name = "noise"

        def __init__(self, options):
            self._rng = np.random.default_rng(int(options.get("seed", "0")))

        def grab(self, timeout_s=2.0):
            from hecbench_hardware.devices import Frame

            image = self._rng.integers(0, 8, (480, 640, 3), dtype=np.uint8)
            return Frame(image, time.time(), None, "noise")

        def intrinsics(self):
            return CameraModel(640, 480, np.array([[600.0, 0, 319.5], [0, 600, 239.5], [0, 0, 1]]))

        def close(self):
            pass


    @hookimpl
    def hecbench_cameras():
        yield DeviceSpec(
            name="noise", kind=Kind.CAMERA, summary="noise", open=Noise, simulated=True, options=("seed",)
        )
    ```
    """
    raise NotImplementedError


@hookspec
def hecbench_trial_finished(trial: TrialRecord) -> None:
    """Called after each trial, an aborted one too, once it is on disk; what it raises does not end the run.

    ```python
    import logging

    from hecbench.registry import hookimpl


    @hookimpl
    def hecbench_trial_finished(trial):
        logging.getLogger(__name__).warning("%s at place %d: %s", trial.task, trial.place, trial.outcome)
    ```
    """
    raise NotImplementedError
