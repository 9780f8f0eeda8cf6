"""Refusals of the indexing machine's model, and the base joint's own start states."""

import dataclasses

import numpy as np
import pytest

from discrepancy.indexer import Experiment, IndexerModel
from discrepancy.model import NONE
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
