"""What is installed, what is missing, and the command that gets it."""

from __future__ import annotations

import sys
from ctypes.util import find_library
from dataclasses import asdict, dataclass
from importlib import metadata
from importlib.util import find_spec

from hecbench import __version__, registry
from hecbench.registry import PluginStatus

_EXTRAS = {
    "torch": ("torch", "pytorch_kinematics", "safetensors", "onnx"),
    "sam": ("onnxruntime",),
    "ur": ("rtde_control",),
    "lab": ("mujoco",),
    "cameras": ("pypylon",),
    "viewer": ("viser",),
    "parquet": ("pyarrow",),
    "cluster": ("distributed",),
}
_REQUIRED = ("numpy", "scipy", "numba", "opencv-contrib-python-headless", "airo-models")
_OPENCV_CURE = "pip install 'opencv-contrib-python-headless<5' (version 5 has no calibrateHandEye)"


@dataclass(frozen=True)
class Finding:
    """One line of the examination: `state` is ok, missing, broken or conflict."""

    subject: str
    state: str
    version: str = ""
    cure: str = ""

    def row(self) -> dict[str, str]:
        """As JSON."""
        return asdict(self)


def examine() -> list[Finding]:
    """Python, required packages, OpenCV's functions, optional extras and plugins that are not ready."""
    python = sys.version_info
    supported = python[:2] >= (3, 11)
    return [
        Finding("hecbench", "ok", __version__),
        Finding(
            "python",
            "ok" if supported else "broken",
            f"{python.major}.{python.minor}.{python.micro}",
            "" if supported else "use Python 3.11 or newer",
        ),
        *(_package(name) for name in _REQUIRED),
        _opencv_functions(),
        *(_extra(name, modules) for name, modules in _EXTRAS.items()),
        _offscreen_graphics(),
        *(
            Finding(f"plugin {plugin.name}", plugin.status, plugin.version, plugin.detail)
            for plugin in registry.load().plugins
            if plugin.status is not PluginStatus.READY
        ),
    ]


def _package(name: str) -> Finding:
    try:
        return Finding(name, "ok", metadata.version(name))
    except metadata.PackageNotFoundError:
        return Finding(name, "missing", cure=f"pip install {name}")


def _opencv_functions() -> Finding:
    try:
        import cv2
    except ImportError as error:
        return Finding("cv2.calibrateHandEye", "broken", cure=f"{error}: {_OPENCV_CURE}")
    complete = hasattr(cv2, "calibrateHandEye") and hasattr(cv2, "calibrateRobotWorldHandEye")
    state, cure = ("ok", "") if complete else ("missing", _OPENCV_CURE)
    return Finding("cv2.calibrateHandEye", state, cv2.__version__, cure)


def _offscreen_graphics() -> Finding:
    """The library with which the virtual lab draws without a display."""
    for name in ("EGL", "OSMesa"):
        if library := find_library(name):
            return Finding("offscreen OpenGL", "ok", f"{name}, {library}")
    cure = "apt install libegl1 libgl1 libgl1-mesa-dri (or libosmesa6); only pictures of the lab need it"
    return Finding("offscreen OpenGL", "missing", cure=cure)


def _extra(name: str, modules: tuple[str, ...]) -> Finding:
    if all(find_spec(module) is not None for module in modules):
        return Finding(f"extra {name}", "ok")
    return Finding(f"extra {name}", "missing", cure=f"pip install 'hecbench[{name}]'")
