"""Generator, discriminators and helpers, after the authors' architectures (Zhu et al. 2017, Park et al. 2020)."""

from __future__ import annotations

import torch
from torch import Tensor, nn
from torch.nn import functional as F

from hecbench_plugins.translation.plan import Method, Plan

_PATCHES, _FEATURES = 256, 256
"""Places at which CUT compares features, and their length after the heads."""


def _unit(inputs: int, outputs: int, kernel: int, stride: int = 1) -> nn.Sequential:
    convolution = nn.Conv2d(inputs, outputs, kernel, stride, kernel // 2, padding_mode="reflect")
    return nn.Sequential(convolution, nn.InstanceNorm2d(outputs), nn.ReLU())


class _Block(nn.Module):
    def __init__(self, width: int) -> None:
        super().__init__()
        last = nn.Conv2d(width, width, 3, 1, 1, padding_mode="reflect")
        self.body = nn.Sequential(_unit(width, width, 3), last, nn.InstanceNorm2d(width))

    def forward(self, x: Tensor) -> Tensor:
        """Both ways (B, width, H, W)."""
        out: Tensor = x + self.body(x)
        return out


class Generator(nn.Module):
    """(B, 3, H, W) in [-1, 1] to the same; residual blocks at a quarter of the size."""

    def __init__(self, width: int, blocks: int) -> None:
        super().__init__()
        self.down = nn.ModuleList(
            [_unit(3, width, 7), _unit(width, 2 * width, 3, 2), _unit(2 * width, 4 * width, 3, 2)]
        )
        self.middle = nn.ModuleList(_Block(4 * width) for _ in range(blocks))
        self.up = nn.ModuleList([_unit(4 * width, 2 * width, 3), _unit(2 * width, width, 3)])
        self.last = nn.Conv2d(width, 3, 7, 1, 3, padding_mode="reflect")

    def features(self, x: Tensor) -> list[Tensor]:
        """The picture, and what is known of it after each part of the encoder: CUT compares these."""
        found = [x]
        for part in (*self.down, *self.middle[: len(self.middle) // 2 + 1]):
            found.append(part(found[-1]))
        return [found[place] for place in (0, 2, 3, 4, len(found) - 1)]

    def forward(self, x: Tensor) -> Tensor:
        """The translated picture."""
        for part in (*self.down, *self.middle):
            x = part(x)
        for part in self.up:
            x = part(F.interpolate(x, scale_factor=2.0, mode="nearest"))
        return torch.tanh(self.last(x))


class Discriminator(nn.Module):
    """PatchGAN: one judgement for every patch, (B, 1, h, w); 70 x 70 px patches with three strided layers."""

    def __init__(self, width: int, layers: int = 3) -> None:
        super().__init__()
        parts: list[nn.Module] = [nn.Conv2d(3, width, 4, 2, 1), nn.LeakyReLU(0.2)]
        for place in range(1, layers + 1):
            inputs, outputs = (width * 2 ** min(p, 3) for p in (place - 1, place))
            stride = 2 if place < layers else 1
            parts += [nn.Conv2d(inputs, outputs, 4, stride, 1), nn.InstanceNorm2d(outputs), nn.LeakyReLU(0.2)]
        self.body = nn.Sequential(*parts, nn.Conv2d(width * 2 ** min(layers, 3), 1, 4, 1, 1))

    def forward(self, x: Tensor) -> Tensor:
        """Judgements: 1 for a real patch."""
        out: Tensor = self.body(x)
        return out


class MaskFinder(nn.Module):
    """Learns the mask of a cut out robot, (B, 1, H, W) logits."""

    def __init__(self, width: int) -> None:
        super().__init__()
        self.body = nn.Sequential(_unit(3, width, 3), _unit(width, width, 3), nn.Conv2d(width, 1, 3, 1, 1))

    def forward(self, x: Tensor) -> Tensor:
        """Logits."""
        out: Tensor = self.body(x)
        return out


class PatchHeads(nn.Module):
    """Features at random places as unit vectors (places, 256) for each layer."""

    def __init__(self, channels: list[int]) -> None:
        super().__init__()
        self.heads = nn.ModuleList(
            nn.Sequential(nn.Linear(c, _FEATURES), nn.ReLU(), nn.Linear(_FEATURES, _FEATURES))
            for c in channels
        )

    def forward(self, features: list[Tensor], places: list[Tensor]) -> list[Tensor]:
        """One matrix per layer, of the first picture of the batch."""
        return [
            F.normalize(head(layer[0].flatten(1).T[place]), dim=1)
            for head, layer, place in zip(self.heads, features, places, strict=True)
        ]

    @staticmethod
    def places(features: list[Tensor]) -> list[Tensor]:
        """Random places in each layer."""
        return [torch.randperm(layer[0, 0].numel())[:_PATCHES] for layer in features]


def networks_of(plan: Plan) -> nn.ModuleDict:
    """All networks of a method, initialised as published: normal, deviation 0.02."""
    layers = 3 if plan.size >= 128 else 2
    generator = Generator(plan.width, plan.blocks)
    found = nn.ModuleDict({"to_drawn": generator, "drawn": Discriminator(plan.width, layers)})
    if plan.method is Method.CUT:
        with torch.no_grad():
            features = generator.features(torch.zeros(1, 3, plan.size, plan.size))
        found["heads"] = PatchHeads([layer.shape[1] for layer in features])
    else:
        found["to_photo"], found["photo"] = (
            Generator(plan.width, plan.blocks),
            Discriminator(plan.width, layers),
        )
    if plan.method is Method.GEOMASKGAN:
        found["masks"] = MaskFinder(plan.width)
    for module in found.modules():
        if isinstance(module, nn.Conv2d | nn.Linear):
            nn.init.normal_(module.weight, 0.0, 0.02)
            if module.bias is not None:
                nn.init.zeros_(module.bias)
    return found
