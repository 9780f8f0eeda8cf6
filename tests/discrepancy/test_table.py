"""What no library has, taken up as a table: a drag over the speed, a friction over the speed and the angle."""

import math
from collections.abc import Callable

import numpy as np
import pytest

from discrepancy.explain import explain
from discrepancy.indexer import Experiment, IndexerModel
from discrepancy.records.experiments import Experiments
from discrepancy.subjects.indexer import IndexerSubject
from discrepancy.table import Table, tabulate
from examples.hidden_effect import real_machine
from examples.unknown_drag import DRAG, with_drag
from indexer_env import Machine, OperatingPoint, Sensor, Signal, load_machine
from indexer_env.effects import EFFECTS
from indexer_env.units import RPM
from indexer_experiments.challenge.truth import run
from indexer_experiments.challenge.unlisted import NOTHING, Bump

PATCH = Bump(30.0, 0.4, 0.5)
"""Dry friction [N m] at its most, where in the table's turn, and half of the part of it where it acts [turns]."""


def with_patch(machine: Machine, point: OperatingPoint, samples: int) -> np.ndarray:
    """Acceleration (samples,) at 1 kHz of a table that drags and rubs on one side."""
    return run(machine, point, samples, 1000.0, NOTHING._replace(quadratic=DRAG, patch=PATCH))[0]


def taken_up(hidden: Callable[[Machine, OperatingPoint, int], np.ndarray]) -> Table | None:
    """The table of what a search without any effect leaves; the truth is solved by the challenge's own equations, the
    speed held out lies between those fitted."""
    rng = np.random.default_rng(3)
    truth = real_machine(rng)

    def experiment(rpm: float, load: float) -> Experiment:
        point = OperatingPoint(rpm * RPM, load, rng.uniform(0.0, 2.0 * math.pi))
        samples = int(truth.turn_duration(point) * 1000.0)
        noisy = hidden(truth, point, samples) + 0.1 * rng.standard_normal(samples)
        return Experiment(Signal(noisy, 1000.0, unit="rad/s^2"), point)

    fitted, held = (experiment(1500.0, 2.0), experiment(1100.0, 2.0)), (experiment(1300.0, 20.0),)
    nominal = load_machine("reference")
    model, held_out = (IndexerModel(nominal, part, without=tuple(EFFECTS)) for part in (fitted, held))
    answer = explain(model, held_out)
    subject = IndexerSubject(nominal, Sensor(), Experiments(fitted, held, (("", ""), ("",)), ()))
    assert answer.names == ()
    return tabulate(answer, subject.forms())


@pytest.mark.slow
def test_a_table_closes_the_gap_of_a_hidden_quadratic_drag() -> None:
    """Seed 3."""
    table = taken_up(with_drag)
    assert table is not None and table.form.hypothesis.name == "tabulated.speed"
    assert table.closes > 0.8, (table.before, table.after, table.closes)


@pytest.mark.slow
def test_a_table_over_two_variables_closes_the_gap_of_a_friction_that_follows_both() -> None:
    """Seed 3. A drag with the square of the speed, and dry friction at a part of the turn."""
    table = taken_up(with_patch)
    assert table is not None and table.form.hypothesis.name == "tabulated.speed_angle"
    assert table.closes > 0.8, (table.before, table.after, table.closes)
