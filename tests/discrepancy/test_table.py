"""What no library has, taken up as a table: a drag over the speed, or over the speed and the table's angle."""

import dataclasses
import math
from collections.abc import Callable
from unittest import mock

import numpy as np
import pytest

from discrepancy.explain import explain
from discrepancy.indexer import Experiment, IndexerModel
from discrepancy.records.experiments import Experiments
from discrepancy.subjects.indexer import IndexerSubject
from discrepancy.table import Table, closed_of, tabulate
from examples.hidden_effect import real_machine
from examples.unknown_drag import with_drag
from indexer_env import Machine, OperatingPoint, Sensor, Signal, load_machine
from indexer_env.effects import EFFECTS
from indexer_env.reference import simulate_reference
from indexer_env.reference.cam import Stretch
from indexer_env.reference.equations import Equations, Load
from indexer_env.units import RPM

DRAGS = 8.0
"""N m s/rad; in the mean over a turn of the table."""


class Dragging(Equations):
    """The reference solver's equations with a drag that is nine times as large at one side of the turn as at the
    other."""

    def _load(self, stretch: Stretch) -> Load:
        listed = super()._load(stretch)
        return lambda a, p, v, *more: listed(a, p, v, *more) + DRAGS * (1.0 + 0.8 * math.cos(p)) * v


def with_uneven_drag(machine: Machine, point: OperatingPoint, samples: int) -> np.ndarray:
    """Acceleration (samples,) at 1 kHz."""
    with mock.patch("indexer_env.reference.solve.Equations", Dragging):
        return simulate_reference(machine, point, samples=samples, rtol=1e-7, atol=1e-9).table_acceleration


def taken_up(hidden: Callable[[Machine, OperatingPoint, int], np.ndarray], like: str) -> Table | None:
    """The table of what a search without any effect leaves; the truth is solved by equations of its own, has the
    play of the machine that it is `like`, and is held out at a speed between those fitted."""
    rng = np.random.default_rng(3)
    nominal, truth = load_machine(like), real_machine(rng)
    joint = dataclasses.replace(truth.input_joint, backlash=nominal.input_joint.backlash)
    truth = dataclasses.replace(truth, input_joint=joint)

    def experiment(rpm: float, load: float) -> Experiment:
        point = OperatingPoint(rpm * RPM, load, rng.uniform(0.0, 2.0 * math.pi))
        samples = int(truth.turn_duration(point) * 1000.0)
        noisy = hidden(truth, point, samples) + 0.1 * rng.standard_normal(samples)
        return Experiment(Signal(noisy, 1000.0, unit="rad/s^2"), point)

    fitted, held = (experiment(1500.0, 2.0), experiment(1100.0, 2.0)), (experiment(1300.0, 20.0),)
    model, held_out = (IndexerModel(nominal, part, without=tuple(EFFECTS)) for part in (fitted, held))
    answer = explain(model, held_out)
    subject = IndexerSubject(nominal, Sensor(), Experiments(fitted, held, ()))
    assert answer.names == ()
    return tabulate(answer, subject.forms())


@pytest.mark.parametrize(("after", "closes"), [(2.0, 0.625), (1.0, 1.0), (0.97, 1.0)])
def test_no_table_closes_more_than_what_remained(after: float, closes: float) -> None:
    """3 times the noise before; chance brings what is left below the noise."""
    assert closed_of(3.0, after, 1.0) == pytest.approx(closes, abs=1e-9)


@pytest.mark.slow
def test_a_table_closes_the_gap_of_a_hidden_quadratic_drag() -> None:
    """Seed 3."""
    table = taken_up(with_drag, "reference")
    assert table is not None and table.form.hypothesis.name == "tabulated.speed"
    assert table.closes > 0.8, (table.before, table.after, table.closes)


@pytest.mark.slow
def test_a_table_over_two_variables_closes_the_gap_of_a_drag_that_differs_over_the_turn() -> None:
    """Seed 3, no play."""
    table = taken_up(with_uneven_drag, "smooth")
    assert table is not None and table.form.hypothesis.name == "tabulated.speed_angle"
    assert table.closes > 0.8, (table.before, table.after, table.closes)
