"""A user's file runs as it would by itself, and what compiled code of it raises is not taken for numbers."""

from pathlib import Path

import numba
import numpy as np
import pytest

from discrepancy.drives.channels import Record
from discrepancy.drives.compiled_rates import integrable
from discrepancy.drives.door import subject_of
from discrepancy.drives.forces import CONTACT
from discrepancy.drives.forward import ForwardModel
from discrepancy.model import NONE
from indexer_env.errors import IndexerError
from tests.discrepancy.drives.made import FILE, drive, record
from tests.discrepancy.drives.test_forward import FILE as PENDULUM
from tests.discrepancy.drives.test_forward import PUSH, RATE, T

Q = 0.4 + 0.2 * np.sin(3.0 * T)


@pytest.mark.parametrize("first", ["", "from __future__ import annotations\n"])
def test_a_file_may_have_a_dataclass(first: str, tmp_path: Path) -> None:
    """Whether or not its annotations are text."""
    held = "from dataclasses import dataclass\n\n\n@dataclass\nclass Held:\n    mass: float = 90.0\n"
    assert drive(tmp_path, f"{first}{held}{FILE}").parameters[0].nominal == 90.0


@pytest.mark.parametrize(
    ("there", "instead"),
    [
        ("sin(x.q)", "sin(x.q) / x.q"),
        pytest.param(
            "    return x.v", "    if x.q == 0.0:\n        raise ValueError('no')\n    return x.v",
            marks=pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning"),
        ),
    ],
)  # fmt: skip
def test_compiled_rates_that_fail_leave_no_numbers(there: str, instead: str, tmp_path: Path) -> None:
    """A division by zero, of which nothing is printed, and what raises."""
    one = drive(tmp_path, PENDULUM.replace(there, instead))
    row = np.array([p.nominal for p in one.parameters])
    rates, fast = integrable(one, ["u"], np.array([0.3, 0.0]), np.array([0.1]), row)
    called = numba.njit(lambda f, x, u, t, row, out: f(x, u, t, row, out))
    out = np.zeros(2)
    for q, finite in ((0.3, True), (0.0, False)):
        called(rates, np.array([q, 0.0]), np.array([0.1]), 0.0, row, out)
        assert fast and np.isfinite(out).all() == finite


@pytest.mark.parametrize("unit", ["N m", "A"])
def test_friction_by_load_needs_an_input_that_is_a_force(unit: str, tmp_path: Path) -> None:
    record = Record("a.csv", RATE, {"q": Q, "u": PUSH}, {"q": "rad", "u": unit})
    made = subject_of(drive(tmp_path, PENDULUM), [record])
    said = "Not looked for, as the first input must be a force in N m, got A: friction.load."
    assert ("friction.load" in made.model.hypotheses()) == (said not in made.notes) == (unit == "N m")


@pytest.mark.parametrize("order", [(1, 2), (2, 1)])
def test_records_of_several_rates_have_windows_of_one_length(order: tuple[int, int], tmp_path: Path) -> None:
    """2 s at 200 and at 100 Hz; flanks of play are as stiff as the longer steps resolve."""
    records = [
        Record(f"{every}.csv", RATE / every, {"q": Q[::every], "u": PUSH[::every]}, {"q": "rad", "u": "N m"})
        for every in order
    ]
    model = subject_of(drive(tmp_path, f"{PENDULUM}windows = 1.0\n"), records).model
    assert isinstance(model, ForwardModel)
    lengths = model.windows.count / np.array([model.courses[k].rate for k in model.windows.track])
    np.testing.assert_allclose(lengths, lengths[0], rtol=0.05)
    stiffness = model.set_up(NONE, [p.nominal for p in model.parameters])[0][0, CONTACT]
    assert stiffness == 0.5 * RATE / max(order) * model.substeps


def test_a_value_of_machine_yaml_in_another_unit_is_refused(tmp_path: Path) -> None:
    machine = {"drive": "my_drive.py", "parameters": {"mass": {"value": 90.0, "unit": "t"}}}
    said = r"mass \(unit\) must be kg, as in my_drive\.py, got 't'; convert the value\.$"
    with pytest.raises(IndexerError, match=said):
        subject_of(drive(tmp_path), [record(lambda t, q, v, a: 95.0 * a)], machine)


def test_an_acceleration_alone_is_said_to_be_too_little(tmp_path: Path) -> None:
    with pytest.raises(IndexerError, match=r"a mapping with one of the states q, v, got \['time', 'a', 'u'\]"):
        drive(tmp_path, PENDULUM.replace('"q": "q"', '"a": "a"'))
