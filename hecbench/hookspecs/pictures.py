"""Hooks of what reads the robot out of pictures."""

from __future__ import annotations

from collections.abc import Iterable

from hecbench.hookspecs.marker import hookspec
from hecbench.specs import PerceptionSpec, SegmenterSpec, TranslatorSpec


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
