"""Files of limits: what they may hold, and how fast they may be."""

import json

import pytest
from hecbench_hardware.limits import HIGHEST, Box, Limits, load_limits

from hecbench.errors import InputError


@pytest.mark.parametrize(
    ("content", "complaint"),
    [
        ('{"joint_speed_rad_s": -1}', "must be positive"),
        ('{"speed": 1}', "unknown limit 'speed'"),
        ('{"workspace": {"lower_m": [0,0,1], "upper_m": [1,1,0]}}', "is empty"),
        ('{"joint_lower_rad": [0,0,0,0,0,9]}', "must lie below"),
        ('{"tool": [{"centre_m": [0,0], "radius_m": 0.1}]}', "tool"),
        ("{", "limits.json"),
        ("[1]", "limits.json"),
    ],
)
def test_bad_limit_files_are_refused_in_one_line(tmp_path, content, complaint):
    path = tmp_path / "limits.json"
    path.write_text(content)
    with pytest.raises(InputError, match=complaint) as caught:
        load_limits(path)
    assert "\n" not in str(caught.value)


def test_limit_files_fill_in_defaults(tmp_path):
    path = tmp_path / "limits.json"
    path.write_text('{"tool_speed_m_s": 0.1, "keep_out": [{"lower_m": [0,0,0], "upper_m": [1,1,1]}]}')
    limits = load_limits(path)
    assert limits.tool_speed_m_s == 0.1
    assert limits.keep_out == (Box((0, 0, 0), (1, 1, 1)),)
    assert limits.joint_speed_rad_s == Limits().joint_speed_rad_s


@pytest.mark.parametrize("name", HIGHEST)
def test_speeds_have_an_upper_bound(tmp_path, name):
    path = tmp_path / "limits.json"
    path.write_text(json.dumps({name: HIGHEST[name]}))
    assert getattr(load_limits(path), name) == HIGHEST[name]
    path.write_text(json.dumps({name: HIGHEST[name] * 1.01}))
    with pytest.raises(InputError, match=f"{name} .* above the most allowed"):
        load_limits(path)
