"""The nominal machine with stated uncertainties."""

import dataclasses

import numpy as np
import pytest
import yaml

from discrepancy.indexer import Experiment
from discrepancy.indexer.parameters import base_parameters
from discrepancy.model import NONE
from discrepancy.problem import Problem
from discrepancy.records.experiments import Experiments
from discrepancy.records.machine import KEY, nominal_machine
from discrepancy.subjects.indexer import IndexerSubject
from indexer_env import OperatingPoint, Sensor, Signal, load_machine
from indexer_env.errors import ParameterError
from indexer_env.presets import load_yaml
from indexer_env.units import RPM


def test_stated_uncertainties_reach_the_fit() -> None:
    machine, stated = nominal_machine({**load_yaml("machine", "reference"), "uncertainty": {"table_inertia": 0.02}})
    scales = {p.name: p.scale for p in base_parameters(machine, stated)}
    assert (scales["table_inertia"], scales["cam_inertia"]) == (0.02, 0.1)
    assert dataclasses.replace(machine) == nominal_machine(load_yaml("machine", "reference"))[0]


@pytest.mark.parametrize(
    ("stated", "said"),
    [
        ({"table_mass": 0.1}, r"uncertainty must be one of .*got 'table_mass'; did you mean 'table_inertia'"),
        ({"table_inertia": 2.0}, r"uncertainty\.table_inertia must be .*<= 1, got 2\.0"),
        (0.1, r"Machine\.uncertainty must be a mapping"),
    ],
)
def test_a_wrong_uncertainty_is_refused(stated: object, said: str) -> None:
    with pytest.raises(ParameterError, match=said):
        nominal_machine({**load_yaml("machine", "reference"), "uncertainty": stated})


@pytest.mark.parametrize("stated", [{}, {"table_inertia": 0.02, "cam_inertia": 0.1}])
def test_what_was_known_of_the_machine_stays_as_a_comment(stated: dict[str, float]) -> None:
    """8 s of nothing at 1 kHz; beside it, cells of records at 1499.9 and 1500.1 rpm are one speed."""
    records = [
        Experiment(Signal(np.zeros(8000), 1000.0, unit="rad/s^2"), OperatingPoint(rpm * RPM), noise=1.0)
        for rpm in (1499.9, 1500.1)
    ]
    machine = load_machine("reference")
    subject = IndexerSubject(machine, Sensor(), Experiments(tuple(records), (records[0],), ()), stated)
    z = np.array([p.coordinate(p.nominal) for p in subject.model.parameters])
    place = Problem(subject.model, NONE).point(z, np.zeros((len(subject.model.counts), 4)))
    written = subject.files(subject.model, place)["machine.yaml"]
    assert KEY not in yaml.safe_load(written)
    assert ("# uncertainty:\n#   table_inertia: 0.02\n#   cam_inertia: 0.1\n" in written) == bool(stated)
    assert not {"motor speed", "load"} & {axis.name for axis in subject.view(subject.model).axes}
