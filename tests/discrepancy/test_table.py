"""A hidden drag that no library has, taken up as a table over the table's speed."""

import math

import numpy as np
import pytest

from discrepancy.explain import explain
from discrepancy.indexer import Experiment, IndexerModel
from discrepancy.records.experiments import Experiments
from discrepancy.subjects.indexer import IndexerSubject
from discrepancy.table import tabulate
from examples.hidden_effect import real_machine
from examples.unknown_drag import with_drag
from indexer_env import OperatingPoint, Sensor, Signal, load_machine
from indexer_env.effects import EFFECTS
from indexer_env.units import RPM


@pytest.mark.slow
def test_a_table_closes_the_gap_of_a_hidden_quadratic_drag() -> None:
    """Seed 3; the truth is solved by the challenge's own equations, the speed held out lies between those fitted."""
    rng = np.random.default_rng(3)
    truth = real_machine(rng)

    def experiment(rpm: float, load: float) -> Experiment:
        point = OperatingPoint(rpm * RPM, load, rng.uniform(0.0, 2.0 * math.pi))
        samples = int(truth.turn_duration(point) * 1000.0)
        noisy = with_drag(truth, point, samples) + 0.1 * rng.standard_normal(samples)
        return Experiment(Signal(noisy, 1000.0, unit="rad/s^2"), point)

    fitted, held = (experiment(1500.0, 2.0), experiment(1100.0, 2.0)), (experiment(1300.0, 20.0),)
    nominal = load_machine("reference")
    model, held_out = (IndexerModel(nominal, part, without=tuple(EFFECTS)) for part in (fitted, held))
    answer = explain(model, held_out)
    subject = IndexerSubject(nominal, Sensor(), Experiments(fitted, held, (("", ""), ("",)), ()))
    table = tabulate(answer, subject.forms())
    assert answer.names == ()
    assert table is not None and table.form.hypothesis.name == "tabulated.speed"
    assert table.closes > 0.8, (table.before, table.after, table.closes)
