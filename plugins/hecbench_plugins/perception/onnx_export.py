"""Write a network as an ONNX graph whose weights are halves on disk and floats when it runs."""

from __future__ import annotations

import copy
import io
import warnings

import torch
from torch import Tensor, nn
from torch.nn import functional as F
from torch.nn.utils.fusion import fuse_conv_bn_eval

from hecbench_plugins.perception.network import ConvUnit
from hecbench_plugins.perception.plan import STRIDE

_OPSET = 13
"""Read by OpenCV 4.10 and later."""


class _HalfConv(nn.Module):
    """A convolution that keeps its weights as halves."""

    def __init__(self, conv: nn.Conv2d) -> None:
        super().__init__()
        self.stride, self.padding = conv.stride, conv.padding
        self.register_buffer("weight", conv.weight.detach().half())
        self.register_buffer("bias", None if conv.bias is None else conv.bias.detach().float())

    def forward(self, x: Tensor) -> Tensor:
        """As `nn.Conv2d`."""
        assert isinstance(self.weight, Tensor)
        bias = self.bias if isinstance(self.bias, Tensor) else None
        return F.conv2d(x, self.weight.float(), bias, self.stride, self.padding)


class _HalfLinear(nn.Module):
    """A dense layer that keeps its weights as halves."""

    def __init__(self, layer: nn.Linear) -> None:
        super().__init__()
        self.register_buffer("weight", layer.weight.detach().half())
        self.register_buffer("bias", layer.bias.detach().float())

    def forward(self, x: Tensor) -> Tensor:
        """As `nn.Linear`."""
        assert isinstance(self.weight, Tensor)
        assert isinstance(self.bias, Tensor)
        return F.linear(x, self.weight.float(), self.bias)


def to_onnx(net: nn.Module) -> bytes:
    """The graph: `image` (1, 3, H, W) RGB in [0, 1] to `logits`, any H and W that are multiples of 32."""
    return graph_of(halved(net), 2 * STRIDE, any_size=True)


def halved(net: nn.Module) -> nn.Module:
    """A copy whose normalisations are part of its convolutions, with weights as halves."""
    net = copy.deepcopy(net).cpu().float().eval()
    _fuse(net)
    return net


def graph_of(net: nn.Module, size: int, any_size: bool = False) -> bytes:
    """A network as an ONNX graph: `image` (1, 3, H, W) to `logits`, for pictures of `size` px or of any."""
    sizes = {2: "height", 3: "width"}
    image = {"image": torch.zeros(1, 3, size, size)}
    axes = {"image": sizes, "logits": sizes} if any_size else None
    return exported(net, image, "logits", axes=axes, folded=not any_size)


def exported(
    net: nn.Module,
    inputs: dict[str, Tensor],
    output: str,
    *,
    axes: dict[str, dict[int, str]] | None = None,
    folded: bool = False,
) -> bytes:
    """A network as an ONNX graph.

    Args:
        net: what is written.
        inputs: one example of each, by name.
        output: the name of the answer.
        axes: whose sizes are free.
        folded: whether constants are computed before; halves would become floats on disk.
    """
    content = io.BytesIO()
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # this exporter is the one that writes any size, and says it is old
        torch.onnx.export(
            net.cpu().eval(),
            tuple(inputs.values()),
            content,  # type: ignore[arg-type]
            dynamo=False,
            input_names=list(inputs),
            output_names=[output],
            dynamic_axes=axes,
            opset_version=_OPSET,
            do_constant_folding=folded,
        )
    return content.getvalue()


def _fuse(module: nn.Module) -> None:
    """Take normalisation into the convolutions, and store these as halves."""
    for name, child in module.named_children():
        if isinstance(child, ConvUnit):
            conv, norm = child[0], child[1]
            assert isinstance(conv, nn.Conv2d)
            assert isinstance(norm, nn.BatchNorm2d)
            child[0], child[1] = _HalfConv(fuse_conv_bn_eval(conv, norm)), nn.Identity()
        elif isinstance(child, nn.Conv2d):
            setattr(module, name, _HalfConv(child))
        elif isinstance(child, nn.Linear):
            setattr(module, name, _HalfLinear(child))
        else:
            _fuse(child)
