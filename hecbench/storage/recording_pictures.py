"""Pictures of a recording as files in its folder."""

from __future__ import annotations

from collections.abc import Callable
from itertools import count
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hecbench.recording import ImageSource
from hecbench.system import files, pictures


def store_pictures(
    sources: tuple[ImageSource, ...] | None, folder: Path, kind: str, ids: tuple[str, ...]
) -> list[str | None]:
    """Names of the files in the folder; pictures in memory or elsewhere are written there.

    Args:
        sources: one for each sample.
        folder: of the recording.
        kind: "images", "masks" or "depths", the folder below it.
        ids: of the samples.
    """
    if sources is None:
        return [None] * len(ids)
    stored = {
        source: source.resolve().relative_to(folder.resolve()).as_posix()
        for source in sources
        if isinstance(source, Path) and source.resolve().is_relative_to(folder.resolve())
    }
    taken = {name.casefold() for name in stored.values()}
    names: list[str | None] = []
    for sample_id, source in zip(ids, sources, strict=True):
        if source is None:
            names.append(None)
        elif isinstance(source, np.ndarray):
            name = _free_name(kind, f"{files.safe_name(sample_id)}.png", taken)
            where = f"samples[{len(names)}].{kind.removesuffix('s')}"
            files.write_bytes(folder / name, pictures.encode_png(_STORED[kind](source, where)))
            names.append(name)
        else:
            if source not in stored:
                stored[source] = _free_name(kind, files.safe_name(source.name), taken)
                files.write_bytes(folder / stored[source], files.read_bytes(source))
            names.append(stored[source])
    return names


def _mask_picture(mask: NDArray[Any], where: str) -> NDArray[np.uint8]:
    return pictures.mask(mask, where).astype(np.uint8) * np.uint8(255)


def _depth_picture(depth: NDArray[Any], where: str) -> NDArray[np.uint16]:
    return np.asarray(np.rint(1e3 * pictures.depth(depth, where)), np.uint16)


_STORED: dict[str, Callable[[NDArray[Any], str], NDArray[Any]]] = {
    "images": pictures.image,
    "masks": _mask_picture,
    "depths": _depth_picture,
}


def _free_name(kind: str, name: str, taken: set[str]) -> str:
    """A name below `kind` that no other picture has, on file systems that ignore case too."""
    stem, suffix = Path(name).stem, Path(name).suffix
    tries = (f"{kind}/{stem}{'' if i == 1 else f'_{i}'}{suffix}" for i in count(1))
    free = next(path for path in tries if path.casefold() not in taken)
    taken.add(free.casefold())
    return free
