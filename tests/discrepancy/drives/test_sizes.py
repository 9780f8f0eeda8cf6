"""A fit begins at the size that the record asks for, also where that lies below all sizes of the list. Seed 3."""

from pathlib import Path

import numpy as np
import pytest

from discrepancy.drives.library import sized
from discrepancy.model import Hypothesis, Parameter
from discrepancy.problem import Problem
from tests.discrepancy.drives.made import start_of, subject

DRY, OFFSET = 2.0, 0.3
"""Dry friction and an offset [N], the offset a hundredth of the force's rms."""


def test_a_small_offset_beside_a_large_friction_gets_a_start_of_its_size(tmp_path: Path) -> None:
    made = subject(tmp_path, lambda t, q, v, a: 90.0 * a + DRY * np.sign(v) + OFFSET, noise=0.01)
    library = made.model.hypotheses()
    problem, place = start_of(made, library["friction.coulomb"][0])
    place = problem.point(np.array([0.0, library["friction.coulomb"][0].coordinates([DRY])[0]]), place.states)
    left = Problem(made.model, place.hypothesis).left(place)
    listed = min(abs(start[0] - OFFSET) for start in library["offset"][0].starts)
    proposed = min(abs(start[0] - OFFSET) for start in made.model.hypotheses(left)["offset"][0].starts)
    # the last third of the record, which is held out, has no say in the size
    assert listed > 2.0 * OFFSET and proposed == pytest.approx(0.0, abs=0.1 * OFFSET)


def test_sizes_are_proposed_for_each_shape_within_the_bounds() -> None:
    """An effect that is its size times a wave of the order that is its second parameter."""
    turn = np.linspace(0.0, 2.0 * np.pi, 200)
    size, order = Parameter("e.size", "N", 0.0, 1.0, low=-2.0, high=2.0), Parameter("e.order", "-", 1.0, 1.0)
    one = Hypothesis("e", (size, order), starts=((0.5, 1.0), (-0.5, 1.0), (0.5, 2.0)))
    waves = np.sin(turn), np.sin(2.0 * turn)
    found = sized(one, lambda h, v: v[0] * waves[int(v[1]) - 1], 0.03 * waves[0] - 9.0 * waves[1])
    assert found.starts[:2] == (pytest.approx((0.03, 1.0)), (-2.0, 2.0)) and found.starts[2:] == one.starts
    assert found.effects == (found,)
    shaped = Hypothesis("e", (order,), starts=((1.0,), (2.0,)))
    assert sized(shaped, lambda h, v: waves[0], waves[0]) is shaped
