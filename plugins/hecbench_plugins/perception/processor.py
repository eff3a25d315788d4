"""Where a training computes, and that it computes the same each time."""

from __future__ import annotations

import cv2
import torch


def prepared(threads: int, seed: int) -> str:
    """Limit the threads and seed the generators; returns torch's device."""
    torch.set_num_threads(threads)
    cv2.setNumThreads(threads)
    torch.manual_seed(seed)
    return "cuda" if torch.cuda.is_available() else "cpu"
