"""The files of a LeRobot dataset, v2.1 and v3.0: what an episode's rows and pictures are, read without `lerobot`."""

from __future__ import annotations

import io
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from hecbench.errors import InputError
from hecbench.se3 import Array
from hecbench.system import files, pictures
from hecbench_datasets.reading.sources import finite, head, item, json_value

INFO = Path("meta") / "info.json"
STATE = "observation.state"
_VERSIONS = ("v2.0", "v2.1", "v3.0")


@dataclass(frozen=True, eq=False)
class Episode:
    """One episode's rows, and where its pictures are.

    Attributes:
        state: (N, J) as recorded.
        names: of the state's columns.
        stamps: (N,) s from the episode's start.
    """

    root: Path
    info: dict[str, Any]
    index: int
    state: Array
    names: tuple[str, ...]
    stamps: Array
    table: Any
    videos: dict[str, tuple[Path, float]]

    def picture(self, camera: str, rows: Sequence[int]) -> list[NDArray[np.uint8]]:
        """Pictures (H, W, 3) RGB of some rows of a camera.

        Raises:
            InputError: the video or a picture cannot be decoded.
        """
        if camera not in self.videos:
            cells = self.table[camera].to_pylist()
            return [
                pictures.image(_bytes_of(self.root, cells[row]), f"{self.root}: row {row}") for row in rows
            ]
        file, start = self.videos[camera]
        return decoded(file, [start + float(self.stamps[row]) for row in rows], float(self.info["fps"]))


def is_dataset(root: Path) -> bool:
    """Whether a folder is the root of a LeRobot dataset."""
    return '"codebase_version"' in head(root / INFO)


def description(root: Path) -> dict[str, Any]:
    """The set's info.json.

    Raises:
        InputError: its version is not known.
    """
    info = json_value(root / INFO)
    version = item(info, "codebase_version", root / INFO)
    if version not in _VERSIONS:
        raise InputError(
            f"{root / INFO}: codebase_version '{version}' is not one of {', '.join(_VERSIONS)}; convert it"
        )
    return dict(info)


def cameras(info: dict[str, Any]) -> list[str]:
    """Keys of the colour cameras."""
    return [
        key
        for key, feature in info["features"].items()
        if feature.get("dtype") in ("video", "image") and "depth" not in key.lower()
    ]


def episode(root: Path, info: dict[str, Any], index: int) -> Episode:
    """One episode.

    Raises:
        InputError: there is none of that number, or its files are damaged.
    """
    count = int(item(info, "total_episodes", root / INFO))
    if not 0 <= index < count:
        raise InputError(f"{root}: has no episode {index}; it has {count}, from 0")
    chunk = index // int(info.get("chunks_size", 1000))
    keys = [key for key in cameras(info) if info["features"][key]["dtype"] == "video"]
    if info["codebase_version"] == "v3.0":
        row = _episode_row(root, index)
        place = {"chunk_index": row["data/chunk_index"], "file_index": row["data/file_index"]}
        table = _parquet(_below(root, info["data_path"].format(**place)))
        table = table.filter(_equal(table["episode_index"], index))
        videos = {key: _video(root, info, key, row) for key in keys}
    else:
        place = {"episode_chunk": chunk, "episode_index": index}
        table = _parquet(_below(root, info["data_path"].format(**place)))
        videos = {key: (_below(root, info["video_path"].format(video_key=key, **place)), 0.0) for key in keys}
    source = f"{root}: episode {index}"
    if STATE not in table.column_names:
        raise InputError(f"{source}: has no {STATE}; the joints are read from it")
    state = finite(table[STATE].to_pylist(), f"{source}: {STATE}")
    stamps = finite(table["timestamp"].to_pylist(), f"{source}: timestamp")
    return Episode(root, info, index, state, _names(info, state.shape[1]), stamps, table, videos)


def _video(root: Path, info: dict[str, Any], key: str, row: dict[str, Any]) -> tuple[Path, float]:
    """The file of v3.0 that holds an episode's video among others', and where it starts, s."""
    place = {name: row[f"videos/{key}/{name}"] for name in ("chunk_index", "file_index")}
    file = _below(root, info["video_path"].format(video_key=key, **place))
    return file, float(row[f"videos/{key}/from_timestamp"])


def _names(info: dict[str, Any], count: int) -> tuple[str, ...]:
    names = info["features"][STATE].get("names") or ()
    if isinstance(names, dict):
        names = next(iter(names.values()), ())
    return tuple(str(name).removesuffix(".pos") for name in names) if len(names) == count else ("",) * count


def _episode_row(root: Path, index: int) -> dict[str, Any]:
    for file in sorted((root / "meta" / "episodes").glob("*/*.parquet")):
        table = _parquet(file)
        found = table.filter(_equal(table["episode_index"], index)).to_pylist()
        if found:
            return dict(found[0])
    raise InputError(f"{root / 'meta' / 'episodes'}: lists no episode {index}; fetch the set again")


def _equal(column: Any, value: int) -> Any:
    import pyarrow.compute

    return pyarrow.compute.equal(column, value)


def _parquet(file: Path) -> Any:
    import pyarrow
    import pyarrow.parquet

    try:
        return pyarrow.parquet.read_table(io.BytesIO(files.read_bytes(file)))
    except pyarrow.ArrowException as error:
        reason = str(error).splitlines()[0]
        raise InputError(f"{file}: is no readable Parquet file ({reason}); fetch it again") from error


def _below(root: Path, name: str) -> Path:
    """A file of the set by the name that the set gives it; links are followed, as hubs keep their files elsewhere."""
    if Path(name).is_absolute() or ".." in Path(name).parts:
        raise InputError(f"{root / INFO}: '{name}' leaves the set's folder; correct it")
    return root / name


def _bytes_of(root: Path, cell: Any) -> bytes:
    return cell["bytes"] if cell.get("bytes") else files.read_bytes(_below(root, cell["path"]))


def decoded(file: Path, times: Sequence[float], fps: float) -> list[NDArray[np.uint8]]:
    """Frames (H, W, 3) RGB of a video nearest to some times, s, in order.

    Raises:
        InputError: it does not decode, or ends too soon.
    """
    import av

    if not file.is_file():
        raise InputError(f"{file}: does not exist; fetch the set's videos")
    wanted = sorted(set(times))
    found: dict[float, NDArray[np.uint8]] = {}
    try:
        with av.open(str(file)) as container:
            stream = container.streams.video[0]
            container.seek(max(int((wanted[0] - 1 / fps) / stream.time_base), 0), stream=stream)
            for frame in container.decode(stream):
                while wanted and frame.time is not None and frame.time > wanted[0] - 0.5 / fps:
                    found[wanted.pop(0)] = np.asarray(frame.to_ndarray(format="rgb24"), np.uint8)
                if not wanted:
                    break
    except InputError:
        raise
    except Exception as error:  # a damaged video raises nearly anything
        raise InputError(
            f"{file}: does not decode ({' '.join(str(error).split())}); fetch it again"
        ) from error
    if wanted:
        raise InputError(f"{file}: ends before {wanted[0]:.2f} s, where its episode has rows; fetch it again")
    return [found[time] for time in times]
