"""What a fit has left: cleaned, white, and weighed against causes."""

import dataclasses

import numpy as np
import pytest

from discrepancy.origin.residue import Laid, Residue

STEP = 1.0 / 320.0


def laid(residual: np.ndarray, by_global: np.ndarray | None = None, by_local: np.ndarray | None = None) -> Laid:
    """Residuals (w, n) of one record with what a fit may move, nothing where it is not given."""
    w, n = residual.shape
    by_global = np.zeros((w, n, 0)) if by_global is None else by_global
    time = STEP * np.arange(w * n).reshape(w, n)
    return Laid(
        residual, by_global, np.zeros((w, n, 0)) if by_local is None else by_local, np.zeros(by_global.shape[2]),
        np.zeros(by_global.shape[2]), np.ones((w, n), dtype=bool), np.zeros(w, dtype=int), time, np.full(w, STEP),
    )  # fmt: skip


def coloured(rng: np.random.Generator, shape: tuple[int, int], colour: float) -> np.ndarray:
    noise = rng.standard_normal(shape)
    for k in range(1, shape[1]):
        noise[:, k] = colour * noise[:, k - 1] + noise[:, k]
    return noise


@pytest.mark.parametrize("colour", [0.0, 0.5, 0.9])
def test_the_colour_of_noise_is_read_where_the_machine_is_quiet(colour: float) -> None:
    """Seed 1; for a third of each window the residual also swings, far above the noise."""
    noise = coloured(np.random.default_rng(1), (20, 320), colour)
    moves = np.where(np.arange(320) < 107, 30.0 * np.sin(0.2 * np.arange(320)), 0.0)
    found = Residue(laid(noise + moves))
    assert found.colour == pytest.approx(colour, abs=0.15)
    assert found.noise == pytest.approx(1.0, rel=0.5)


def test_what_the_fit_may_move_explains_nothing() -> None:
    """Seed 2: a parameter's derivative and a start state are in the residual, ten times the noise."""
    rng = np.random.default_rng(2)
    by_global, by_local = rng.standard_normal((10, 200, 1)), rng.standard_normal((10, 200, 1))
    sizes = rng.standard_normal((10, 1))
    residual = rng.standard_normal((10, 200)) + 10.0 * by_global[..., 0] + 10.0 * sizes * by_local[..., 0]
    residue = Residue(laid(residual, by_global, by_local))
    assert residue.variance == pytest.approx(1.0, rel=0.1)
    assert residue.evidence(residue.clean(by_global))[0] < 1.0


def test_evidence_prefers_the_variable_that_orders_the_residual() -> None:
    """Seed 3: by phase within the window, not by window; chance earns nothing."""
    rng = np.random.default_rng(3)
    by_phase = np.tile(np.repeat(np.eye(8), 40, axis=0), (10, 1, 1))
    by_window = np.repeat(np.eye(10)[:, None], 320, axis=1)
    noise = rng.standard_normal((10, 320))
    sizes = rng.standard_normal(8)
    residue = Residue(laid(noise + by_phase @ (sizes - sizes.mean())))
    assert residue.evidence(residue.clean(by_phase))[0] > 100.0
    assert residue.evidence(residue.clean(by_window))[0] < 5.0
    assert residue.evidence_by_window(by_window[:, :, :1] + 1.0) < 5.0
    alone = Residue(laid(noise))
    assert alone.evidence(alone.clean(by_phase))[0] < 3.0


def test_a_cause_that_is_a_part_of_the_noise_is_not_found_again() -> None:
    """Seed 4; the products by which lines are looked for are those of what is left, and what is seen of a third cause
    beside two is the same at once and step by step."""
    rng = np.random.default_rng(4)
    first, second = rng.standard_normal((8, 200, 3)), rng.standard_normal((8, 200, 2))
    residue = Residue(laid(rng.standard_normal((8, 200)) + 2.0 * first[..., 0] + 0.5 * second[..., 0]))
    columns = residue.clean(first)
    won, scale = residue.evidence(columns)
    left = residue.without(columns, scale)
    assert won > 100.0 and left.evidence(columns)[0] < 3.0
    other = residue.clean(second)
    assert left.evidence(other)[0] > 50.0
    assert np.einsum("wn,wnk->k", left.before(), second) == pytest.approx(left.seen(other).pulls)
    least, third = left.without(other, left.evidence(other)[1]), residue.clean(rng.standard_normal((8, 200, 4)))
    at_once, stepwise = least.seen(third), least.seen_further(left.seen(third))
    straight = least.without(third, 1.0).y @ least.without(third, 1.0).y  # the third one taken out by its own columns
    inner = np.linalg.solve(np.eye(4) + at_once.products, at_once.pulls)
    assert straight == pytest.approx(least.y @ least.y - at_once.pulls @ inner)
    assert at_once.products == pytest.approx(stepwise.products) and at_once.pulls == pytest.approx(stepwise.pulls)


def bent(residual: np.ndarray, by_global: np.ndarray, at: np.ndarray) -> Laid:
    """The same with one parameter whose prior is one wide, linearised at a place."""
    return dataclasses.replace(laid(residual, by_global), known=np.ones(1), at=at)


def test_evidence_does_not_depend_on_where_the_fit_was_linearised() -> None:
    """Seed 5: a cause that the parameter can imitate in part, before and after the parameter has moved towards it."""
    rng = np.random.default_rng(5)
    cause, own = rng.standard_normal((2, 20, 100, 1))
    by_global = 0.02 * (cause + own)
    r = 0.3 * cause[..., 0] + rng.standard_normal((20, 100))
    d = np.array([5.0])
    won = []
    for residual, at in ((r, np.zeros(1)), (r + by_global @ d, d)):
        residue = Residue(bent(residual, by_global, at))
        residue.colour = 0.0
        won.append(residue.evidence(residue.clean(cause))[0])
    assert won[1] == pytest.approx(won[0], rel=0.05) and won[0] > 20.0


def test_what_is_known_counts_as_much_at_any_rate() -> None:
    """Seed 6: records, and the means of nine samples of theirs, with a cause that a parameter imitates in part."""
    rng = np.random.default_rng(6)
    cause = np.repeat(rng.standard_normal((20, 90)), 9, axis=1)
    r = 0.1 * cause + rng.standard_normal(cause.shape)
    found = []
    for every in (1, 9):
        residual, column = (x.reshape(20, -1, every).mean(axis=2) for x in (r, cause))
        residue = Residue(bent(residual, 0.012 * column[..., None], np.zeros(1)))
        found.append(residue.evidence(residue.clean(column[..., None]))[0])
    assert found[1] == pytest.approx(found[0], rel=0.15) and found[0] > 5.0
