"""Refusals of the indexing machine's model, and the base joint's own start states."""

import dataclasses

import numpy as np
import pytest

from discrepancy.indexer import Experiment, IndexerModel
from discrepancy.model import NONE, Jobs
from indexer_env import OperatingPoint, Sensor, Signal, load_machine
from indexer_env.errors import ParameterError


def record(samples: int) -> Experiment:
    return Experiment(Signal(np.sin(0.1 * np.arange(float(samples))), 1000.0, unit="rad/s^2"), OperatingPoint())


def test_too_short_records_are_refused() -> None:
    with pytest.raises(ParameterError, match=r"hold 4 whole cam turns or more in all, got 1; record for longer"):
        IndexerModel(load_machine("reference"), [record(2200)])


def test_another_unit_than_the_sensor_gives_is_refused() -> None:
    with pytest.raises(ParameterError, match=r"must be in m/s\^2, got 'rad/s\^2'; set Sensor\.radius"):
        IndexerModel(load_machine("reference"), [record(8200)], Sensor(radius=0.3))


def test_a_machine_of_another_model_is_refused() -> None:
    machine = dataclasses.replace(load_machine("reference"), model="A")
    with pytest.raises(ParameterError, match=r"Machine\.model must be 'B', got 'A'"):
        IndexerModel(machine, [record(8200)])


def test_only_a_loose_base_has_housing_states() -> None:
    model = IndexerModel(load_machine("reference"), [record(8200)])
    loose = model.hypotheses()["base.looseness"][0]
    assert (model.local_count(NONE), model.local_count(loose)) == (4, 6)
    assert model.extended(loose).local_count(NONE) == 6


def test_hum_takes_the_phase_of_each_window() -> None:
    """A record that is the machine's own plus hum, its phase another one in every window, leaves nothing."""
    signal = record(8200).signal
    nominal = IndexerModel(load_machine("reference"), [Experiment(signal, OperatingPoint(), noise=1.0)])
    hypothesis = nominal.hypotheses()["sensor.mains_hum"][0]
    plain = np.zeros((1, len(nominal.parameters)))
    jobs = Jobs(plain, np.zeros(len(nominal.counts), dtype=int), np.arange(len(nominal.counts)), states(nominal))
    values, clean = signal.values.copy(), nominal.residuals(NONE, jobs)
    for row, (first, count) in enumerate(zip(nominal.windows.first, nominal.counts, strict=True)):
        hum = 0.5 * np.sin(2.0 * np.pi * 50.0 * np.arange(count) / 1000.0 + 1.3 * row)
        values[first : first + count] += clean[row, :count] + hum
    humming = IndexerModel(
        nominal.machine, [Experiment(Signal(values, 1000.0, unit="rad/s^2"), OperatingPoint(), noise=1.0)]
    )
    for amplitude, left in ((0.5, 0.0), (0.3, 0.2 / 2.0**0.5)):
        point = np.concatenate([plain[0], hypothesis.coordinates((amplitude,))])[None]
        found = humming.residuals(hypothesis, Jobs(point, jobs.point, jobs.window, jobs.states))
        assert np.sqrt((found**2).sum(axis=1) / humming.counts) == pytest.approx(left, abs=0.01)


def test_a_slipping_motor_that_fails_is_worse_than_any_other() -> None:
    """A load far beyond the motor's torque: no run, and no window that looks like one."""
    signal = Signal(np.sin(0.1 * np.arange(8200.0)), 1000.0, unit="rad/s^2")
    model = IndexerModel(load_machine("reference"), [Experiment(signal, OperatingPoint(load_torque=1e5), noise=1.0)])
    hypothesis = model.hypotheses()["drive.slip"][0]
    point = np.concatenate([np.zeros(len(model.parameters)), hypothesis.coordinates((50.0,))])[None]
    windows = np.arange(len(model.counts))
    found = model.residuals(hypothesis, Jobs(point, 0 * windows, windows, states(model)))
    assert (np.abs(found).max(axis=1) == 1e3).all()


def states(model: IndexerModel) -> np.ndarray:
    return np.zeros((len(model.counts), model.local_count(NONE)))
