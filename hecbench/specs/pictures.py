"""What reads the robot out of pictures."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, ClassVar, Protocol

import numpy as np
from numpy.typing import NDArray

from hecbench.specs.base import ConfigurableSpec, Kind, Spec

if TYPE_CHECKING:
    from hecbench.recording import Recording


@dataclass(frozen=True, kw_only=True)
class SegmenterSpec(ConfigurableSpec):
    """Robot masks. `factory()` returns a function recording -> recording with `masks`."""

    kind: ClassVar[Kind] = Kind.SEGMENTER
    factory: Callable[..., Callable[[Recording], Recording]]


class Translator(Protocol):
    """Turns a picture of the real robot into one as the renderer would draw it: flat colours on black."""

    def __call__(
        self,
        image: NDArray[np.float32],
        mask: NDArray[np.float32],
        *,
        part: NDArray[np.int32],
        colours: NDArray[np.float64],
    ) -> NDArray[np.float32]:
        """The picture (H, W, 3) in [0, 1].

        Args:
            image: (H, W, 3) in [0, 1], undistorted, not cut out.
            mask: (H, W) in [0, 1], the robot's.
            part: (H, W) of the robot drawn at the current pose, -1 where it is not.
            colours: (P, 3) of the parts in the robot's model.
        """
        ...


@dataclass(frozen=True, kw_only=True)
class TranslatorSpec(ConfigurableSpec):
    """Image translation. One that `follows_pose` reads `part`, and is asked again as the pose improves."""

    kind: ClassVar[Kind] = Kind.TRANSLATOR
    factory: Callable[..., Translator]
    follows_pose: bool = False


class RobotSight(Protocol):
    """What a network sees of the robot in one picture of H x W px."""

    @property
    def keypoints(self) -> NDArray[np.float64]:
        """(K, 2) px, of the points that `Perceiver.keypoint_positions` places."""
        ...

    @property
    def trust(self) -> NDArray[np.float64]:
        """(K,) in [0, 1]: how sure each keypoint is."""
        ...

    def visible(self) -> NDArray[np.float32]:
        """(H, W) in [0, 1]: the robot where nothing hides it; all 0 when there is none."""
        ...

    def whole(self) -> NDArray[np.float32]:
        """(H, W) in [0, 1]: the robot as if nothing hid it."""
        ...

    def colours(self) -> NDArray[np.float32]:
        """(H, W, 3) RGB in [0, 1]: the colours of the robot's model, wherever it may be."""
        ...


class Perceiver(Protocol):
    """A trained network that finds a robot in photographs."""

    def see(self, image: NDArray[np.uint8]) -> RobotSight:
        """What is in a picture (H, W, 3) RGB."""
        ...

    def keypoint_positions(
        self, robot: str, links: Sequence[str], frame_T_link: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """(..., K, 3) m of the robot's keypoints, in the frame of frame_T_link (..., L, 4, 4) of its links."""
        ...


@dataclass(frozen=True, kw_only=True)
class PerceptionSpec(Spec):
    """A trained network. `factory()` loads its weights. `robots` are those that it knows, by name or URDF's name."""

    kind: ClassVar[Kind] = Kind.PERCEPTION
    robots: tuple[str, ...]
    factory: Callable[[], Perceiver]
