"""What the network is punished for: wrong colours, wrong visibility, poor overlap, keypoints elsewhere."""

from __future__ import annotations

from typing import NamedTuple

import torch
from torch import Tensor
from torch.nn import functional as F

_EDGE_WEIGHT, _ROBOT_WEIGHT = 2.0, 1.0
"""Beside 1 for every cell: edges decide a calibration, and the robot is small."""
_EDGE_CELLS = 5
_OVERLAP_SOFTENING = 20.0
"""Cells: an empty mask has an overlap, too."""
_OVERLAP, _KEYPOINTS, _ABSENT = 0.5, 0.5, 0.2
"""Weights of the terms beside the two cross entropies; `_ABSENT` within keypoints, of those outside the picture."""
_SPREAD_CELLS = 1.5
"""Of a keypoint's target, a Gaussian."""


class Losses(NamedTuple):
    """Terms of one batch, before their weights."""

    colour: Tensor
    visible: Tensor
    overlap: Tensor
    keypoints: Tensor

    def total(self) -> Tensor:
        """The weighed sum."""
        return self.colour + self.visible + _OVERLAP * self.overlap + _KEYPOINTS * self.keypoints


def losses(logits: Tensor, shares: Tensor, points: Tensor, visible_known: Tensor) -> Losses:
    """The terms for logits (B, C + 1 + K, h, w), shares (B, C + 1, h, w) in [0, 1], and points (B, K, 2) in cells.

    Points that are NaN or outside are asked to be nowhere: an even heatmap. What is visible counts in the pictures (B,)
    where it is known.
    """
    classes = shares.shape[1] - 1
    log_share = F.log_softmax(logits[:, :classes], 1)
    robot, visible = 1 - shares[:, 0], shares[:, classes]
    weight = 1 + _ROBOT_WEIGHT * robot + _EDGE_WEIGHT * _edges(robot)
    colour = -((log_share * shares[:, :classes]).sum(1) * weight).mean()
    known = visible_known.float()
    crossed = F.binary_cross_entropy_with_logits(logits[:, classes], visible, weight=weight, reduction="none")
    seen = _mean(crossed.mean((1, 2)), known)
    overlap = _dice(1 - log_share[:, 0].exp(), robot).mean()
    overlap = overlap + _mean(_dice(logits[:, classes].sigmoid(), visible), known)
    return Losses(colour, seen, overlap, _keypoints(logits[:, classes + 1 :], points))


def _edges(robot: Tensor) -> Tensor:
    """The range of the shares within a few cells."""
    padding = _EDGE_CELLS // 2
    most = F.max_pool2d(robot[:, None], _EDGE_CELLS, 1, padding)
    least = -F.max_pool2d(-robot[:, None], _EDGE_CELLS, 1, padding)
    return (most - least)[:, 0]


def _dice(found: Tensor, wanted: Tensor) -> Tensor:
    """1 - 2 |A and B| / (|A| + |B|) (B,) of shares (B, h, w)."""
    both = (found * wanted).sum((1, 2))
    each = found.sum((1, 2)) + wanted.sum((1, 2))
    return 1 - (2 * both + _OVERLAP_SOFTENING) / (each + _OVERLAP_SOFTENING)


def _mean(values: Tensor, weights: Tensor) -> Tensor:
    """Of values (B,) with weights (B,); 0 where all weights are."""
    return (values * weights).sum() / weights.sum().clamp(min=1)


def _keypoints(heat: Tensor, points: Tensor) -> Tensor:
    """Cross entropy between a Gaussian around each point and the softmax of its heatmap (B, K, h, w)."""
    batch, count, height, width = heat.shape
    size = torch.tensor([width, height], dtype=points.dtype)
    inside = ((points > -0.5) & (points < size - 0.5)).all(-1)
    place = torch.where(inside[..., None], points, torch.zeros_like(points))
    log_share = F.log_softmax(heat.flatten(2), 2).view(batch, count, height, width)
    across, down = (_bell(place[..., axis], cells) for axis, cells in ((0, width), (1, height)))
    wrong = -torch.einsum("bkhw,bkh,bkw->bk", log_share, down, across)
    uneven = -log_share.mean((2, 3))
    absent = (uneven * ~inside).sum() / (~inside).sum().clamp(min=1)
    return (wrong * inside).sum() / inside.sum().clamp(min=1) + _ABSENT * absent


def _bell(place: Tensor, cells: int) -> Tensor:
    """(B, K, cells): shares of a Gaussian around place (B, K)."""
    apart = torch.arange(cells, dtype=place.dtype) - place[..., None]
    bell = torch.exp(-(apart**2) / (2 * _SPREAD_CELLS**2))
    return bell / bell.sum(-1, keepdim=True)
