"""A turn along its principal components."""

from __future__ import annotations

import dataclasses

import numpy as np

from indexer_env import make_effect
from tests.twin.builders import CELLS, MACHINE, Fixed, components, healthy, record, synthesis, view
from tests.twin.test_judge import twin
from tests.twin.test_synthesis import POINT, told
from twin.components import Components, patterns_of
from twin.diagnosis import HEALTHY, UNKNOWN
from twin.faults import FAULTS, chosen
from twin.refine import fitted
from twin.synthesis import effect_of

ALIKE = chosen(["crack", "loose_base", "reducer_play"])
WEIGHED = MACHINE.with_effects(make_effect("load.imbalance", torque=90.0, phase=1.0))


def test_white_noise_stays_white_and_its_scatter_tells_its_covariance():
    """seed 0"""
    along = components(6, 2)
    x = np.random.default_rng(0).standard_normal((4000, CELLS.stations, CELLS.count))
    m = along.of(x)
    assert m.shape == (4000, along.count) == (4000, 18)
    assert np.abs(m.T @ m / len(m) - np.eye(18)).max() < 0.09
    assert np.abs(along.scatter(x).mean(axis=0) - np.eye(18)).max() < 0.09


def test_what_follows_a_pattern_is_no_scatter():
    along = components(6, 2)
    shape = np.cos(np.arange(CELLS.count) / 4.0)
    x = 100.0 * (along.patterns[0][:, None] * shape + 2.0 * along.patterns[1][:, None] * shape + shape)[None]
    assert np.abs(along.scatter(x)).max() < 1e-12 * np.abs(along.of(x)).max() ** 2
    assert along.mean_only().of(x).shape == (1, 6)
    assert np.abs(along.mean_only().scatter(x)).max() < 1e-12 * np.abs(along.of(x)).max() ** 2
    mean, first, second = along.of(x).reshape(3, 6)
    assert np.allclose(2.0 * first, second)
    assert np.allclose(mean, np.sqrt(CELLS.stations) * first)


def test_what_an_imbalance_does_is_no_scatter_from_whichever_station_a_turn_begins():
    along = dataclasses.replace(components(6, 2), patterns=patterns_of(WEIGHED, ALIKE)).mean_only()
    x = 100.0 * (along.patterns[0][:, None] * np.cos(np.arange(CELLS.count) / 4.0))[None]
    for first in range(8):
        assert np.abs(along.scatter(np.roll(x, first, axis=1))).max() < 1e-20


def test_a_machine_or_a_fault_table_with_an_imbalance_has_the_patterns_of_the_tables_angle():
    assert patterns_of(MACHINE, ALIKE).shape == (0, 8)
    for found in (patterns_of(WEIGHED, ALIKE), patterns_of(MACHINE, [*ALIKE, FAULTS["imbalance"]])):
        angle = 2.0 * np.pi * np.arange(8) / 8
        assert np.allclose(found @ found.T, np.eye(2))
        assert np.allclose(found.sum(axis=1), 0.0)
        assert np.allclose(found.T @ (found @ np.cos(angle + 0.7)), np.cos(angle + 0.7))


def test_too_few_stations_leave_nothing_to_tell_chance_by():
    assert patterns_of(dataclasses.replace(WEIGHED, stations=3), ALIKE).shape == (0, 3)


def test_components_are_stored_and_come_back():
    along = components(6, 2)
    back = Components.restore(along.arrays())
    assert all(np.array_equal(getattr(back, name), value) for name, value in vars(along).items())


def test_the_patterns_tell_the_size_of_an_imbalance_that_the_mean_hardly_shows():
    names = ("friction", "imbalance")
    signal, stated = record(MACHINE.with_effects(effect_of(FAULTS["imbalance"], 0.1, MACHINE, 2.0, 0)))
    (found,) = CELLS.turns(signal.values, MACHINE.reduction * stated.motor_speed, 3.0)
    reference = healthy().turn(POINT)
    x = view().measured(found - reference, reference, POINT)[None]
    of = synthesis(names)
    of_table = dataclasses.replace(components(16), patterns=patterns_of(MACHINE, chosen(names)))
    none = np.zeros((of_table.count, of_table.count))
    wide = dataclasses.replace(of, components=of_table, covariance=np.eye(of_table.count), open=none, growth=none)
    guess = told([-9.0, 3.0], [0.1, 0.2])
    by_patterns, by_mean = fitted(wide, x, [POINT], guess), fitted(of, x, [POINT], guess)
    assert abs(by_patterns.size[0, 1] - 0.1) < 0.002
    assert by_patterns.error[0, 1] < 0.1 * by_mean.error[0, 1]


def test_a_turn_whose_stations_are_not_known_is_judged_by_its_mean():
    quiet = twin(Fixed(-1.0, [-9.0] * len(FAULTS)), alone=False)
    quiet = dataclasses.replace(quiet, synthesis=synthesis(tuple(FAULTS), patterns=2))
    assert quiet.synthesis is not None
    along = quiet.synthesis.components
    x = 30.0 * (along.patterns[0][:, None] * along.station_axes[:, 5])[None]
    assert quiet.judged(x, POINT, True).verdict == UNKNOWN
    assert quiet.judged(x, POINT, False).verdict == HEALTHY
