"""Other people's files as plain values; every fault is an `InputError` that names the file."""

from __future__ import annotations

import csv
import io
import re
import zipfile
from collections.abc import Callable
from dataclasses import dataclass
from functools import wraps
from pathlib import Path
from typing import Any

import msgspec
import numpy as np
from numpy.typing import ArrayLike

from hecbench.errors import InputError
from hecbench.recording import Recording
from hecbench.se3 import Array
from hecbench.system import files

_MOST_PARTS = 2_000_000
"""Values of one file: a recording of 10,000 samples with 40 corners each has half of that."""
_DEEPEST = 1000
YAML_SUFFIXES = (".yaml", ".yml")
IMAGE_SUFFIXES = (".png", ".jpg", ".jpeg", ".bmp", ".tif", ".tiff")


def foreign(load: Callable[[Path], Recording]) -> Callable[[Path], Recording]:
    """A loader whose every complaint is an `InputError` that names the path.

    Other people's files may hold anything anywhere; what a loader does not look for, such as a number in
    place of a list, is said as it was met.
    """

    @wraps(load)
    def guarded(path: Path) -> Recording:
        try:
            return load(path)
        except InputError as error:
            if str(path) in str(error):
                raise
            raise InputError(f"{path}: {error}") from error
        except (AttributeError, LookupError, TypeError, ValueError, OverflowError) as error:
            raise InputError(
                f"{path}: is not laid out as its format is ({type(error).__name__}: {error}); "
                "see docs/adapters.md"
            ) from error

    return guarded


def head(path: Path, count: int = 4096) -> str:
    """The first characters of a file for sniffing; empty when it is none or unreadable."""
    try:
        if not path.is_file():
            return ""
        with path.open("rb") as stream:
            return stream.read(count).decode("utf-8", "replace")
    except (OSError, ValueError):
        return ""


def files_in(folder: Path, *suffixes: str) -> list[Path]:
    """The folder's files with these suffixes in natural order (2 before 10); none when it is no folder."""
    try:
        found = [path for path in folder.iterdir() if path.suffix.lower() in suffixes and path.is_file()]
    except OSError:
        return []
    return sorted(found, key=natural)


@dataclass(frozen=True, kw_only=True)
class FileOfFormat:
    """How the file of a format is found: it is given, or lies in a folder, and its first characters show the format.

    Attributes:
        shows: whether the first characters are those of the format.
        described: what is missing where there is no such file, with the cure.
        names: of the file in a folder.
        suffixes: of the file, instead of names.
        first: how many characters `shows` needs.
    """

    shows: Callable[[str], bool]
    described: str
    names: tuple[str, ...] = ()
    suffixes: tuple[str, ...] = ()
    first: int = 4096

    def find(self, path: Path) -> Path | None:
        """The first such file, if there is one."""
        if self.names:
            candidates = [path, *(path / name for name in self.names)]
        else:
            candidates = [path] if path.suffix.lower() in self.suffixes else files_in(path, *self.suffixes)
        return next((file for file in candidates if self.shows(head(file, self.first))), None)

    def sniff(self, path: Path) -> bool:
        """Whether there is one."""
        return self.find(path) is not None

    def of(self, path: Path) -> Path:
        """The file.

        Raises:
            InputError: there is none.
        """
        file = self.find(path)
        if file is None:
            raise InputError(f"{path}: holds no {self.described}")
        return file


def natural(path: Path | str) -> list[tuple[int, str]]:
    """Sorting key that reads the numbers in a name as numbers."""
    parts = re.findall(r"\d+|\D+", Path(path).name)
    return [(int(part), "") if part.isdecimal() else (-1, part) for part in parts]


def text(path: Path) -> str:
    """The file as text."""
    try:
        return files.read_bytes(path).decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise InputError(f"{path}: is not UTF-8 text ({error.reason}); save it as UTF-8") from error


def json_value(path: Path) -> Any:
    """A JSON file."""
    try:
        return msgspec.json.decode(text(path))
    except (msgspec.MsgspecError, RecursionError) as error:
        raise InputError(f"{path}: is not readable JSON ({error})") from error


def yaml_value(path: Path) -> Any:
    """A YAML file, OpenCV's FileStorage included: its matrices become arrays."""
    return yaml_text(text(path), str(path))


