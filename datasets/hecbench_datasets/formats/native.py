"""The native recording folder."""

from __future__ import annotations

from collections.abc import Iterable

from hecbench.registry import hookimpl
from hecbench.specs import DatasetSpec
from hecbench.storage import recording_io


@hookimpl
def hecbench_datasets() -> Iterable[DatasetSpec]:
    """This file's format."""
    yield DatasetSpec(
        name="native",
        summary="a folder with recording.json (schema hecbench.recording/1)",
        sniff=recording_io.is_recording,
        load=recording_io.load,
    )
