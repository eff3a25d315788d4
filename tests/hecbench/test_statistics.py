"""Intervals and tests against published or exact numbers."""

import numpy as np
import pytest

from hecbench import statistics
from hecbench.statistics import Interval


def test_wilson_interval_of_the_paper_grasps():
    rate = statistics.wilson(48, 54)
    assert (rate.value, rate.low, rate.high) == pytest.approx((0.8889, 0.7781, 0.9481), abs=1e-3)
    assert statistics.wilson(0, 10).low == 0.0


def test_bootstrap_covers_the_mean_at_the_nominal_rate():
    rng = np.random.default_rng(0)
    hits = 0
    for seed in range(200):
        interval = statistics.bootstrap(rng.normal(3.0, 1.0, 40), seed=seed)
        hits += interval.low <= 3.0 <= interval.high
    assert 0.88 <= hits / 200 <= 0.99


def test_bootstrap_of_one_value_has_no_interval():
    interval = statistics.bootstrap([2.0], np.median)
    assert interval.value == 2.0
    assert np.isnan([interval.low, interval.high]).all()


def test_cluster_bootstrap_is_wider_when_clusters_agree_within():
    values = np.repeat([0.0, 1.0, 1.0, 0.0, 1.0, 1.0], 9)
    clusters = np.repeat(np.arange(6), 9)
    clustered, naive = statistics.cluster_bootstrap(values, clusters), statistics.bootstrap(values)
    assert clustered.value == naive.value == pytest.approx(2 / 3)
    assert clustered.high - clustered.low > 1.5 * (naive.high - naive.low)


def test_paired_tests():
    first, second = [True] * 48 + [False] * 6, [True] * 40 + [False] * 14
    assert statistics.paired_success_p(first, second) == pytest.approx(2 * 0.5**8)
    assert statistics.paired_success_p(first, first) == 1.0
    errors = np.linspace(1, 2, 20)
    assert statistics.paired_error_p(errors, errors + 0.5) < 1e-4
    assert statistics.paired_error_p(errors, errors) == 1.0
    with pytest.raises(ValueError, match="not pairs"):
        statistics.paired_success_p([True], [True, False])


def test_ranks_are_shared_where_intervals_overlap():
    intervals = [Interval(1, 0.8, 1.2), Interval(1.1, 0.9, 1.3), Interval(5, 4, 6), Interval(4.5, 3, 9)]
    assert statistics.shared_ranks(intervals) == [1, 1, 3, 3]
    assert statistics.shared_ranks([Interval(2, np.nan, np.nan), Interval(1, np.nan, np.nan)]) == [2, 1]


def test_cluster_bootstrap_of_unequal_clusters_agrees_with_resampling_by_hand(rng):
    sizes = [1, 2, 20, 3, 1, 30, 2, 5]
    clusters = np.repeat(np.arange(len(sizes)), sizes)
    values = rng.normal(size=len(sizes))[clusters] + 0.1 * rng.normal(size=len(clusters))
    found = statistics.cluster_bootstrap(values, clusters)
    groups = [values[clusters == k] for k in range(len(sizes))]
    means = [
        np.concatenate([groups[k] for k in rng.integers(0, len(groups), len(groups))]).mean()
        for _ in range(4000)
    ]
    low, high = np.percentile(means, [2.5, 97.5])
    assert found.value == pytest.approx(values.mean())
    assert (found.low, found.high) == pytest.approx((low, high), abs=0.08 * (high - low))


def test_intervals_do_not_depend_on_the_order_of_the_values():
    rng = np.random.default_rng(1)
    values, clusters = rng.normal(0, 1, 40), np.repeat(np.arange(10), 4)
    order = rng.permutation(40)
    assert statistics.bootstrap(values, np.median) == statistics.bootstrap(values[order], np.median)
    first = statistics.cluster_bootstrap(values, clusters)
    assert first == statistics.cluster_bootstrap(values[order], clusters[order])


@pytest.mark.parametrize("count", [1, 2, 4])
def test_fewer_than_five_values_have_no_interval(count):
    values = np.arange(count, dtype=float)
    assert np.isnan(statistics.bootstrap(values).low)
    assert np.isnan(statistics.cluster_bootstrap(np.repeat(values, 3), np.repeat(np.arange(count), 3)).high)
    five = statistics.bootstrap(np.arange(5.0))
    assert five.low < five.value < five.high


def test_root_mean_square():
    assert statistics.root_mean_square([3.0, -4.0]) == pytest.approx(np.sqrt(12.5))


def test_repeats_of_a_value_narrow_no_interval(rng):
    """Fifteen pictures of each of eight robot poses tell as much as one of each."""
    values = rng.normal(2.0, 0.5, 8)
    once = statistics.bootstrap(values, statistics.root_mean_square)
    repeated = statistics.clustered_rms(np.repeat(values, 15), np.repeat(np.arange(8), 15).tolist())
    assert repeated.value == pytest.approx(once.value)
    assert repeated.high - repeated.low == pytest.approx(once.high - once.low, rel=0.1)
    blind = statistics.bootstrap(np.repeat(values, 15), statistics.root_mean_square)
    assert blind.high - blind.low < 0.5 * (once.high - once.low)