def yaml_text(content: str, source: str) -> Any:
    """YAML text, OpenCV's FileStorage included; `source` names it in errors."""
    import yaml

    class Loader(getattr(yaml, "CSafeLoader", yaml.SafeLoader)):  # type: ignore[misc]
        """Safe, and knows OpenCV's matrices."""

    Loader.add_constructor("tag:yaml.org,2002:opencv-matrix", _opencv_matrix)
    content = re.sub(r"\A%YAML:1\.\d\s*(\n---)?", "", content)
    if _depth(content) > _DEEPEST:
        raise InputError(f"{source}: is nested more than {_DEEPEST} deep; it is no recording")
    try:
        loader = Loader(content)
        node = loader.get_single_node()
        return loader.construct_document(bounded(node, source)) if node else None
    except (yaml.YAMLError, ValueError, TypeError, KeyError, RecursionError) as error:
        reason = " ".join(str(error).split())
        raise InputError(f"{source}: is not readable YAML ({reason})") from error


def _depth(content: str) -> int:
    """A bound of how deeply YAML is nested: open brackets, or what leads a line. LibYAML's stack has none."""
    brackets = np.frombuffer(content.encode(), np.uint8)
    steps = np.isin(brackets, (*b"[{",)).astype(int) - np.isin(brackets, (*b"]}",))
    led = max(map(len, re.findall(r"^[ ?:\t-]+", content, re.MULTILINE)), default=0)
    return max(int(np.cumsum(steps).max(initial=0)), led)


def bounded(value: Any, source: str) -> Any:
    """The value (or YAML node), unless it has too many parts, counted as often as they are referred to.

    A few hundred bytes of aliases within aliases stand for more than any memory holds.
    """
    waiting, count = [value], 0
    while waiting:
        part = waiting.pop()
        part = getattr(part, "value", part)
        if isinstance(part, dict | list | tuple):
            count += len(part)
            if count > _MOST_PARTS:
                raise InputError(
                    f"{source}: holds or repeats more than {_MOST_PARTS} values; cut it into pieces"
                )
            waiting.extend(part.values() if isinstance(part, dict) else part)
    return value


def _opencv_matrix(loader: Any, node: Any) -> Array:
    fields = loader.construct_mapping(node, deep=True)
    return np.array(fields["data"], float).reshape(int(fields["rows"]), int(fields["cols"]))


def table(content: str, source: str) -> Array:
    """Rows of numbers (N, columns), separated by commas, semicolons, tabs or blanks; comments and one header
    line are skipped."""
    rows: list[list[float]] = []
    for number, line in enumerate(io.StringIO(content), 1):
        line = line.split("#")[0].strip()
        if not line:
            continue
        cells = next(csv.reader([re.sub(r"[\s;,]+", ",", line).strip(",")]))
        try:
            values = [float(cell) for cell in cells]
        except ValueError:
            if rows:
                raise InputError(f"{source}: line {number}: '{line[:40]}' is not a row of numbers") from None
            continue
        if rows and len(values) != len(rows[0]):
            raise InputError(
                f"{source}: line {number}: {len(values)} numbers after rows of {len(rows[0])}; complete it"
            )
        rows.append(values)
    if not rows:
        raise InputError(f"{source}: holds no row of numbers")
    return finite(rows, source)


def finite(values: ArrayLike, source: str, shape: tuple[int, ...] | None = None) -> Array:
    """An array of finite numbers, of a shape when one is given (-1: any)."""
    try:
        array = np.asarray(values, float)
        array = array if shape is None else array.reshape(shape)
    except (ValueError, TypeError):
        raise InputError(f"{source}: expected numbers{f' of shape {shape}' if shape else ''}") from None
    if not np.isfinite(array).all():
        raise InputError(f"{source}: holds a number that is not finite")
    return array


def item(mapping: Any, key: str, source: Path | str) -> Any:
    """A value of a mapping that must be there."""
    if not isinstance(mapping, dict) or key not in mapping:
        raise InputError(f"{source}: has no '{key}'")
    return mapping[key]


def zip_names(path: Path) -> list[str]:
    """Names of the files in an archive; none when it is not a readable one."""
    try:
        if not path.is_file():
            return []
        with zipfile.ZipFile(path) as archive:
            return [name for name in archive.namelist() if not name.endswith("/")]
    except (OSError, zipfile.BadZipFile, ValueError):
        return []


def zip_bytes(path: Path, name: str) -> bytes:
    """One file of an archive."""
    try:
        with zipfile.ZipFile(path) as archive:
            return archive.read(name)
    except (OSError, zipfile.BadZipFile, KeyError, ValueError, RuntimeError) as error:
        raise InputError(f"{path}: '{name}' cannot be read ({error}); fetch the archive again") from error
