"""The physics of a place goes over to records held out, however many records there are here and there."""

import numpy as np
import pytest

from discrepancy import held_out
from discrepancy.held_out import carried, held_place, held_places
from discrepancy.jobs import Jobs
from discrepancy.model import NONE, Hypothesis, Parameter, together
from discrepancy.problem import Problem
from indexer_env.errors import ParameterError
from tests.discrepancy.toy import Stateless


def test_the_parameters_of_a_set_keep_their_values(records) -> None:
    """Seed 21: two records to fit and one held out, a set of two effects."""
    model, held_out, _ = records(21)
    library = model.hypotheses()
    hypothesis = together(library["friction.viscous"][0], library["sensor.gain"][0])
    problem = Problem(model, hypothesis)
    z = np.where([p.of_record for p in problem.parameters], 0.9, 0.01 * np.arange(len(problem.parameters)))
    states = np.zeros((len(model.counts), model.local_count(hypothesis)))
    moved = carried(problem.point(z, states), Problem(held_out, hypothesis, frozen=True))
    expected = model.values(hypothesis, z)
    found = held_out.values(hypothesis, moved)
    of_record = sum(p.of_record for p in held_out.parameters)
    assert len(moved) == len(z) - sum(p.of_record for p in model.parameters) + of_record
    for name, value in found.items():
        assert name.startswith("record ") or value == expected[name]


class Straight(Stateless):
    """y = Σ z of 2 windows of 10 samples, one of each record; parameters of records by their letters."""

    def __init__(self, layout: str) -> None:
        records = {"a": 0, "b": 1}
        self.parameters = tuple(
            Parameter(f"{letter}{k}", "-", 0.0, 1.0, record=records.get(letter)) for k, letter in enumerate(layout)
        )
        self.counts, self.groups = np.full(2, 10), np.arange(2)

    def residuals(self, hypothesis: Hypothesis, jobs: Jobs) -> np.ndarray:
        return np.repeat(jobs.points[jobs.point].sum(axis=1, keepdims=True), 10, axis=1)


@pytest.mark.parametrize(("fitted", "held"), [("maamb", "mamb"), ("maab", "mm"), ("amab", "amab")])
def test_parameters_of_records_stand_together_or_are_refused(fitted: str, held: str) -> None:
    model, held_out = Straight(fitted), Straight(held)
    place = Problem(model, NONE).point(np.arange(float(len(fitted))), np.zeros((2, 0)))
    with pytest.raises(ParameterError, match=r"Model\.parameters must be those that belong to records side by side"):
        carried(place, Problem(held_out, NONE, frozen=True))


def test_of_the_parameters_carried_the_machine_s_come_first() -> None:
    whole = Problem(Straight("mmab"), NONE, frozen=True)
    assert carried(Problem(Straight("mmaab"), NONE).point(np.arange(5.0), np.zeros((2, 0))), whole)[:2].tolist() == [
        0,
        1,
    ]


class TwoValleys(Straight):
    """One window of a record with a number of its own, of which valleys lie near 0 and at 3, the second one deeper."""

    def __init__(self) -> None:
        super().__init__("ma")
        self.counts, self.groups = np.full(1, 10), np.zeros(1, dtype=int)

    def residuals(self, hypothesis: Hypothesis, jobs: Jobs) -> np.ndarray:
        z = jobs.points[jobs.point][:, 1:2]
        return np.repeat(z**2 * (z - 3.0) ** 2 + 0.5 * np.abs(3.0 - z), 10, axis=1)


def test_what_belongs_to_records_begins_where_others_have_it() -> None:
    model = TwoValleys()
    problem = Problem(model, NONE, frozen=True)
    stated, other = (problem.point(np.array([0.0, z]), np.zeros((1, 0))) for z in (0.0, 3.01))
    assert held_place(stated, model).z[1] == pytest.approx(0.0, abs=0.1)
    assert held_place(stated, model, [other]).z[1] == pytest.approx(3.0, abs=0.1)
    first, second = held_places([stated, stated], model, [other])
    assert [first.z[1], second.z[1]] == pytest.approx([3.0, 3.0], abs=0.1)


class Started(TwoValleys):
    """In the deeper valley a window must begin at 2, which no other place has and a grid finds."""

    def residuals(self, hypothesis: Hypothesis, jobs: Jobs) -> np.ndarray:
        z = jobs.points[jobs.point][:, 1:2]
        return super().residuals(hypothesis, jobs) + np.where(z > 1.5, 5.0, 0.0) * np.abs(jobs.states - 2.0)

    def local_count(self, hypothesis: Hypothesis) -> int:
        return 1

    def state_grid(self, hypothesis: Hypothesis, point: np.ndarray, *, shaken: bool = False) -> np.ndarray:
        return np.linspace(-3.0, 3.0, 7)[:, None]


def test_where_others_have_a_record_all_start_states_are_looked_for() -> None:
    """There the other's start state of 0 leaves more than the valley near 0 does."""
    model = Started()
    problem = Problem(model, NONE, frozen=True)
    stated, other = (problem.point(np.array([0.0, z]), np.zeros((1, 1))) for z in (0.0, 3.01))
    assert other.cost > problem.searched(stated).cost
    assert held_place(stated, model, [other]).z[1] == pytest.approx(3.0, abs=0.1)


def test_the_first_place_held_out_begins_where_a_later_one_has_it_too(monkeypatch) -> None:
    """The first one ends in the valley near 0, where it begins, and the second one at 3."""
    model = TwoValleys()
    problem = Problem(model, NONE, frozen=True)
    stated, other = (problem.point(np.array([0.0, z]), np.zeros((1, 0))) for z in (0.0, 3.01))
    each = iter([stated, other])
    monkeypatch.setattr(held_out, "held_place", lambda place, model, found: next(each))
    first, second = held_places([stated, stated], model)
    assert [first.z[1], second.z[1]] == pytest.approx([3.0, 3.0], abs=0.1)
