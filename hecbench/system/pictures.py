"""Images and masks as arrays of one kind, whatever file or array they come in. Nothing else decodes an image."""

from __future__ import annotations

import io
import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hecbench.errors import InputError
from hecbench.system import files

Image = NDArray[np.uint8]

FORMATS = ("PNG", "JPEG", "BMP", "TIFF", "PPM", "WEBP")
"""Of Pillow's readers; others start programs (EPS) or read several files."""
_MOST_PIXELS = 80_000_000
"""The largest industrial sensors have 65 million. Pillow's own limit is 89 million."""
_EXIF_ORIENTATION = 0x0112
_HALF_A_STEP = 0.5 / 255
"""Of floats beyond 0..1: what rounding to 8 bits forgives."""
_DARK_OF_16_BITS = 4096
"""A 16-bit picture without a value above this holds 12 bits or fewer, and would be black when scaled."""


def size(path: Path) -> tuple[int, int]:
    """Width and height, px, as the image is shown (EXIF orientation), without decoding it.

    Raises:
        InputError: it is no image of a known format.
    """
    with _opened(files.read_bytes(path), str(path)) as picture:
        width, height = picture.size
        return (height, width) if picture.getexif().get(_EXIF_ORIENTATION, 1) >= 5 else (width, height)


def image(source: Path | bytes | NDArray[Any], where: str) -> Image:
    """An image as (height, width, 3) RGB of 8 bits.

    16-bit pictures are scaled from 0..65535, floats from 0..1; grey becomes three equal channels, alpha is
    dropped, and the EXIF orientation is honoured, as OpenCV does.

    Args:
        source: a file, its bytes, or an array (height, width[, channels]).
        where: for the error: what the image is.

    Raises:
        InputError: it is unreadable, larger than 80 million pixels, or its values fit no scale.
    """
    array = source if isinstance(source, np.ndarray) else _decoded(source, where)
    if array.ndim == 2:
        array = np.repeat(array[..., None], 3, 2)
    if array.ndim != 3 or array.shape[2] not in (3, 4):
        raise InputError(f"{where}: is an array of shape {array.shape}; give height x width x 3 (RGB)")
    return _eight_bit(array[..., :3], where)


def mask(source: Path | bytes | NDArray[Any], where: str) -> NDArray[np.bool_]:
    """A mask as (height, width), True on the robot: above 127, or the other of two values where 0 is one.

    Args:
        source: a file, its bytes, or an array (height, width).
        where: for the error: what the mask is.

    Raises:
        InputError: it is unreadable, or a label image with several labels.
    """
    array = source if isinstance(source, np.ndarray) else _decoded(source, where, indexed=True)
    if array.ndim == 3:
        array = _grey(array)
    if array.ndim != 2:
        raise InputError(f"{where}: is an array of shape {array.shape}; give height x width")
    if array.dtype == np.bool_:
        return np.asarray(array)
    small = array.dtype.kind in "iu" and array.size > 0 and array.min() >= 0 and array.max() <= 255
    grey = np.asarray(array, np.uint8) if small else _eight_bit(array, where)
    counts = np.bincount(grey.ravel(), minlength=256)
    labels = np.flatnonzero(counts[1:128]) + 1
    if counts[1:128].sum() <= counts[128:].sum():
        return np.asarray(grey > 127)
    if len(labels) == 1 and not counts[128:].any():
        return np.asarray(grey > 0)
    shown = ", ".join(str(value) for value in labels[:4]) + (", ..." if len(labels) > 4 else "")
    raise InputError(f"{where}: the mask holds 0, {shown}: a label image? write 255 = robot, 0 = all else")


def depth(source: Path | bytes | NDArray[Any], where: str) -> NDArray[np.float32]:
    """A depth picture as (height, width) m, 0 where unknown, from 16 bits of millimetres.

    Raises:
        InputError: it is unreadable, has colours or 8 bits, or holds floats.
    """
    array = source if isinstance(source, np.ndarray) else _decoded(source, where)
    if array.ndim != 2:
        raise InputError(
            f"{where}: has {array.shape[-1]} channels; give depth as a 16-bit grey PNG in millimetres"
        )
    if array.dtype == np.uint8:
        raise InputError(
            f"{where}: has 8 bits, a picture of depth rather than depth; give a 16-bit grey PNG in millimetres"
        )
    if array.dtype.kind not in "iu" or (array.size and (array.min() < 0 or array.max() > 65535)):
        raise InputError(
            f"{where}: holds {array.dtype} from {array.min():g} to {array.max():g}; multiply metres by 1000 and save a"
            " 16-bit PNG"
        )
    return np.asarray(array, np.float32) * np.float32(1e-3)


