"""The digest of a recording's content."""

from __future__ import annotations

import hashlib
from collections.abc import Mapping
from dataclasses import fields
from pathlib import Path
from typing import Any

import numpy as np

from hecbench.lens import OPENCV


def digest_of(content: Mapping[str, Any]) -> str:
    """SHA-256 of names and values: arrays, descriptions, and the bytes of the files that exist."""
    digest = hashlib.sha256()
    for name, value in content.items():
        digest.update(name.encode())
        _update(digest, value)
    return digest.hexdigest()


def _update(digest: Any, value: Any) -> None:
    if isinstance(value, np.ndarray):
        digest.update(str(value.shape).encode() + np.ascontiguousarray(value).tobytes())
    elif isinstance(value, Path):
        digest.update(value.read_bytes() if value.is_file() else value.name.encode())
    elif isinstance(value, tuple):
        for part in value:
            _update(digest, part)
    elif hasattr(value, "__dataclass_fields__"):
        for item in fields(value):
            part = getattr(value, item.name)
            if (
                item.name != "distortion_model" or part != OPENCV
            ):  # 0.1 had no such field: digests stay the same
                _update(digest, part)
    else:
        digest.update(repr(value).encode())
