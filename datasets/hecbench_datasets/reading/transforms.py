"""Chains of stamped transforms, as robots publish them."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass, field

import numpy as np

from hecbench import se3
from hecbench.errors import InputError
from hecbench.se3 import Array
from hecbench_datasets.reading.streams import interpolate


@dataclass
class Transforms:
    """A tree of frames: rows t, x, y, z, qx, qy, qz, qw of each parent_T_child, and those that never move."""

    moving: dict[tuple[str, str], list[list[float]]] = field(default_factory=lambda: defaultdict(list))
    fixed: dict[tuple[str, str], list[float]] = field(default_factory=dict)

    @property
    def frames(self) -> set[str]:
        """Every name."""
        return {name for pair in (*self.moving, *self.fixed) for name in pair}

    def add(self, parent: str, child: str, stamp_s: float, pose: list[float], fixed: bool) -> None:
        """One message."""
        pair = parent.lstrip("/"), child.lstrip("/")
        if fixed:
            self.fixed[pair] = pose
        else:
            self.moving[pair].append([stamp_s, *pose])

    def chain(self, base: str, tip: str) -> tuple[Array, Array]:
        """Stamps (N,) s and base_T_tip (N, 4, 4) m.

        Raises:
            InputError: the frames are not connected, or nothing between them moves.
        """
        path = self._path(base, tip)
        moving = [(pair, self._rows(pair)) for pair, _ in path if pair in self.moving]
        if not moving:
            raise InputError(f"nothing moves between the frames {base} and {tip}")
        stamps = max((rows for _, rows in moving), key=len)[:, 0]
        start, end = max(rows[0, 0] for _, rows in moving), min(rows[-1, 0] for _, rows in moving)
        stamps = stamps[(stamps >= start) & (stamps <= end)]
        known = dict(moving)
        pose = np.broadcast_to(np.eye(4), (len(stamps), 4, 4))
        for pair, forward in path:
            if pair in known:
                numbers = interpolate(known[pair][:, 0], known[pair][:, 1:], stamps)
            else:
                numbers = np.array([self.fixed[pair]])
            parent_T_child = se3.from_quat_xyzw(numbers[:, 3:], numbers[:, :3])
            pose = pose @ (parent_T_child if forward else se3.inverse(parent_T_child))
        return stamps, np.asarray(pose)

    def _rows(self, pair: tuple[str, str]) -> Array:
        rows = np.array(self.moving[pair])
        _, first = np.unique(rows[:, 0], return_index=True)
        return rows[first]

    def _path(self, base: str, tip: str) -> list[tuple[tuple[str, str], bool]]:
        """Pairs from one frame to the other, and whether each is walked from parent to child."""
        ways = {base: []} if base in self.frames else {}  # type: dict[str, list[tuple[tuple[str, str], bool]]]
        waiting = list(ways)
        pairs = (*self.moving, *self.fixed)
        while waiting and tip not in ways:
            frame = waiting.pop(0)
            for pair in pairs:
                for start, end, forward in ((*pair, True), (pair[1], pair[0], False)):
                    if start == frame and end not in ways:
                        ways[end] = [*ways[frame], (pair, forward)]
                        waiting.append(end)
        if tip not in ways:
            known = ", ".join(sorted(self.frames)[:20])
            raise InputError(f"no transforms lead from {base} to {tip}; there are {known}")
        return ways[tip]
