"""Damaged files into every reader: each must read them or refuse them in one line, in bounded time and memory.

    python benchmarks/fuzz.py [--reader NAME] [--seconds 60] [--seed 0]

Inputs that end otherwise are kept in out/fuzz/<reader>/; exits with 1 when there are any.
"""

from __future__ import annotations

import random
import resource
import shutil
import signal
import sys
import tempfile
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import click
import numpy as np

from hecbench import conformance, registry
from hecbench.conformance.photographs import photographs
from hecbench.errors import HecbenchError
from hecbench.estimate import Estimate
from hecbench.recording import Mounting
from hecbench.specs import DatasetSpec, Kind

SHARED = Path(__file__).parents[2] / "shared" / "data"
HANG_S = 5
MEMORY_BYTES = 8 * 2**30
"""Of address space; what the interpreter maps by itself is some 3 GB of it."""
_LARGEST_SEED_BYTES = 300_000
_WORDS = (
    b"nan", b"-inf", b"1e999", b"null", b"{}", b"[]", b'"', b"\x00", b"\xff\xfe", b"-1", b"0", b"99999999999", b"../",
    b"&a *a", b"<<: *a", b"<!ENTITY", b"\n", b"[[[[[[[[", b"package://x/y", b"true", b"1 2", b"#", b"\xc3\x28",
)  # fmt: skip

Reader = Callable[[Path], object]


def damaged(content: bytes, rng: random.Random) -> bytes:
    """The bytes with one to four pieces cut out, overwritten, repeated or replaced by something hostile."""
    for _ in range(rng.randint(1, 4)):
        at = rng.randrange(len(content) + 1)
        end = min(len(content), at + rng.choice((1, 1, 2, 5, 20, 200)))
        piece = rng.choice((b"", rng.choice(_WORDS), rng.randbytes(end - at), 3 * content[at:end]))
        content = content[:at] + piece + content[end:]
    return content[: rng.randrange(len(content) + 1)] if rng.random() < 0.1 else content


def readers(scratch: Path) -> dict[str, tuple[Path, Reader]]:
    """By name: a folder of good files, and what reads such a folder."""
    from hecbench import estimate
    from hecbench.robots.model import load_robot
    from hecbench.robots.writer import write_urdf
    from hecbench.storage import recording_io, store

    found: dict[str, tuple[Path, Reader]] = {}
    rig = conformance.rig(np.random.default_rng(0), Mounting.EYE_TO_HAND)
    recording_io.save(photographs(), scratch / "native")
    found["native"] = scratch / "native", _recording(recording_io.load)
    answer = Estimate(rig.truth_parent_T_camera, camera=rig.camera)
    answer.save(scratch / "estimate" / "estimate.json")
    found["estimate"] = scratch / "estimate", lambda folder: estimate.load(folder / "estimate.json")
    with store.writing(scratch / "store", resume=False) as writer:
        writer.append([answer, answer])
    found["store"] = scratch / "store", store.read
    write_urdf(load_robot("ur3e"), scratch / "urdf" / "robot.urdf")
    found["urdf"] = scratch / "urdf", lambda folder: load_robot(folder / "robot.urdf")
    for name, folder in _FOLDERS.items():
        if (SHARED / folder).exists():
            spec = registry.load().get(Kind.DATASET, name, DatasetSpec)
            shutil.copytree(SHARED / folder, scratch / name, copy_function=shutil.copyfile)
            found[name] = scratch / name, _sniffed(spec)
    return found


_FOLDERS = {
    "opencv_yaml": "camodocal_ur",
    "franka_charuco": "franka_charuco",
    "visp": "visp_franka/data-eye-in-hand",
    "industrial": "industrial_10x10/test_set_10x10",
    "ctrnet": "ctrnet_baxter",
}


def _recording(load: Callable[[Path], object]) -> Reader:
    def read(folder: Path) -> None:
        recording = load(folder)
        for sample in range(len(recording)):  # type: ignore[arg-type]
            recording.image(sample)  # type: ignore[attr-defined]

    return read


def _sniffed(spec: DatasetSpec) -> Reader:
    def read(folder: Path) -> None:
        for other in registry.load().ready(Kind.DATASET, DatasetSpec):
            other.sniff(folder)
        spec.load(folder)

    return read


@contextmanager
def bounded() -> Iterator[None]:
    """Raise `TimeoutError` after `HANG_S`."""

    def over(number: int, frame: object) -> None:
        raise TimeoutError(f"longer than {HANG_S} s")

    signal.signal(signal.SIGALRM, over)
    signal.alarm(HANG_S)
    try:
        yield
    finally:
        signal.alarm(0)


def fault(read: Reader, folder: Path) -> str | None:
    """How reading a folder went wrong, None when it was read or refused in one line."""
    try:
        with bounded():
            read(folder)
    except HecbenchError as error:
        return (
            None if str(error) and "\n" not in str(error) else f"message of several lines or none: {error!r}"
        )
    except (Exception, TimeoutError) as error:
        return f"{type(error).__name__}: {error}"
    return None


def fuzz(
    name: str, seed: Path, read: Reader, seconds: float, rng: random.Random, kept: Path
) -> tuple[int, int]:
    """How many inputs were tried on a reader, and how many went wrong."""
    files = [
        path
        for path in sorted(seed.rglob("*"))
        if path.is_file() and path.stat().st_size < _LARGEST_SEED_BYTES
    ]
    tried = wrong = 0
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        file = rng.choice(files)
        original = file.read_bytes()
        file.write_bytes(damaged(original, rng))
        tried += 1
        if (message := fault(read, seed)) is not None:
            wrong += 1
            place = kept / name / f"{tried:06d}-{file.name}"
            place.parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(file, place)
            click.echo(f"{name}: {place}: {message[:300]}")
        file.write_bytes(original)
    return tried, wrong


@click.command()
@click.option("--reader", default="", help="Only readers whose name holds this word.")
@click.option("--seconds", default=60.0, show_default=True, help="For each reader.")
@click.option("--seed", default=0, show_default=True)
@click.option("--out", type=click.Path(path_type=Path), default=Path("out/fuzz"), show_default=True)
def main(reader: str, seconds: float, seed: int, out: Path) -> None:
    """Fuzz the readers one after the other."""
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY_BYTES, MEMORY_BYTES))
    total = faults = 0
    with tempfile.TemporaryDirectory() as scratch:
        for name, (folder, read) in readers(Path(scratch)).items():
            if reader in name:
                tried, wrong = fuzz(name, folder, read, seconds, random.Random(f"{seed} {name}"), out)
                click.echo(f"{name}: {tried} inputs, {wrong} wrong")
                total, faults = total + tried, faults + wrong
    click.echo(f"{total} inputs, {faults} wrong")
    sys.exit(faults > 0)


if __name__ == "__main__":
    main()
