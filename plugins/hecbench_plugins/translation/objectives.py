"""What each method asks of its networks."""

from __future__ import annotations

from typing import NamedTuple

import torch
from torch import Tensor, nn
from torch.nn import functional as F

from hecbench_plugins.translation.networks import PatchHeads
from hecbench_plugins.translation.plan import Method

_CYCLE, _IDENTITY, _MASK, _GEOMETRY = 10.0, 5.0, 1.0, 1.0
"""lambda_A = lambda_B = 10 and half of it for the identity (Zhu et al. 2017); the mask's is DRHeC's."""
_TEMPERATURE = 0.07
_BLACK, _STEP = 0.05, 0.02
"""Where a colour channel in [0, 1] counts as robot, and how softly: a hard threshold has no gradient."""


class Pictures(NamedTuple):
    """Robots cut out of photographs, and drawn ones of other postures, (B, 3, S, S) in [-1, 1]; masks (B, 1, S, S)."""

    photo: Tensor
    photo_mask: Tensor
    drawn: Tensor
    drawn_mask: Tensor


def soft_mask(picture: Tensor) -> Tensor:
    """(B, 1, S, S) in [0, 1]: where any channel of a picture in [-1, 1] is not black."""
    brightest = (picture.amax(1, keepdim=True) + 1) / 2
    return torch.sigmoid((brightest - _BLACK) / _STEP)


def generators_loss(
    nets: nn.ModuleDict, method: Method, seen: Pictures
) -> tuple[dict[str, Tensor], Tensor, Tensor]:
    """The generators' terms by name, weighed, and the pictures that they made: drawn, and photographic ones."""
    made = nets["to_drawn"](seen.photo)
    terms = {"adversarial": _real(nets["drawn"](made))}
    if method is Method.CUT:
        terms["contrast"] = _contrast(nets, seen.photo, made)
        terms["identity"] = _contrast(nets, seen.drawn, nets["to_drawn"](seen.drawn))
        return terms, made, made
    back = nets["to_photo"](seen.drawn)
    terms["adversarial"] = terms["adversarial"] + _real(nets["photo"](back))
    terms["cycle"] = _CYCLE * (
        F.l1_loss(nets["to_photo"](made), seen.photo) + F.l1_loss(nets["to_drawn"](back), seen.drawn)
    )
    terms["identity"] = _IDENTITY * (
        F.l1_loss(nets["to_drawn"](seen.drawn), seen.drawn)
        + F.l1_loss(nets["to_photo"](seen.photo), seen.photo)
    )
    if method is Method.CYCLEGAN_MASK:
        terms["mask"] = _MASK * (
            F.l1_loss(soft_mask(made), seen.photo_mask) + F.l1_loss(soft_mask(back), seen.drawn_mask)
        )
    if method is Method.GEOMASKGAN:
        found = nets["masks"]
        terms["geometry"] = _GEOMETRY * (
            _dice(found(made).sigmoid(), seen.photo_mask) + _dice(found(back).sigmoid(), seen.drawn_mask)
        )
    return terms, made, back


def judges_loss(nets: nn.ModuleDict, method: Method, seen: Pictures, made: Tensor, back: Tensor) -> Tensor:
    """Of the discriminators, for made pictures without a gradient, and of the network that learns masks."""
    loss = 0.5 * (_real(nets["drawn"](seen.drawn)) + _fake(nets["drawn"](made)))
    if method is not Method.CUT:
        loss = loss + 0.5 * (_real(nets["photo"](seen.photo)) + _fake(nets["photo"](back)))
    if method is Method.GEOMASKGAN:
        found = nets["masks"]
        loss = loss + F.binary_cross_entropy_with_logits(found(seen.photo), seen.photo_mask)
        loss = loss + F.binary_cross_entropy_with_logits(found(seen.drawn), seen.drawn_mask)
    return loss


def _real(judgement: Tensor) -> Tensor:
    """Least squares (Mao et al. 2017): 0 when every patch is taken for real."""
    return ((judgement - 1) ** 2).mean()


def _fake(judgement: Tensor) -> Tensor:
    return (judgement**2).mean()


def _dice(found: Tensor, wanted: Tensor) -> Tensor:
    return 1 - (2 * (found * wanted).sum() + 1) / (found.sum() + wanted.sum() + 1)


def _contrast(nets: nn.ModuleDict, source: Tensor, made: Tensor) -> Tensor:
    """A place of the made picture is to be known among all others by the same place of the source (InfoNCE)."""
    generator, heads = nets["to_drawn"], nets["heads"]
    features = generator.features(source)  # type: ignore[operator]
    places = PatchHeads.places(features)
    keys = [key.detach() for key in heads(features, places)]
    queries = heads(generator.features(made), places)  # type: ignore[operator]
    terms = [
        F.cross_entropy(query @ key.T / _TEMPERATURE, torch.arange(len(query), device=query.device))
        for query, key in zip(queries, keys, strict=True)
    ]
    return torch.stack(terms).mean()
