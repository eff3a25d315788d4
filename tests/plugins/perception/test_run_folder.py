"""The folder of a training run."""

import pytest
from hecbench_plugins.perception.plan import Plan
from hecbench_plugins.perception.run_folder import reserved

from hecbench.errors import HecbenchError, InputError


def test_one_run_at_a_time(tmp_path):
    folder = tmp_path / "runs" / "one"
    with (
        reserved(folder),
        pytest.raises(InputError, match="another process trains into it"),
        reserved(folder),
    ):
        pass
    with reserved(folder):
        assert list(folder.iterdir()) == []


def test_a_folder_that_cannot_be_written(tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(HecbenchError, match="cannot be written"), reserved(tmp_path / "file"):
        pass


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"size": 2048}, "--size must be 64 to 1024, is 2048"),
        ({"batch": 10**6}, "--batch must be 2 to 1024"),
        ({"seed": -1}, "--seed must be 0"),
        ({"threads": 0}, "--threads must be 1"),
    ],
)
def test_numbers_beyond_an_options_limits(tmp_path, changes, message):
    with pytest.raises(InputError, match=message):
        Plan(("ur5e",), tmp_path, 1.0, **changes).check()
