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
from hecbench_plugins.perception.network import ConvUnit, PerceptionNet


def take_sight(net: PerceptionNet, folder: Path, pictures: Tensor) -> None:
    """Give a network the convolutions of the perception model in a folder.

    The model's normalisations are part of its convolutions. They are set anew so that on pictures (B, 3, H, W) the
    network sees as the model does.

    Raises:
        InputError: the folder holds no such model.
    """
    card, weights = read_card(folder)
    graph = onnx.load_model_from_string(weights).graph
    stored = {
        one.name: torch.from_numpy(numpy_helper.to_array(one).astype(np.float32)) for one in graph.initializer
    }
    hooks, fused = [], set()
    try:
        for name, module in net.named_modules():
            if isinstance(module, ConvUnit):
                hooks.append(module[1].register_forward_pre_hook(_Keeping(stored[f"{name}.0.bias"])))
                fused.add(f"{name}.0")
            elif isinstance(module, nn.Conv2d):
                module.weight.data.copy_(stored[f"{name}.weight"])
                if name not in fused:
                    assert module.bias is not None
                    module.bias.data.copy_(stored[f"{name}.bias"])
    except (KeyError, RuntimeError) as error:
        raise InputError(f"{folder / card.weights}: weights of another network: {error}") from None
    net.train()
    with torch.no_grad():
        PerceptionNet.forward(net, pictures)
    for hook in hooks:
        hook.remove()


class _Keeping:
    """Sets a normalisation so that it only adds a bias (C,) to the features that it is given first."""

    def __init__(self, bias: Tensor) -> None:
        self.bias = bias

    def __call__(self, norm: nn.Module, given: tuple[Tensor]) -> None:
        assert isinstance(norm, nn.BatchNorm2d)
        assert norm.running_mean is not None
        assert norm.running_var is not None
        variance, mean = torch.var_mean(given[0], (0, 2, 3), correction=0)
        norm.weight.data.copy_((variance + norm.eps).sqrt())
        norm.bias.data.copy_(self.bias + mean)
        norm.running_mean.copy_(mean)
        norm.running_var.copy_(variance)
