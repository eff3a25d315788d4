"""A change of exposure, made anew each time that a picture is shown."""

from __future__ import annotations

from torch import Tensor

_GAIN, _CHANNEL_GAIN, _OFFSET = 0.15, 0.05, 0.04
"""Standard deviations."""


def exposed(pictures: Tensor, gain: Tensor, channel_gain: Tensor, offset: Tensor) -> Tensor:
    """Pictures (B, 3, H, W) in [0, 1] changed by normal numbers (B, 1, 1, 1), (B, 3, 1, 1) and (B, 1, 1, 1)."""
    factor = 1 + _GAIN * gain + _CHANNEL_GAIN * channel_gain
    return (pictures * factor.to(pictures) + _OFFSET * offset.to(pictures)).clamp(0, 1)
