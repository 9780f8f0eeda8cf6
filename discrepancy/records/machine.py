"""The nominal machine, and how well each of its parameters is known, from one mapping.

The mapping, a YAML file, is a machine as every command takes it, with one key more, which may be left out:

    uncertainty:                     # relative standard deviations [-]
      table_inertia: 0.02
      input_joint.stiffness: 0.25
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from discrepancy.indexer.parameters import UNCERTAINTY
from indexer_env.checks import check_choice, check_number
from indexer_env.errors import refuse
from indexer_env.machine import Machine, machine_from_mapping

KEY = "uncertainty"

DRIVE = "drive"
"""Key by which machine.yaml is told to be that of a drive: it holds the name of its file."""


def nominal_machine(mapping: Mapping[str, Any]) -> tuple[Machine, dict[str, float]]:
    """The machine, and the uncertainties stated in place of `UNCERTAINTY`.

    Raises
    ------
    ParameterError
        What `machine_from_mapping` refuses; an uncertainty of a parameter that no fit moves, or outside (0, 1].
    """
    content = dict(mapping)
    if DRIVE in content:
        remedy = "add system=FILE.py, the drive's own file, to the command"
        raise refuse("discrepancy", "machine", "an indexing table's and not a drive's", content[DRIVE], remedy)
    stated: Any = content.pop(KEY, None) or {}
    if not isinstance(stated, Mapping):
        raise refuse("Machine", KEY, "a mapping of parameters to relative standard deviations", stated)
    for name, value in stated.items():
        check_choice("Machine", KEY, name, UNCERTAINTY)
        check_number(KEY, str(name), value, low=0.0, low_open=True, high=1.0)
    return machine_from_mapping(content), {str(name): float(value) for name, value in stated.items()}
