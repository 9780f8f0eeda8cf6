"""The indexes in a record and its sign are told on faulty machines, and not where there is nothing to tell."""

import numpy as np
import pytest

from classifier.indexing import indexing_of
from datagen.recipes import Recipe, make
from datagen.shard import read_shards
from indexer_experiments.compare.recipes import drawn


def rigid(share, stations=8, start=0.3, samples=8200):
    """Acceleration of a rigid table under the cycloidal law that moves for a share of the time, up to a factor."""
    phase = (np.arange(samples) / samples * stations + start) % 1.0
    return np.where(phase < share, np.sin(2.0 * np.pi * phase / share), 0.0)


def senses(records):
    return np.array([indexing_of(record).sense for record in records])


def test_the_sign_is_told_on_every_faulty_machine_wherever_its_record_begins(machines):
    """Forty records of 20 faults that begin anywhere, by a sensor with its noise, drift and hum; in rad/s² too."""
    for factor in (1.0, 1.0 / 0.4):
        assert np.array_equal(senses(factor * machines.records), np.ones(40))
        assert np.array_equal(senses(-factor * machines.records), -np.ones(40))
    stations = [indexing_of(record).stations for record in machines.records]
    assert stations == pytest.approx(np.full(40, 8.0), abs=0.2)


def test_noise_as_strong_as_the_signal_does_not_hide_it(machines):
    """White noise of 0 dB, seed 0, and a drift of 0.5 m/s² a second."""
    noise = np.random.default_rng(0).standard_normal(machines.records.shape)
    noisy = machines.records + machines.records.std(axis=1, keepdims=True) * noise
    assert np.array_equal(senses(noisy + 0.5 * np.arange(8200) / 1000.0), np.ones(40))


@pytest.mark.parametrize("share", [0.2, 0.33, 0.5, 0.6])
@pytest.mark.parametrize("stations", [4, 6, 12, 48])
def test_other_cams(share, stations):
    record = rigid(share, stations)
    found = indexing_of(record)
    assert (found.sense, indexing_of(-record).sense) == (1, -1)
    assert found.stations == pytest.approx(stations, rel=0.03)


def test_noise_has_no_sign():
    """Of 300 records of white noise and 300 of its sum, seed 0, 2 % at most are taken for indexing."""
    white = np.random.default_rng(0).standard_normal((300, 8200))
    for noise in (white, np.cumsum(white, axis=1)):
        assert np.mean(senses(noise) != 0) <= 0.02


@pytest.mark.parametrize(
    "record",
    [rigid(1.0), np.sin(2 * np.pi * 33 * np.arange(8200) / 1000), np.zeros(500), np.ones(500), np.arange(6.0)],
    ids=["a table that never dwells", "a tone", "zeros", "ones", "a few samples"],
)
def test_what_has_no_dwells_has_no_sign(record):
    assert indexing_of(record).sense == 0


@pytest.mark.slow
@pytest.mark.parametrize(
    "recipe",
    [
        Recipe("bench", ("campaign=bench",)),
        drawn(300),
        Recipe("varied", ("campaign=random", "sensor=bench", "campaign.machines=300")),
        Recipe("angular", ("campaign=random", "campaign.machines=300")),
    ],
    ids=lambda recipe: recipe.name,
)
def test_how_often_the_sign_is_told(recipe, tmp_path):
    """Shares of records whose sign is told rightly and wrongly, in white noise (docs/explanation/sign.md); seed 0."""
    records = read_shards(make(recipe, 0, tmp_path)).records.astype(np.float64)
    rng, told = np.random.default_rng(0), {}
    for decibels in (np.inf, 10, 0, -5, -10, -20):
        noise = 10.0 ** (-decibels / 20.0) * records.std(axis=1, keepdims=True) * rng.standard_normal(records.shape)
        found = senses(records + noise)
        told[decibels] = float(np.mean(found == 1)), float(np.mean(found == -1))
        assert np.array_equal(senses(-(records + noise)), -found)
    print(recipe.name, len(records), told)
    assert all(told[decibels] == (1.0, 0.0) for decibels in (np.inf, 10, 0))
    assert told[-10][1] == 0.0
