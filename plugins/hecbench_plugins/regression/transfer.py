"""Start from what a trained perception network has learned to see."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import onnx
import torch
from onnx import numpy_helper
from torch import Tensor, nn

from hecbench.errors import InputError
from hecbench_plugins.perception.card import read_card
from hecbench_plugins.perception.network import ConvUnit, Encoder


def take_encoder(net: Encoder, folder: Path, pictures: Tensor) -> None:
    """Give a network the encoder of the perception model in a folder.

    The model's normalisations are part of its convolutions. They are set anew so that on pictures (B, 3, H, W) the
    encoder answers as the model's does.

    Raises:
        InputError: the folder holds no such model.
    """
    card, weights = read_card(folder)
    graph = onnx.load_model_from_string(weights).graph
    stored = {one.name: numpy_helper.to_array(one).astype(np.float32) for one in graph.initializer}
    units = {name: unit for name, unit in net.named_modules() if isinstance(unit, ConvUnit)}
    absent = [name for name in units if f"{name}.0.weight" not in stored]
    if absent:
        raise InputError(f"{folder / card.weights}: has no weights of '{absent[0]}': another kind of network")
    hooks = []
    for name, unit in units.items():
        conv, norm = unit[0], unit[1]
        assert isinstance(conv, nn.Conv2d)
        conv.weight.data.copy_(torch.from_numpy(stored[f"{name}.0.weight"]))
        hooks.append(norm.register_forward_pre_hook(_keeping(torch.from_numpy(stored[f"{name}.0.bias"]))))
    net.train()
    with torch.no_grad():
        x = net.look(pictures)
        for block in net.down:
            x = block(x)
    for hook in hooks:
        hook.remove()


def _keeping(bias: Tensor):  # type: ignore[no-untyped-def]  # noqa: ANN202
    """A hook that sets a normalisation so that it only adds a bias (C,) to the features it is given first."""

    def hook(norm: nn.BatchNorm2d, given: tuple[Tensor]) -> None:
        variance, mean = torch.var_mean(given[0], (0, 2, 3), correction=0)
        norm.weight.data.copy_((variance + norm.eps).sqrt())
        norm.bias.data.copy_(bias + mean)
        assert norm.running_mean is not None
        assert norm.running_var is not None
        norm.running_mean.copy_(mean)
        norm.running_var.copy_(variance)

    return hook
