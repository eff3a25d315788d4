"""The store: append-only, exclusive, and readable after any kind of death."""

import multiprocessing
from dataclasses import replace

import numpy as np
import pytest

from hecbench.errors import HecbenchError, InputError
from hecbench.estimate import Estimate
from hecbench.storage import store


def estimates(count):
    origin = {"recording_sha256": "f00", "seed": 0}
    return [
        Estimate(
            np.eye(4), solver="park", recording="r", suite="s", level="l", item=f"{i:06d}", provenance=origin
        )
        for i in range(count)
    ]


def write(folder, found, resume=False):
    with store.writing(folder, resume=resume) as writer:
        writer.append(found)


def items(folder):
    return [estimate.item for estimate in store.read(folder).estimates]


def test_round_trip_and_resume(tmp_path):
    write(tmp_path, estimates(2))
    write(tmp_path, estimates(3)[2:], resume=True)
    contents = store.read(tmp_path)
    assert items(tmp_path) == ["000000", "000001", "000002"]
    assert contents.damage == []
    np.testing.assert_array_equal(contents.estimates[0].parent_T_camera, np.eye(4))


def test_a_result_written_twice_counts_once(tmp_path):
    write(tmp_path, estimates(2))
    write(tmp_path, estimates(2), resume=True)
    assert items(tmp_path) == ["000000", "000001"]


def test_results_are_not_overwritten_without_resume(tmp_path):
    write(tmp_path, estimates(1))
    with pytest.raises(InputError, match="--resume"):
        write(tmp_path, estimates(1))
    assert items(tmp_path) == ["000000"]


def test_cut_off_at_any_byte(tmp_path):
    """What is whole is read, what is not is named, and appending afterwards loses nothing."""
    write(tmp_path, estimates(3))
    path = tmp_path / store.FILE_NAME
    whole = path.read_bytes()
    ends = [i + 1 for i, byte in enumerate(whole) if byte == ord("\n")]
    for length in range(0, len(whole) + 1, 7):
        path.write_bytes(whole[:length])
        contents = store.read(tmp_path)
        complete = sum(end - 1 <= length for end in ends)
        assert len(contents.estimates) == complete
        assert store.keys(tmp_path) == {store.key(estimate) for estimate in contents.estimates}
        tail = length not in (0, *ends, *(end - 1 for end in ends))
        assert len(contents.damage) == tail
        if length:
            write(tmp_path, estimates(4)[3:], resume=True)
            assert items(tmp_path)[-1] == "000003"
            assert len(items(tmp_path)) == complete + 1


@pytest.mark.parametrize("junk", [b"\x00\x00\n", b"{}\n", b'{"schema": "other"}\n', b"\xff\xfe\n", b"null\n"])
def test_foreign_lines_are_named_and_skipped(tmp_path, junk):
    write(tmp_path, estimates(2))
    path = tmp_path / store.FILE_NAME
    lines = path.read_bytes().splitlines(keepends=True)
    path.write_bytes(lines[0] + junk + lines[1])
    contents = store.read(tmp_path)
    assert len(contents.estimates) == 2
    assert store.keys(tmp_path) == {store.key(estimate) for estimate in contents.estimates}
    assert ":2: damaged" in contents.damage[0]


def _hold(folder, ready, done):
    with store.writing(folder, resume=True):
        ready.set()
        done.wait(20)


def test_two_writers_exclude_each_other(tmp_path):
    context = multiprocessing.get_context("spawn")
    ready, done = context.Event(), context.Event()
    holder = context.Process(target=_hold, args=(tmp_path, ready, done))
    holder.start()
    try:
        assert ready.wait(20)
        with pytest.raises(InputError, match="another run"):
            write(tmp_path, estimates(1), resume=True)
    finally:
        done.set()
        holder.join(20)
    write(tmp_path, estimates(1), resume=True)


def test_bad_places(tmp_path):
    (tmp_path / "file").write_text("x")
    with pytest.raises(HecbenchError, match="cannot be written"):
        write(tmp_path / "file" / "below", estimates(1))
    with pytest.raises(InputError, match=r"estimates.jsonl"):
        store.read(tmp_path / "nowhere")


def test_results_of_two_seeds_are_two_results(tmp_path):
    first, second = estimates(1)[0], estimates(1)[0]
    second = replace(second, provenance={**second.provenance, "seed": 1})
    write(tmp_path, [first, second])
    assert len(store.read(tmp_path).estimates) == 2
