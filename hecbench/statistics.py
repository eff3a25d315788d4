"""Intervals, paired tests and ranks. A mean never stands without its median, a rate never without n and an
interval.

All intervals are 95 % ones. The computations are SciPy's.
"""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from hecbench.se3 import Array

CONFIDENCE = 0.95
_RESAMPLES = 2000
_LEAST_VALUES = 5
"""Fewer independent values give no interval: their bootstrap distribution has too few places to end at."""


@dataclass(frozen=True)
class Interval:
    """A value with the ends of its 95 % interval."""

    value: float
    low: float
    high: float


def wilson(successes: int, trials: int) -> Interval:
    """A success rate with its score interval (Wilson 1927)."""
    from scipy.stats import binomtest

    interval = binomtest(successes, trials).proportion_ci(CONFIDENCE, method="wilson")
    return Interval(successes / trials, float(interval.low), float(interval.high))


def root_mean_square(values: ArrayLike, axis: int = -1) -> Array:
    """Root of the mean square along an axis."""
    return np.asarray(np.sqrt(np.mean(np.square(values), axis=axis)))


def bootstrap(values: ArrayLike, statistic: Callable[..., ArrayLike] = np.mean, seed: int = 0) -> Interval:
    """`statistic(values, axis=...)` of independent values (N,) with its percentile interval (Efron 1979).

    The order of the values does not matter; the ends are NaN for fewer than five.
    """
    from scipy import stats

    values = np.sort(np.asarray(values, float))
    estimate = float(np.asarray(statistic(values, axis=-1)))
    if len(values) < _LEAST_VALUES:
        return Interval(estimate, float("nan"), float("nan"))
    interval = stats.bootstrap(
        (values,),
        statistic,
        n_resamples=_RESAMPLES,
        confidence_level=CONFIDENCE,
        method="percentile",
        random_state=np.random.default_rng(seed),
    ).confidence_interval
    return Interval(estimate, float(interval.low), float(interval.high))


def clustered_rms(values: ArrayLike, clusters: Sequence[Hashable], seed: int = 0) -> Interval:
    """Root mean square of values (N,) when those of one cluster are not independent, with its interval."""
    squares = cluster_bootstrap(np.square(values), clusters, seed)
    return Interval(*(float(np.sqrt(end)) for end in (squares.value, squares.low, squares.high)))


def cluster_bootstrap(values: ArrayLike, clusters: Sequence[Hashable], seed: int = 0) -> Interval:
    """The mean of values (N,) when those of one cluster (one calibration, say) are not independent.

    Whole clusters are resampled (Davison and Hinkley 1997, section 3.8). The order of the values does not matter; the
    ends are NaN for fewer than five clusters.
    """
    if len(set(clusters)) == len(clusters):
        return bootstrap(values, seed=seed)
    from scipy import stats

    values = np.asarray(values, float)
    _, labels = np.unique(np.array([repr(cluster) for cluster in clusters]), return_inverse=True)
    order = np.lexsort((values, labels))
    values, labels = values[order], labels[order]
    sums, counts = np.bincount(labels, values), np.bincount(labels)

    def ratio(cluster_sums: Array, cluster_counts: Array, axis: int = -1) -> Array:
        return np.asarray(cluster_sums.sum(axis) / cluster_counts.sum(axis))

    estimate = float(values.mean())
    if len(sums) < _LEAST_VALUES:
        return Interval(estimate, float("nan"), float("nan"))
    interval = stats.bootstrap(
        (sums, counts),
        ratio,
        paired=True,
        n_resamples=_RESAMPLES,
        confidence_level=CONFIDENCE,
        method="percentile",
        random_state=np.random.default_rng(seed),
    ).confidence_interval
    return Interval(estimate, float(interval.low), float(interval.high))


def paired_success_p(first: Sequence[bool], second: Sequence[bool]) -> float:
    """Two-sided p that two methods succeed equally often on the same trials (exact test, McNemar 1947)."""
    from scipy.stats import binomtest

    if len(first) != len(second):
        raise ValueError(f"{len(first)} and {len(second)} trials are not pairs")
    only_first = sum(a and not b for a, b in zip(first, second, strict=True))
    only_second = sum(b and not a for a, b in zip(first, second, strict=True))
    discordant = only_first + only_second
    return float(binomtest(only_first, discordant).pvalue) if discordant else 1.0


def paired_error_p(first: ArrayLike, second: ArrayLike) -> float:
    """Two-sided p that paired errors (N,) do not differ (signed ranks, Wilcoxon 1945)."""
    from scipy.stats import wilcoxon

    first, second = np.asarray(first, float), np.asarray(second, float)
    if first.shape != second.shape:
        raise ValueError(f"{first.shape} and {second.shape} errors are not pairs")
    return 1.0 if np.array_equal(first, second) else float(wilcoxon(first, second).pvalue)


def shared_ranks(intervals: Sequence[Interval]) -> list[int]:
    """Ranks from 1, smaller is better: one plus the number of those whose whole interval lies below one's
    own.
    """
    lows = [interval.value if np.isnan(interval.low) else interval.low for interval in intervals]
    highs = [interval.value if np.isnan(interval.high) else interval.high for interval in intervals]
    return [1 + sum(high < low for high in highs) for low in lows]
