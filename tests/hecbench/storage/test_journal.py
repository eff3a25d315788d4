"""Append-only files: a full disk is one line; what is there is kept."""

import os
from pathlib import Path

import pytest

from hecbench.errors import HecbenchError, InputError
from hecbench.storage import journal


def append(path, items, resume=True):
    with journal.writing(path, str.encode, resume=resume, holds="words", busy="wait") as writer:
        writer.append(items)


def test_lines_are_numbered_and_start_afresh(tmp_path):
    path = tmp_path / "new" / "words.jsonl"
    append(path, ["one", "two"])
    path.write_bytes(path.read_bytes()[:-2] + b"\n\n")
    append(path, ["three"])
    path.write_bytes(path.read_bytes()[:-3])
    append(path, ["four"])
    assert list(journal.lines(path)) == [(1, b"one"), (2, b"tw"), (4, b"thr"), (5, b"four")]


def test_words_are_not_overwritten_without_resume(tmp_path):
    append(tmp_path / "words", ["one"])
    with pytest.raises(InputError, match="holds words already; give --resume"):
        append(tmp_path / "words", ["two"], resume=False)


def test_full_disk_is_one_line():
    full = Path("/dev/full")
    if not full.exists():
        pytest.skip("there is no /dev/full")
    with pytest.raises(HecbenchError, match=r"cannot be written \(No space left"):
        append(full, ["one"])


def test_a_line_that_does_not_fit_is_taken_back(tmp_path, monkeypatch):
    path = tmp_path / "lines"
    whole = os.write

    def half(descriptor, content):
        return whole(descriptor, content[: len(content) // 2])

    with journal.writing(path, str.encode, resume=False, holds="lines", busy="busy") as writer:
        writer.append(["first"])
        monkeypatch.setattr(os, "write", half)
        with pytest.raises(HecbenchError, match="is the disk full"):
            writer.append(["second, which is longer"])
        monkeypatch.undo()
        writer.append(["third"])
    assert path.read_bytes() == b"first\nthird\n"
