"""The eliminated system gives the step that the full one gives."""

import numpy as np
import pytest

from discrepancy.arrow import Slopes, arrow


@pytest.mark.parametrize("size", [0, 2])
def test_step_solves_the_full_least_squares_problem(size: int) -> None:
    """Seed 3; 5 windows of 30 samples, 3 globals: equal to one dense solve, weights included."""
    rng = np.random.default_rng(3)
    residual = rng.standard_normal((5, 30))
    by_global, by_local = rng.standard_normal((3, 5, 30)), rng.standard_normal((size, 5, 30))
    weights = rng.uniform(0.2, 1.0, 5)
    step, local = arrow(residual, by_global, by_local, weights).step(0.0, np.ones(3, dtype=bool))

    full = np.zeros((5, 30, 3 + 5 * size))
    full[:, :, :3] = np.moveaxis(by_global, 0, 2)
    for window in range(5):
        full[window, :, 3 + size * window : 3 + size * (window + 1)] = by_local[:, window].T
    root = np.sqrt(weights)[:, None, None]
    dense = np.linalg.lstsq((full * root).reshape(150, -1), -(residual[:, :, None] * root).ravel(), rcond=None)[0]
    assert step == pytest.approx(dense[:3], rel=1e-4, abs=1e-6)
    assert local.ravel() == pytest.approx(dense[3:], rel=1e-3, abs=1e-5)


def test_held_parameters_stay() -> None:
    """Seed 4: what is not free does not move, and the others move as if it were not there."""
    rng = np.random.default_rng(4)
    residual, by_global = rng.standard_normal((4, 20)), rng.standard_normal((3, 4, 20))
    none = np.zeros((0, 4, 20))
    step, _ = arrow(residual, by_global, none, np.ones(4)).step(0.0, np.array([True, False, True]))
    alone, _ = arrow(residual, by_global[[0, 2]], none, np.ones(4)).step(0.0, np.ones(2, dtype=bool))
    assert step[1] == 0.0
    assert step[[0, 2]] == pytest.approx(alone)


def test_slopes_give_the_same_equations_and_sums_of_squares() -> None:
    """Seed 5; 6 windows of 25 samples, 3 globals, 2 locals: equal to the equations of one residual and its sum."""
    rng = np.random.default_rng(5)
    residual, weights = rng.standard_normal((6, 25)), rng.uniform(0.2, 1.0, 6)
    by_global, by_local = rng.standard_normal((3, 6, 25)), rng.standard_normal((2, 6, 25))
    slopes = Slopes(by_global, by_local)
    one, other = slopes.arrow(slopes.pulls(residual), weights), arrow(residual, by_global, by_local, weights)
    for name in "AaBbC":
        np.testing.assert_allclose(getattr(one, name), getattr(other, name), rtol=1e-12, atol=1e-12)
    step, local = rng.standard_normal(3), rng.standard_normal((6, 2))
    moved = residual + np.einsum("g,gwn->wn", step, by_global) + np.einsum("wl,lwn->wn", local, by_local)
    squares = slopes.squares((residual**2).sum(axis=1), slopes.pulls(residual), step, local)
    np.testing.assert_allclose(squares, (moved**2).sum(axis=1), rtol=1e-12)


def test_two_states_that_act_alike_and_strongly_make_no_singular_block() -> None:
    """Seed 6; the second state does what the first one does, 3e6 times the noise per unit: together they are one."""
    rng = np.random.default_rng(6)
    residual, by_global = rng.standard_normal((3, 20)), rng.standard_normal((2, 3, 20))
    alike = 3e6 * rng.standard_normal((1, 3, 20)).repeat(2, axis=0)
    both, _ = arrow(residual, by_global, alike, np.ones(3)).step(0.0, np.ones(2, dtype=bool))
    one, _ = arrow(residual, by_global, alike[:1], np.ones(3)).step(0.0, np.ones(2, dtype=bool))
    assert both == pytest.approx(one, rel=1e-3)
