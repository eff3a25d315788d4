"""Which of a grid's points is the first, when a board looks the same upside down: the hand motion tells.

Between two samples the hand and the target turn by the same angle, whatever the calibration is; a board that
was read upside down in one of them turns by another. One turn of all samples together stays free and does not
matter: it only names the target's frame.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from hecbench import se3
from hecbench.se3 import Array
from hecbench_plugins.detection.settings import ORIENTATION


def unmirrored(grid: Array) -> Array:
    """The grid (rows, columns, 2) with its columns reversed if it was seen from behind."""
    x, y = grid[0, -1] - grid[0, 0], grid[-1, 0] - grid[0, 0]
    return grid if x[0] * y[1] - x[1] * y[0] > 0 else grid[:, ::-1]


def is_regular(grid: Array) -> bool:
    """Whether the points (rows, columns, 2) are a grid's picture: a homography fits to a fraction of a cell.

    The fit is the direct linear transformation (Hartley and Zisserman 2004, algorithm 4.2); lenses bend a grid
    by less.
    """
    rows, columns = grid.shape[:2]
    v, u = np.mgrid[:rows, :columns].reshape(2, -1) / max(rows, columns) - 0.5
    centre, scale = grid.reshape(-1, 2).mean(0), grid.std()
    x, y = ((grid.reshape(-1, 2) - centre) / scale).T
    one, zero = np.ones_like(u), np.zeros_like(u)
    first = np.stack([u, v, one, zero, zero, zero, -x * u, -x * v, -x], 1)
    second = np.stack([zero, zero, zero, u, v, one, -y * u, -y * v, -y], 1)
    H = np.linalg.svd(np.vstack([first, second]))[2][-1].reshape(3, 3)
    fitted = np.stack([u, v, one], 1) @ H.T
    gaps = (fitted[:, :2] / fitted[:, 2:] - np.stack([x, y], 1)) * scale
    cells = [np.linalg.norm(np.diff(grid, axis=axis), axis=2).min() for axis in (0, 1)]
    return bool(np.sqrt((gaps**2).sum(1).mean()) < ORIENTATION.irregular * min(cells))


def turned_grids(grid: Array) -> list[Array]:
    """The grid (rows, columns, 2) read from each end: two ways, or four when it is square."""
    quarters = range(4) if grid.shape[0] == grid.shape[1] else range(0, 4, 2)
    return [np.rot90(grid, quarter) for quarter in quarters]


def choose_turns(hand: Array, candidates: Array) -> NDArray[np.int64]:
    """Which reading of each sample makes hand and target turn by the same angles.

    Minimises the sum over pairs of the squared, limited difference of the angles, by coordinate descent from
    the choices that agree best with each sample. Of the equal answers the one that turns fewest is given.

    Args:
        hand: H (N, 4, 4) m.
        candidates: camera_T_target (N, K, 4, 4) m, one per reading.

    Returns:
        (N,) indices below K.
    """
    count, ways = candidates.shape[:2]
    hand_angles = se3.rotation_error_rad(hand[:, None], hand[None])
    angles = se3.rotation_error_rad(candidates[:, :, None, None], candidates[None, None])
    gaps = (angles - hand_angles[:, None, :, None]) / ORIENTATION.angle_sigma_rad
    cost = np.nan_to_num(np.minimum(gaps**2, ORIENTATION.robust_limit), nan=ORIENTATION.robust_limit)
    each = np.arange(count)
    cost[each, :, each, :] = 0.0

    def energy(choice: NDArray[np.int64]) -> float:
        return float(cost[each[:, None], choice[:, None], each, choice].sum())

    def descend(choice: NDArray[np.int64]) -> NDArray[np.int64]:
        for _ in range(ways * count):
            costs = cost[:, :, each, choice].sum(2)
            better = costs.argmin(1)
            gains = costs[each, choice] - costs[each, better]
            worst = int(gains.argmax())
            if gains[worst] <= 1e-9:
                break
            choice = choice.copy()
            choice[worst] = better[worst]
        return choice

    starts = (cost[i, 0].argmin(1) for i in range(count))
    best = min((descend(start) for start in starts), key=energy)
    return np.asarray((best - np.bincount(best, minlength=ways).argmax()) % ways)
