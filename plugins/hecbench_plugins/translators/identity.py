"""No translation: the picture cut out by its mask. Right for pictures that are simulated already."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from hecbench.registry import hookimpl
from hecbench.specs import TranslatorSpec

Picture = NDArray[np.float32]


def identity(
    image: Picture, mask: Picture, *, part: NDArray[np.int32], colours: NDArray[np.float64]
) -> Picture:
    """The image, black where the mask is 0."""
    return np.asarray(image * mask[..., None], np.float32)


@hookimpl
def hecbench_translators() -> Iterable[TranslatorSpec]:
    """This file's method."""
    yield TranslatorSpec(
        name="identity", summary="the picture as it is, cut out by its mask", factory=lambda: identity
    )
