"""Streams and the Sobol' sequence: item i depends on seed, part and i alone."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import qmc

from datagen.seeds import BLOCK, Chance, Part, _points, stream


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
    whole = qmc.Sobol(2, scramble=True, rng=stream(7, Part.SEQUENCE, 0)).random(4 * BLOCK)
    np.testing.assert_array_equal(points(7, 2, 2 * BLOCK + 3), whole[: 2 * BLOCK + 3])
    assert Chance(7).point(4 * BLOCK - 1, 2) == tuple(whole[-1])


@pytest.mark.parametrize("dimensions", [2, 5])
def test_the_sequence_fills_space_more_evenly_than_chance(dimensions):
    """Centred discrepancy of 256 points, worst of five seeds against the best of twenty uniform samples."""
    sobol = max(qmc.discrepancy(points(seed, dimensions, 256)) for seed in range(5))
    uniform = min(qmc.discrepancy(np.random.default_rng(seed).random((256, dimensions))) for seed in range(20))
    assert sobol < 0.5 * uniform
