"""Messages of ROS 1 and 2 bags and MCAP files, read by `rosbags` without ROS."""

from __future__ import annotations

import struct
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hecbench.errors import InputError
from hecbench.lens import EQUIDISTANT, OPENCV, CameraModel
from hecbench_datasets.reading.sources import files_in

Picture = NDArray[np.uint8]
Wide = NDArray[np.uint16]

SUFFIXES = (".bag", ".mcap", ".db3")
IMAGE, COMPRESSED = "sensor_msgs/msg/Image", "sensor_msgs/msg/CompressedImage"
CAMERA_INFO, JOINTS = "sensor_msgs/msg/CameraInfo", "sensor_msgs/msg/JointState"
TF = ("tf2_msgs/msg/TFMessage", "tf/msg/tfMessage")
POSES = ("geometry_msgs/msg/PoseStamped", "geometry_msgs/msg/TransformStamped")
_MODELS = {
    "plumb_bob": (OPENCV, 5),
    "rational_polynomial": (OPENCV, 8),
    "equidistant": (EQUIDISTANT, 4),
    "fisheye": (EQUIDISTANT, 4),
    "": (OPENCV, 5),
}
"""REP 107's names of lenses, and how many coefficients they have."""
_CHANNELS = {"mono8": 1, "8UC1": 1, "rgb8": 3, "bgr8": 3, "8UC3": 3, "rgba8": 4, "bgra8": 4}
_BAYER = {"bayer_rggb8": "BG", "bayer_bggr8": "RG", "bayer_gbrg8": "GR", "bayer_grbg8": "GB"}
"""OpenCV names a pattern by the second row's second and third pixel."""
_YUV = {"yuv422": "UYVY", "uyvy": "UYVY", "yuv422_yuy2": "YUY2", "yuyv": "YUY2"}
_WIDE = ("mono16", "16UC1")


def bag_files(path: Path) -> list[Path]:
    """What `rosbags` is to open: a file, a ROS 2 bag's folder, or the bags in a folder; none when there is no bag."""
    if path.is_file():
        return [path] if path.suffix.lower() in SUFFIXES else []
    if (path / "metadata.yaml").is_file() and files_in(path, ".mcap", ".db3"):
        return [path]
    return next((found for suffix in SUFFIXES if (found := files_in(path, suffix))), [])


@contextmanager
def opened(path: Path) -> Iterator[Any]:
    """A reader of all messages in order of time.

    Raises:
        InputError: `rosbags` is not installed, or the bag is damaged.
    """
    try:
        from rosbags.highlevel import AnyReader
        from rosbags.typesys import Stores, get_typestore
    except ImportError:
        raise InputError(f"{path}: a bag needs pip install 'hecbench[bags]'") from None
    try:
        with AnyReader(bag_files(path), default_typestore=get_typestore(Stores.ROS2_HUMBLE)) as reader:
            yield reader
    except InputError:
        raise
    except Exception as error:  # a damaged bag raises nearly anything
        reason = " ".join(str(error).split()) or type(error).__name__
        raise InputError(f"{path}: is no readable bag ({reason}); reindex it, or record it again") from error


def header_stamp_s(raw: bytes, ros2: bool, received_ns: int) -> float:
    """The stamp of a message that begins with a header, without decoding it; when it was received if that is empty."""
    seconds, nanoseconds = struct.unpack_from("<II", raw, 4)
    return seconds + 1e-9 * nanoseconds if seconds or nanoseconds else 1e-9 * received_ns


def camera_model(info: Any, topic: str) -> CameraModel | None:
    """The lens of a camera_info; None when it holds none.

    Raises:
        InputError: its lens model is not known and has coefficients, or it is of a cut or binned picture.
    """
    K = np.array(getattr(info, "K", getattr(info, "k", None)), float).reshape(3, 3)
    lens = np.array(getattr(info, "D", getattr(info, "d", ())), float)
    if K[0, 0] <= 0:
        return None
    if lens.any() and info.distortion_model not in _MODELS:
        known = ", ".join(filter(None, _MODELS))
        raise InputError(f"{topic}: distortion_model '{info.distortion_model}' is not one of {known}")
    cut = (info.roi.width, info.roi.height) not in ((0, 0), (info.width, info.height))
    if info.binning_x > 1 or info.binning_y > 1 or cut:
        raise InputError(f"{topic}: is of a binned or cut picture; give the camera in hecbench-import.yaml")
    if not lens.any():
        return CameraModel(info.width, info.height, K)
    model, length = _MODELS[info.distortion_model]
    if model == EQUIDISTANT or not lens[length:].any():  # image_geometry too gives OpenCV all that are there
        lens = lens[:length]
    return CameraModel(info.width, info.height, K, lens, model)


def picture_of(message: Any, topic: str) -> Picture | Wide | bytes:
    """A picture (H, W, 3) RGB or (H, W), grey ones of 8 or 16 bits, or the bytes of a compressed one.

    Raises:
        InputError: its encoding is not known, or its size does not fit.
    """
    if not hasattr(message, "encoding"):
        return bytes(message.data)
    encoding = str(message.encoding)
    if encoding in _WIDE:
        wide = np.frombuffer(message.data.tobytes(), ">u2" if message.is_bigendian else "<u2")
        return np.asarray(wide.reshape(message.height, -1)[:, : message.width], np.uint16)
    channels = 1 if encoding in _BAYER else 2 if encoding in _YUV else _CHANNELS.get(encoding)
    if channels is None:
        raise InputError(
            f"{topic}: encoding '{encoding}' is not read; record it as rgb8, mono8 or compressed"
        )
    rows = np.asarray(message.data, np.uint8).reshape(message.height, message.step)[
        :, : message.width * channels
    ]
    pixels = np.ascontiguousarray(rows).reshape(message.height, message.width, channels)
    if encoding in _BAYER or encoding in _YUV:
        import cv2

        code = f"Bayer{_BAYER[encoding]}2RGB" if encoding in _BAYER else f"YUV2RGB_{_YUV[encoding]}"
        return np.asarray(cv2.cvtColor(pixels, getattr(cv2, f"COLOR_{code}")), np.uint8)
    pixels = pixels[..., 2::-1] if encoding.startswith("bgr") or encoding == "8UC3" else pixels[..., :3]
    return np.ascontiguousarray(pixels[..., 0] if channels == 1 else pixels)


def eight_bit(picture: Picture | Wide, brightest: int) -> Picture:
    """A picture of a stream whose largest value is `brightest`, with 8 of its 8 to 16 bits."""
    return np.asarray(picture >> max(0, brightest.bit_length() - 8), np.uint8)


def small(picture: Picture | Wide | bytes) -> NDArray[np.float32] | None:
    """A small grey picture to compare with the next; None when it cannot be decoded."""
    import cv2

    if isinstance(picture, bytes):
        grey = cv2.imdecode(np.frombuffer(picture, np.uint8), cv2.IMREAD_REDUCED_GRAYSCALE_8)
        if grey is None:
            return None
    else:
        grey = picture if picture.ndim == 2 else picture[..., 1]
    return np.asarray(cv2.resize(grey, (64, 48), interpolation=cv2.INTER_AREA), np.float32)
