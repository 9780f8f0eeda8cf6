"""The nominal machine with stated uncertainties."""

import dataclasses

import pytest

from discrepancy.indexer.parameters import base_parameters
from discrepancy.records.machine import nominal_machine
from indexer_env.errors import ParameterError
from indexer_env.presets import load_yaml


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
