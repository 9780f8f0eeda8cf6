"""Streams and the Sobol' sequence: item i depends on seed, part and i alone."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import qmc

from datagen.labels import SUBSETS, subset_schedule
from datagen.seeds import BLOCK, Chance, Part, _order, _points, stream


def test_streams_differ_by_part_item_and_seed():
    streams = [stream(seed, part, item) for seed in (1, 2) for part in Part for item in (0, 1)]
    assert len({float(generator.random()) for generator in streams}) == len(streams)
    assert stream(1, Part.SENSOR, 7).random() == stream(1, Part.SENSOR, 7).random()


def test_the_example_s_chance_is_its_own():
    own, example = Chance(5), Chance(5, example=True)
    assert own.machine(0).random() != example.machine(0).random()
    assert own.record(0).random() != example.record(0).random()
    assert own.point(0, 2) != example.point(0, 2)


def points(seed: int, dimensions: int, count: int) -> np.ndarray:
    return np.array([Chance(seed).point(draw, dimensions) for draw in range(count)])


def test_a_point_does_not_depend_on_which_were_asked_for_before():
    draws = [3 * BLOCK + 5, 0, BLOCK, BLOCK - 1, 3 * BLOCK + 5]
    there = [Chance(7).point(draw, 3) for draw in draws]
    _points.cache_clear()
    assert [Chance(7).point(draw, 3) for draw in reversed(draws)] == there[::-1]
    assert there[0] == there[4] and len(set(there)) == 4


def test_the_blocks_are_one_sequence():
    """Each block holds its own points of it, in another order."""
    whole = qmc.Sobol(2, scramble=True, rng=stream(7, Part.SEQUENCE, 0)).random(4 * BLOCK)
    found = points(7, 2, 4 * BLOCK)
    for block in range(4):
        own = slice(block * BLOCK, (block + 1) * BLOCK)
        assert sorted(found[own].tolist()) == sorted(whole[own].tolist())
        assert not np.array_equal(found[own], whole[own])


def test_the_first_points_of_a_block_are_neighbours_in_the_sequence():
    for block, count in ((0, 64), (1, 8), (2, 1)):
        places = _order(7, Part.SEQUENCE, block)[:count]
        assert sorted(places // count) == [places[0] // count] * count and len(set(places)) == count


@pytest.mark.parametrize("dimensions", [2, 5])
def test_the_sequence_fills_space_more_evenly_than_chance(dimensions):
    """Centred discrepancy of 256 points, worst of five seeds against the best of twenty uniform samples."""
    sobol = max(qmc.discrepancy(points(seed, dimensions, 256)) for seed in range(5))
    uniform = min(qmc.discrepancy(np.random.default_rng(seed).random((256, dimensions))) for seed in range(20))
    assert sobol < 0.5 * uniform


@pytest.mark.parametrize("split", [(2, 1, 1), (1, 0, 1), (6, 1, 1)])
def test_each_subset_sees_the_whole_range(split):
    """In the sequence's own order a subset gets a half of a range."""
    subsets = np.array(subset_schedule(dict(zip(SUBSETS, split, strict=True)), "split"))
    of_draw = subsets[np.arange(256) % len(subsets)]
    for seed in range(3):
        drawn = points(seed, 4, 256)
        for name in set(subsets):
            own = drawn[of_draw == name]
            assert (own.min(axis=0) < 0.25).all() and (own.max(axis=0) > 0.75).all()
