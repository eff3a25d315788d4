"""Drawing without a display: an offscreen OpenGL context on EGL or OSMesa, whichever this machine has."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from hecbench.errors import HecbenchError

CURE = "apt install libegl1 libgl1 libgl1-mesa-dri (or libosmesa6), then `hecbench doctor`"


def open_context(width: int, height: int) -> Any:
    """A current offscreen context of that size.

    Raises:
        HecbenchError: MuJoCo or the graphics libraries are missing; the message says how to get them.
    """
    try:
        import mujoco  # noqa: F401
    except ImportError:
        raise HecbenchError("the lab needs mujoco: pip install 'hecbench[lab]'") from None
    failures = []
    for name, make in (("EGL", _egl), ("OSMesa", _osmesa)):
        try:
            context = make(width, height)
            context.make_current()
            return context
        except Exception as error:  # each platform's loader raises its own errors
            failures.append(f"{name}: {(str(error) or type(error).__name__).splitlines()[0]}")
    raise HecbenchError(f"the lab cannot draw ({'; '.join(failures)}): {CURE}")


def _egl(width: int, height: int) -> Any:
    from mujoco.egl import GLContext

    return GLContext(width, height)


def _osmesa(width: int, height: int) -> Any:
    from mujoco.osmesa import GLContext

    return GLContext(width, height)


class Canvas:
    """Draws scenes of one model into arrays up to one size."""

    def __init__(self, model: Any, width: int, height: int) -> None:
        """Open a context; `model` is a MuJoCo model, which is told the size."""
        import mujoco

        self._context = open_context(width, height)
        model.vis.global_.offwidth, model.vis.global_.offheight = width, height
        self._renderer = mujoco.MjrContext(model, mujoco.mjtFontScale.mjFONTSCALE_100)
        mujoco.mjr_setBuffer(mujoco.mjtFramebuffer.mjFB_OFFSCREEN, self._renderer)
        self._reversed = self._renderer.readDepthMap == mujoco.mjtDepthMap.mjDEPTH_ZEROFAR
        if (self._renderer.offWidth, self._renderer.offHeight) != (width, height):
            self.close()
            raise HecbenchError(f"this machine's OpenGL cannot draw {width}x{height} px: supersample less")

    def draw(self, view: Any, width: int, height: int) -> NDArray[np.uint8]:
        """(height, width, 3) RGB of a MuJoCo scene."""
        import mujoco

        self._context.make_current()
        image = np.empty((height, width, 3), np.uint8)
        viewport = mujoco.MjrRect(0, 0, width, height)
        mujoco.mjr_render(viewport, view, self._renderer)
        mujoco.mjr_readPixels(image, None, viewport, self._renderer)
        return image[::-1]

    def depth(self, view: Any, width: int, height: int, near_m: float, far_m: float) -> NDArray[np.float32]:
        """(height, width) m along the optical axis, `far_m` where nothing is."""
        import mujoco

        self._context.make_current()
        stored = np.empty((height, width), np.float32)
        viewport = mujoco.MjrRect(0, 0, width, height)
        mujoco.mjr_render(viewport, view, self._renderer)
        mujoco.mjr_readPixels(None, stored, viewport, self._renderer)
        away = stored[::-1] if self._reversed else 1 - stored[::-1]
        return np.asarray(near_m * far_m / (near_m + away * (far_m - near_m)), np.float32)

    def close(self) -> None:
        """Give the context back. May be called twice."""
        if self._context is not None:
            self._context.make_current()
            self._renderer.free()
            self._context.free()
            self._context = None
