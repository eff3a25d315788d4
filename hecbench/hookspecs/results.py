"""Hooks of what follows from an estimate."""

from __future__ import annotations

from collections.abc import Iterable

from hecbench.hookspecs.marker import hookspec
from hecbench.specs import EvaluatorSpec, ExporterSpec


@hookspec
def hecbench_evaluators() -> Iterable[EvaluatorSpec]:
    """Numbers computed from an estimate and its recording.

    ```python
    import numpy as np

    from hecbench.registry import hookimpl
    from hecbench.specs import EvaluatorSpec, ResultSection


    def height(estimate, recording, *, solve, rng):
        '''How high above the parent's xy plane the camera lies, mm.'''
        return {"height_mm": 1e3 * float(np.asarray(estimate.parent_T_camera)[2, 3])}


    @hookimpl
    def hecbench_evaluators():
        yield EvaluatorSpec(
            name="height",
            summary="height of the camera",
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
