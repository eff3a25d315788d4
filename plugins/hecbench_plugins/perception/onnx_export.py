"""Write a network as an ONNX graph whose weights are halves on disk and floats when it runs."""

from __future__ import annotations

import copy
import io
import warnings

import torch
from torch import Tensor, nn
from torch.nn import functional as F
from torch.nn.utils.fusion import fuse_conv_bn_eval

from hecbench_plugins.perception.network import ConvUnit, PerceptionNet
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


def to_onnx(net: PerceptionNet) -> bytes:
    """The graph: `image` (1, 3, H, W) RGB in [0, 1] to `logits`, any H and W that are multiples of 32."""
    net = copy.deepcopy(net).cpu().float().eval()
    _fuse(net)
    return graph_of(net, 2 * STRIDE, any_size=True)


def graph_of(net: nn.Module, size: int, any_size: bool = False) -> bytes:
    """A network as an ONNX graph: `image` (1, 3, H, W) to `logits`, for pictures of `size` px or of any."""
    content = io.BytesIO()
    sizes = {2: "height", 3: "width"}
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # this exporter is the one that writes any size, and says it is old
        torch.onnx.export(
            net.cpu().eval(),
            (torch.zeros(1, 3, size, size),),
            content,  # type: ignore[arg-type]
            dynamo=False,
            input_names=["image"],
            output_names=["logits"],
            dynamic_axes={"image": sizes, "logits": sizes} if any_size else None,
            opset_version=_OPSET,
            do_constant_folding=not any_size,  # folded halves would be floats on disk,
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
        else:
            _fuse(child)
