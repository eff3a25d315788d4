"""The network as an ONNX graph."""

from __future__ import annotations

import torch
from torch import nn

from hecbench_plugins.perception.onnx_export import exported, halved
from hecbench_plugins.regression.plan import CROP_PX


def to_onnx(net: nn.Module, posture: int) -> bytes:
    """`image` (1, 3, S, S) RGB in [0, 1] and `posture` (1, P) to `numbers` (1, 10)."""
    inputs = {"image": torch.zeros(1, 3, CROP_PX, CROP_PX), "posture": torch.zeros(1, posture)}
    return exported(halved(net), inputs, "numbers")
