"""The physics of a place goes over to records held out, however many records there are here and there."""

import numpy as np

from discrepancy.held_out import carried
from discrepancy.problem import Problem


def test_parameters_of_known_effects_keep_their_values(records) -> None:
    """Seed 21: two records to fit and one held out, one effect known and another one looked for."""
    model, held_out, _ = records(21)
    known = model.hypotheses()["friction.viscous"][0]
    model, held_out = model.extended(known), held_out.extended(known)
    hypothesis = model.hypotheses()["sensor.gain"][0]
    problem = Problem(model, hypothesis)
    z = np.where([p.of_record for p in problem.parameters], 0.9, 0.01 * np.arange(len(problem.parameters)))
    states = np.zeros((len(model.counts), model.local_count(hypothesis)))
    moved = carried(problem.point(z, states), Problem(held_out, hypothesis, frozen=True))
    expected = model.values(hypothesis, z)
    found = held_out.values(hypothesis, moved)
    assert len(moved) == len(z) - 2
    for name, value in found.items():
        assert name.startswith("record ") or value == expected[name]
