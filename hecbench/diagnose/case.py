"""A recording under examination, and what several findings need of it, computed once."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from hecbench import se3
from hecbench.bundle.adjustment import Solution
from hecbench.diagnose.calibrate import assumed_points, calibrate, enclosing_points
from hecbench.diagnose.fit import LEAST_SAMPLES, Fit
from hecbench.errors import HecbenchError, SolverFailure
from hecbench.preparation import prepare
from hecbench.recording import Mounting, Recording
from hecbench.robots.posed import PosedRobot
from hecbench.se3 import Array

STANDS_OUT = 5.0
"""Variance ratio (6 and 6 N - 19 degrees of freedom) that a sample of ten exceeds once in 1500 times."""
_BEFORE = 0.3
"""Cosine of the widest angle off the axis at which a camera sees a target."""
_MOSTLY = 0.9
_REJECTED_AT_ONCE = 40
"""One sample in so many; the others are then judged without them."""
_LEAST_SHARE = 0.5
"""Of the samples that must agree."""


@dataclass(frozen=True, eq=False)
class Examination:
    """Findings read it; one that knows a cure hands on the cured case, so that the next ones see past the fault.

    Attributes:
        recording: as given, with the corners and the intrinsics that were found in its images.
        fitted_intrinsics: whether these intrinsics were fitted to the images, for want of given ones.
        judged: False once the data cannot be fitted, with the reason in a finding.
        size_factor: by which the declared size of the target is multiplied.
        explained: ids of samples whose fault has been named.
        pictures: samples before those of one robot pose were taken together.
        said: what could not be computed, and why.
        noise_px: rms distance that a corner keeps from its own picture's target pose; None when unknown.
    """

    recording: Recording
    fitted_intrinsics: bool = False
    judged: bool = True
    size_factor: float = 1.0
    explained: frozenset[str] = frozenset()
    noise_px: float | None = None
    pictures: int = 0
    said: tuple[str, ...] = ()

    @staticmethod
    def of(recording: Recording, prepared: Recording | None = None) -> Examination:
        """The examination of a recording; the truth is left out.

        Args:
            recording: as it was read.
            prepared: what `preparation.prepare` made of it, when that was done already.
        """
        seen = prepare(recording) if prepared is None else prepared
        given = recording.camera is not None and recording.camera.K is not None
        fitted = not given and seen.camera is not None and seen.camera.K is not None
        known = replace(recording.without_truth(), corners_px=seen.corners_px, camera=seen.camera)
        said = tuple(note for note in seen.notes if note not in recording.notes)
        return Examination(known, fitted, pictures=len(known), said=said)

    @cached_property
    def observed(self) -> Recording:
        """The recording with all poses that can be computed."""
        return prepare(self.recording)

    @cached_property
    def usable(self) -> NDArray[np.int64]:
        """Indices of the samples with a robot pose and a target pose."""
        robot, target = self.observed.base_T_flange, self.observed.camera_T_target
        if robot is None or target is None:
            return np.zeros(0, int)
        return np.flatnonzero(np.isfinite(robot).all((1, 2)) & np.isfinite(target).all((1, 2)))

    @property
    def base_T_flange(self) -> Array:
        """(N, 4, 4) m of the usable samples."""
        poses = self.observed.present.base_T_flange
        return poses[self.usable]

    @property
    def camera_T_target(self) -> Array:
        """(N, 4, 4) m of the usable samples, for a target of the true size, seen by an optical camera."""
        poses = self.observed.present.camera_T_target
        poses = poses[self.usable]
        poses[:, :3, 3] *= self.size_factor
        return np.asarray(self.optical_T_camera @ poses)

    @cached_property
    def optical_T_camera(self) -> Array:
        """(4, 4) from the recording's camera frame to one that has all targets before it.

        The identity for a camera with pixels; target poses alone may be given in any frame.
        """
        poses = self.observed.camera_T_target
        if poses is None or self.recording.corners_px is not None:
            return np.eye(4)
        return looking_at(self.size_factor * poses[np.isfinite(poses).all((1, 2)), :3, 3])

    @property
    def focal_px(self) -> float | None:
        """None when the intrinsics are unknown."""
        camera = self.recording.camera
        return None if camera is None or camera.K is None else float(np.sqrt(camera.K[0, 0] * camera.K[1, 1]))

    @cached_property
    def points_m(self) -> Array:
        """Corners of the rectangle or box around the target."""
        target = self.recording.target
        if target is None:
            return assumed_points(self.camera_T_target)
        return self.size_factor * enclosing_points(target.points_m)

    @property
    def can_be_fitted(self) -> bool:
        """Whether a calibration of these data means anything."""
        return self.judged and len(self.usable) >= LEAST_SAMPLES

    @cached_property
    def fit(self) -> Fit | None:
        """The calibration of the usable samples; None when there is none."""
        if not self.can_be_fitted:
            return None
        return self.fit_of(self.base_T_flange, self.camera_T_target)

    def fit_of(
        self,
        base_T_flange: Array,
        camera_T_target: Array,
        focal_px: float | None = None,
    ) -> Fit | None:
        """A calibration of other poses with this case's mounting and target."""
        focal_px = focal_px or self.focal_px
        return calibrate(self.recording.mounting, base_T_flange, camera_T_target, self.points_m, focal_px)

    @cached_property
    def agreed(self) -> tuple[Fit, NDArray[np.bool_]] | None:
        """The calibration of the samples that agree, applied to all usable ones, and which these are (N,)."""
        if self.fit is None:
            return None
        agreeing = np.ones(len(self.usable), bool)
        try:
            found = self.fit.refitted_to(agreeing)
            while agreeing.sum() > max(LEAST_SAMPLES + 1, len(agreeing) * _LEAST_SHARE):
                different = np.where(agreeing, found.studentised(agreeing), 0.0)
                if different.max() <= STANDS_OUT:
                    break
                worst = np.argsort(-different)[: 1 + len(agreeing) // _REJECTED_AT_ONCE]
                agreeing[worst[different[worst] > STANDS_OUT]] = False
                found = found.refitted_to(agreeing)
        except (SolverFailure, np.linalg.LinAlgError):
            return None
        return found, agreeing

    @cached_property
    def solution(self) -> Solution | None:
        """The refined calibration of the samples that agree, with its covariance."""
        if self.agreed is None:
            return None
        found, agreeing = self.agreed
        try:
            return found.subset(agreeing).refined()
        except (SolverFailure, np.linalg.LinAlgError):
            return None

    @cached_property
    def base_T_flange_by_joints(self) -> Array | None:
        """(samples, 4, 4) m by forward kinematics, NaN where joints are absent; None without a known robot."""
        if self.recording.joints_rad is None:
            return None
        try:
            return PosedRobot.of(self.recording, meshes=False).base_T_flange
        except HecbenchError:
            return None

    @property
    def noise_factor(self) -> float:
        """How much noisier the agreeing samples are than the typical noise that weighs them."""
        if self.agreed is None:
            return 1.0
        found, agreeing = self.agreed
        squares, gradients, _ = found.reduced
        return float(np.sqrt(squares[agreeing].sum() / (6 * agreeing.sum() - gradients.shape[1])))

    def ids(self, chosen: NDArray[np.integer] | NDArray[np.bool_]) -> tuple[str, ...]:
        """Ids of some of the usable samples."""
        return tuple(self.recording.sample_ids[i] for i in self.usable[chosen].tolist())

    def with_robot_poses(self, base_T_flange: Array) -> Examination:
        """The case as it would be with other robot poses (samples, 4, 4)."""
        return replace(self, recording=replace(self.recording, base_T_flange=base_T_flange))


def looking_at(positions: Array) -> Array:
    """optical_T_camera (4, 4) of a camera that sees positions (N, 3) m; the identity where this one does.

    A frame among the positions is left backwards, until they fill the usual angle of view.
    """
    distances = np.linalg.norm(positions, axis=1)
    if not positions.any() or (positions[:, 2] > _BEFORE * distances).mean() > _MOSTLY:
        return np.eye(4)
    centre = positions.mean(0)
    forward = centre / max(float(np.linalg.norm(centre)), 1e-12)
    sideways = np.eye(3)[int(np.abs(forward).argmin())]
    across = np.cross(sideways, forward)
    across /= np.linalg.norm(across)
    rotation = np.stack([across, np.cross(forward, across), forward])
    ahead = positions @ forward
    back = 0.0
    if (ahead < _BEFORE * distances).mean() > 1 - _MOSTLY:
        back = 2 * float(np.linalg.norm(positions - centre, axis=1).max())
    return se3.make(rotation, [0.0, 0.0, back])


def inverted(base_T_flange: Array) -> Array:
    """The poses (samples, 4, 4) read in the other direction, NaN rows kept."""
    return np.asarray(se3.inverse(base_T_flange))


def other(mounting: Mounting) -> Mounting:
    """The mounting that was not declared."""
    return Mounting.EYE_IN_HAND if mounting is Mounting.EYE_TO_HAND else Mounting.EYE_TO_HAND