@contextmanager
def _opened(content: bytes, where: str) -> Iterator[Any]:
    """Pillow's picture of the bytes, whose errors inside the block become an `InputError`."""
    from PIL import Image as Pillow
    from PIL import UnidentifiedImageError

    with warnings.catch_warnings():
        warnings.simplefilter("error", Pillow.DecompressionBombWarning)
        try:
            with Pillow.open(io.BytesIO(content), formats=FORMATS) as picture:
                width, height = picture.size
                if width * height > _MOST_PIXELS:
                    raise InputError(f"{where}: {width}x{height} px are too many; scale the image down")
                yield picture
        except InputError:
            raise
        except UnidentifiedImageError:
            raise InputError(
                f"{where}: cannot be read as an image (none of {', '.join(FORMATS)}); restore the file"
            ) from None
        except Exception as error:  # damaged files raise a dozen kinds
            reason = (str(error) or type(error).__name__).splitlines()[0]
            raise InputError(f"{where}: cannot be read as an image ({reason}); restore the file") from error


def _decoded(source: Path | bytes, where: str, indexed: bool = False) -> NDArray[Any]:
    """The values as stored: (height, width) for grey, (height, width, 3) for RGB.

    Args:
        source: the file or its bytes.
        where: for the error.
        indexed: the indices of a coloured palette instead of its colours; alpha counts as brightness.
    """
    from PIL import ImageOps

    content = files.read_bytes(source) if isinstance(source, Path) else source
    with _opened(content, where) as opened:
        picture = ImageOps.exif_transpose(opened)
        if picture.mode in ("L", "F", "I") or picture.mode.startswith("I;16"):
            return np.asarray(picture)
        if picture.mode == "1":
            return np.asarray(picture.convert("L"))
        if indexed and picture.mode == "P" and not _grey_palette(picture):
            return np.asarray(picture)
        if indexed and picture.has_transparency_data:
            values = np.asarray(picture.convert("RGBA"))
            return np.asarray(_grey(values[..., :3]) * (values[..., 3] / 255.0), np.uint8)
        return np.asarray(picture.convert("RGB"))


def _grey_palette(picture: Any) -> bool:
    palette = np.asarray(picture.getpalette("RGB"), np.uint8).reshape(-1, 3)
    return bool((palette == palette[:, :1]).all())


def _grey(array: NDArray[Any]) -> NDArray[Any]:
    """The brightest channel, so that a saturated colour counts as bright."""
    return np.asarray(array[..., :3].max(2))


def _eight_bit(array: NDArray[Any], where: str) -> Image:
    """Values of any type scaled to 0..255."""
    if array.dtype == np.uint8:
        return np.ascontiguousarray(array, np.uint8)
    if array.dtype == np.bool_:
        return np.asarray(array, np.uint8) * np.uint8(255)
    low, high = (float(array.min()), float(array.max())) if array.size else (0.0, 0.0)
    if array.dtype.kind == "f":
        if not np.isfinite(array).all():
            raise InputError(f"{where}: the image holds values that are not finite")
        if low <= -_HALF_A_STEP or high >= 1 + _HALF_A_STEP:
            raise InputError(f"{where}: holds floats from {low:g} to {high:g}; scale them to 0..1")
        return np.asarray(np.round(255 * array), np.uint8)
    if array.dtype.kind not in "iu" or low < 0 or high > 65535:
        raise InputError(f"{where}: holds {array.dtype} from {low:g} to {high:g}; save 8 or 16 bits")
    if 0 < high < _DARK_OF_16_BITS:
        raise InputError(
            f"{where}: the values of this 16-bit image end at {high:g} of 65535; scale them to the full range"
        )
    return np.asarray((np.asarray(array, np.uint32) * 255 + 32767) // 65535, np.uint8)


def encode_png(picture: NDArray[np.uint8] | NDArray[np.uint16]) -> bytes:
    """PNG bytes of (H, W, 3) RGB, or (H, W) grey of 8 or 16 bits."""
    from PIL import Image

    stream = io.BytesIO()
    Image.fromarray(picture).save(stream, "PNG")
    return stream.getvalue()
