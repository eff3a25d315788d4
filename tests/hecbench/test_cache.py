"""The cache keeps values between processes, stays within its bound and never costs an answer."""

import pytest

from hecbench.system import cache


@pytest.fixture(autouse=True)
def _own_folder(monkeypatch, tmp_path):
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.delenv(cache.VARIABLE, raising=False)


def test_values_are_found_again_by_another_cache_of_the_same_name():
    kept = cache.Cache("values", 2**20)
    assert kept.get(b"a") is None
    kept.put({b"a": b"1", b"b": b""})
    kept.put({b"a": b"2"})
    again = cache.Cache("values", 2**20)
    assert (again.get(b"a"), again.get(b"b"), again.get(b"c")) == (b"2", b"", None)


def test_the_oldest_values_go_when_the_bound_is_passed(tmp_path):
    bound, size = 2**18, 2000
    kept = cache.Cache("values", bound)
    for first in range(0, 1000, 50):
        kept.put({str(number).encode(): bytes(size) for number in range(first, first + 50)})
    assert kept.get(b"999") == bytes(size)
    assert kept.get(b"0") is None
    assert (tmp_path / "hecbench" / "values").stat().st_size < 2 * bound


def test_nothing_is_kept_when_the_user_wants_none(monkeypatch, tmp_path):
    monkeypatch.setenv(cache.VARIABLE, "1")
    kept = cache.Cache("values", 2**20)
    kept.put({b"a": b"1"})
    assert kept.get(b"a") is None
    assert not any(tmp_path.iterdir())


def test_a_damaged_file_or_folder_costs_a_warning_only(caplog, monkeypatch, tmp_path):
    (tmp_path / "hecbench").mkdir()
    (tmp_path / "hecbench" / "values").write_bytes(b"no database" * 1000)
    kept = cache.Cache("values", 2**20)
    kept.put({b"a": b"1"})
    assert kept.get(b"a") is None
    assert "values: cannot be used" in caplog.text
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "hecbench" / "values"))
    assert kept.get(b"a") is None
