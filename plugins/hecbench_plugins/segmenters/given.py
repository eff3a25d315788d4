"""The masks that a recording brings along."""

from __future__ import annotations

from collections.abc import Iterable

from hecbench.errors import Refusal
from hecbench.recording import Recording
from hecbench.registry import hookimpl
from hecbench.specs import Need, SegmenterSpec


def given(recording: Recording) -> Recording:
    """The recording itself.

    Raises:
        Refusal: it has no masks.
    """
    if Need.MASKS not in recording.offers():
        raise Refusal(f"{recording.name}: has no masks (samples[].mask); name another segmenter")
    return recording


@hookimpl
def hecbench_segmenters() -> Iterable[SegmenterSpec]:
    """This file's segmenter."""
    yield SegmenterSpec(name="given", summary="the recording's own masks", factory=lambda: given)
