"""Translation by the network that finds the robot: each pixel gets the colour of the model that it most likely is.

The shares of the model's colours, as if there were a robot, weigh the colours; the mask says where there is one. The
pose is not read, so a wrong one is not translated into a right one.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from hecbench.registry import hookimpl
from hecbench.specs import TranslatorSpec
from hecbench_plugins.perception.options import MODEL_OPTION

Picture = NDArray[np.float32]


@dataclass(frozen=True)
class Learned:
    """The translator. `model` names a perception plugin or a folder; None: the first that is installed."""

    model: str | None = None

    def __call__(
        self, image: Picture, mask: Picture, *, part: NDArray[np.int32], colours: NDArray[np.float64]
    ) -> Picture:
        """The image in the colours of the network's robots, black where the mask is 0."""
        from hecbench_plugins.perception.choice import perceiver_by_option

        sight = perceiver_by_option(self.model).see(np.rint(np.clip(image, 0, 1) * 255).astype(np.uint8))
        return np.asarray(sight.colours() * mask[..., None], np.float32)


@hookimpl
def hecbench_translators() -> Iterable[TranslatorSpec]:
    """This file's method."""
    yield TranslatorSpec(
        name="learned",
        summary="a network trained on drawn pictures of the robot says which of its colours each pixel has",
        factory=Learned,
        options=(MODEL_OPTION,),
    )
