"""Numbers as people write them."""

import pytest

from hecbench.system.wording import significant


@pytest.mark.parametrize(
    ("value", "digits", "text"),
    [
        (123.4, 2, "120"),
        (99.6, 2, "100"),
        (0.994, 2, "0.99"),
        (-1234.5, 3, "-1230"),
        (0.00012345, 2, "0.00012"),
        (123456.0, 2, "120000"),
        (0.0, 2, "0"),
        (float("inf"), 2, "inf"),
    ],
)
def test_numbers_are_written_out(value, digits, text):
    assert significant(value, digits) == text
