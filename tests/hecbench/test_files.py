"""Files are whole or absent, and names from data stay names."""

import pytest

from hecbench.system import files


def test_a_failed_write_keeps_the_old_file_and_leaves_nothing_beside_it(tmp_path):
    path = tmp_path / "answer.json"
    files.write_text(path, "old")

    def torn():
        with files.replacing(path) as stream:
            stream.write(b"half of the ne")
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        torn()
    assert path.read_text() == "old"
    assert [p.name for p in tmp_path.iterdir()] == ["answer.json"]


def test_a_write_replaces_the_whole_file(tmp_path):
    path = tmp_path / "deep" / "answer.json"
    files.write_text(path, "a long text")
    files.write_text(path, "short")
    assert path.read_text() == "short"
