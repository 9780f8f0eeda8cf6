"""A fit begins at the size that the record asks for, also where that lies below all sizes of the list. Seed 3."""

from pathlib import Path

import numpy as np
import pytest

from discrepancy.drives.forward import ForwardModel
from discrepancy.drives.library import sized
from discrepancy.fit import fit
from discrepancy.model import NONE, Hypothesis, Parameter
from discrepancy.problem import Problem
from tests.discrepancy.drives.made import run_plain, start_of, subject
from tests.discrepancy.drives.test_forward import FILE as PENDULUM
from tests.discrepancy.drives.test_forward import T
from tests.discrepancy.drives.test_forward import made as pendulum

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


def test_a_small_friction_gets_a_start_of_its_size_in_the_forward_form(tmp_path: Path) -> None:
    """A pendulum with 6 N mm of dry friction, a hundredth of what moves it; 0.1 mrad of noise. Seed 3."""
    made = pendulum(tmp_path, 0.4 + 0.2 * np.sin(3.0 * T), PENDULUM)
    model = made.model
    assert isinstance(model, ForwardModel)
    one = model.hypotheses()["friction.coulomb"][0]
    z = np.concatenate([np.zeros(3), one.coordinates([0.006])])
    moved = run_plain(model, one, z, np.array([0.3, 0.0]))[0]
    noisy = moved + 1e-4 * np.random.default_rng(3).standard_normal(len(moved))
    model = pendulum(tmp_path, noisy, PENDULUM.replace("noise = 0.001", "noise = 0.0001\nwindows = 1.3")).model
    problem = Problem(model, NONE)
    place = fit(problem, problem.point(np.zeros(3), np.zeros((len(model.counts), 2))), steps=10).place
    listed = min(abs(start[0] - 0.006) for start in model.hypotheses()["friction.coulomb"][0].starts)
    proposed = model.hypotheses(problem.left(place))["friction.coulomb"][0].starts[0][0]
    assert listed > 0.006 and proposed == pytest.approx(0.006, rel=0.5)


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
