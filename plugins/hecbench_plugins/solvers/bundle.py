"""Ulrich and Hillemann 2024, "Uncertainty-aware hand-eye calibration" (T-RO): reprojection bundle
adjustment in which robot poses are corrected and the noise of corners and robot is estimated with them.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

import numpy as np

from hecbench.bundle.adjustment import adjust_with_noise
from hecbench.bundle.model import Noise, start
from hecbench.errors import Refusal
from hecbench.estimate import Estimate
from hecbench.recording import CameraModel, Recording
from hecbench.registry import hookimpl
from hecbench.specs import Need, SolverSpec
from hecbench_plugins.markers.reprojection import (
    DEFAULT_NOISE,
    adjust_with_exact_robot,
    corner_problem,
    to_estimate,
)


@dataclass(frozen=True)
class IntrinsicsPrior:
    """Standard deviations around the recording's intrinsics.

    Attributes:
        focal: of both focal lengths, relative.
        centre: of the principal point, relative to the image's width.
        distortion: of every coefficient.
    """

    focal: float = 0.02
    centre: float = 0.02
    distortion: float = 0.05

    def sigmas(self, camera: CameraModel) -> np.ndarray:
        """(4 + D,) of fx, fy, cx, cy (px) and the distortion coefficients."""
        focals = self.focal * np.diag(camera.intrinsics)[:2]
        return np.array(
            [*focals, *[self.centre * camera.width] * 2, *[self.distortion] * len(camera.distortion)]
        )


@dataclass(frozen=True)
class Bundle:
    """The anchor among the marker-based methods: calibrated covariance, robot errors allowed for.

    A noise that is None is estimated (variance components); where the data cannot tell, it is 0.3 px,
    0.05 deg, 0.5 mm.

    Attributes:
        sigma_px: of a corner, per axis.
        sigma_robot_rotation_deg: of a robot pose, per axis.
        sigma_robot_translation_mm: of a robot pose, per axis.
        intrinsics: None keeps the recording's; a prior frees them.
    """

    sigma_px: float | None = None
    sigma_robot_rotation_deg: float | None = None
    sigma_robot_translation_mm: float | None = None
    intrinsics: IntrinsicsPrior | None = None

    def __call__(self, recording: Recording, *, rng: np.random.Generator) -> Estimate:
        """Answer.

        Raises:
            Refusal: corners, intrinsics or robot poses are missing, or do not determine X.
            SolverFailure: the data contradict the model.
        """
        problem = corner_problem(recording)
        exact = adjust_with_exact_robot(recording, problem)
        camera = recording.camera
        if camera is None:
            raise Refusal("needs camera.K")
        if self.intrinsics:
            problem = corner_problem(recording, self.intrinsics.sigmas(camera))
        first = start(problem, exact.state.parent_T_camera, exact.state.carrier_T_target)
        solution = adjust_with_noise(problem, first, self._noise(), self._known())
        if not self.intrinsics:
            return to_estimate(problem, solution)
        fx, fy, cx, cy = solution.state.parameters[:4]
        K, distortion = np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1]]), solution.state.parameters[4:]
        sigmas = np.sqrt(np.diagonal(solution.covariance)[-len(problem.parameters) :])
        found = to_estimate(
            problem,
            solution,
            K=K.tolist(),
            distortion=distortion.tolist(),
            intrinsics_sigma=sigmas.tolist(),
            intrinsics_prior_sigma=problem.parameter_sigmas.tolist(),
        )
        return replace(found, camera=replace(camera, K=K, distortion=distortion))

    def _known(self) -> tuple[bool, bool, bool]:
        return (
            self.sigma_px is not None,
            self.sigma_robot_rotation_deg is not None,
            self.sigma_robot_translation_mm is not None,
        )

    def _noise(self) -> Noise:
        given = self.sigma_px, self.sigma_robot_rotation_deg, self.sigma_robot_translation_mm
        units = 1.0, np.deg2rad(1.0), 1e-3
        defaults = DEFAULT_NOISE.observed, DEFAULT_NOISE.rotation_rad, DEFAULT_NOISE.translation_m
        return Noise(
            *(
                default if sigma is None else sigma * unit
                for sigma, unit, default in zip(given, units, defaults, strict=True)
            )
        )


@hookimpl
def hecbench_solvers() -> Iterable[SolverSpec]:
    """This file's solvers."""
    needs = frozenset({Need.CORNERS, Need.INTRINSICS})
    reference = "Ulrich, Hillemann 2024, doi:10.1109/TRO.2023.3330609"
    yield SolverSpec(
        name="bundle",
        summary="reprojection bundle adjustment, robot poses corrected, with covariance",
        factory=Bundle,
        needs=needs,
        imports=("cv2",),
        reference=reference,
    )
    yield SolverSpec(
        name="bundle_intrinsics",
        summary="like bundle, with the intrinsics as unknowns around the given ones",
        factory=lambda: Bundle(intrinsics=IntrinsicsPrior()),
        needs=needs,
        imports=("cv2",),
        reference=reference,
    )
