"""Levenberg and Marquardt's method on many turns, on curves whose minima are known."""

from __future__ import annotations

from collections.abc import Callable
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from twin import descend as module
from twin.descend import Descent, again, descended
from twin.work import Beside


class Curve:
    """Work whose turns are m(t), t = (size, own), instead of simulated ones."""

    def __init__(self, curve: Callable[[np.ndarray], np.ndarray], measured: list[list[float]], signed: bool = False):
        self.curve, self.m = curve, np.array(measured)
        self.of: Any = SimpleNamespace(faults=("crack",))
        self.sizes, self.own = slice(0, 1), slice(1, 2)
        self.free = np.ones((len(measured), 2), dtype=bool)
        self.low, self.high = np.array([-1.0 if signed else 0.0, -4.0]), np.array([1.0, 4.0])
        self.stride, self.prior = np.array([0.3, 1.0]), np.array([0.0, 1e-3])
        self.simulated: list[int] = []

    def at(self, t: np.ndarray, at: np.ndarray) -> Beside:
        self.simulated += at.tolist()
        m = self.curve(t)
        off, k = self.m[at] - m, m.shape[1]
        return Beside(m, np.repeat(np.eye(k)[None] / k, len(t), 0), off, (off**2).mean(axis=1) + t**2 @ self.prior)

    def slopes(self, t: np.ndarray, at: np.ndarray, now: Beside) -> np.ndarray:
        found = np.zeros((len(t), self.m.shape[1], 2))
        for place in range(2):
            moved = t.copy()
            moved[:, place] += 1e-5
            found[:, :, place] = (self.curve(moved) - now.m) / 1e-5
        return found


def valley(t: np.ndarray) -> np.ndarray:
    """What the machine's own parameter does to a turn changes with the size."""
    size, own = t.T
    return np.stack([30.0 * size + 8.0 * own * np.exp(3.0 * size), 40.0 * own], axis=1)


def test_a_size_is_found_at_the_end_of_a_curved_valley():
    truth = np.array([[0.8, 0.3]])
    work: Any = Curve(valley, valley(truth).tolist())
    found = descended(work, np.array([[0.1, 0.0]]), np.array([0]), 15)
    assert found.t[0] == pytest.approx(truth[0], abs=1e-2) and found.q[0] < 0.1


def test_old_derivatives_would_stop_on_the_way(monkeypatch):
    """The test above fails where the derivatives of the first step are kept and no secant mends them."""
    truth = np.array([[0.8, 0.3]])
    work: Any = Curve(valley, valley(truth).tolist())
    first: list[np.ndarray] = []
    fresh = work.slopes

    def kept(t: np.ndarray, at: np.ndarray, now: Beside) -> np.ndarray:
        if not first:
            first.append(fresh(t, at, now))
        return first[0][: len(t)]

    monkeypatch.setattr(work, "slopes", kept)
    monkeypatch.setattr(module, "_broyden", lambda work, slopes, *step: np.zeros_like(slopes))
    assert descended(work, np.array([[0.1, 0.0]]), np.array([0]), 15).q[0] > 0.1


def test_slopes_agree_with_the_step_after_a_secant():
    """Seed 3."""
    rng, work = np.random.default_rng(3), Curve(valley, [[0.0, 0.0]])
    slopes, step, change = rng.normal(size=(4, 5, 2)), rng.normal(size=(4, 2)), rng.normal(size=(4, 5))
    mended = slopes + module._broyden(work, slopes, step, change)  # type: ignore[arg-type]
    assert np.einsum("nku,nu->nk", mended, step) == pytest.approx(change)
    across = np.stack([-step[:, 1], step[:, 0]], axis=1) * work.stride**2
    assert np.einsum("nku,nu->nk", mended - slopes, across) == pytest.approx(np.zeros((4, 5)), abs=1e-9)


def test_secants_save_derivatives_and_the_last_ones_are_fresh():
    truth = np.array([[0.8, 0.3]])
    work: Any = Curve(valley, valley(truth).tolist())
    taken: list[np.ndarray] = []
    fresh = work.slopes
    work.slopes = lambda t, at, now: (taken.extend(t), fresh(t, at, now))[1]
    found = descended(work, np.array([[0.1, 0.0]]), np.array([0]), 15)
    assert found.t[0] == pytest.approx(truth[0], abs=1e-2)
    assert len(taken) < 0.5 * len(work.simulated) and taken[-1] == pytest.approx(found.t[0], abs=1e-3)


def test_what_has_come_to_rest_is_not_simulated_again():
    truth = np.array([[0.2, 0.0], [0.8, 0.3]])
    work: Any = Curve(valley, valley(truth).tolist())
    descended(work, np.array([[0.2, 0.0], [0.1, 0.0]]), np.array([0, 1]), 15)
    assert work.simulated.count(0) < work.simulated.count(1)


def waves(t: np.ndarray) -> np.ndarray:
    """Several minima along the size."""
    size, own = t.T
    return np.stack([10.0 * size + 6.0 * np.sin(60.0 * size), 10.0 * size + own], axis=1)


def stuck(work: Any, size: float) -> Descent:
    return descended(work, np.array([[size, 0.0]]), np.array([0]), 15)


def test_a_turn_that_is_not_explained_is_started_again():
    work: Any = Curve(waves, waves(np.array([[0.50, 0.0]])).tolist())
    found = stuck(work, 0.75)
    before = found.t.copy()
    assert again(work, found).q[0] < 1.5 < found.q[0]
    assert (found.t == before).all()


def test_of_the_starts_again_few_go_on(monkeypatch: pytest.MonkeyPatch):
    spent = []
    for kept in (module._GO_ON, module._AGAIN):
        monkeypatch.setattr(module, "_GO_ON", kept)
        work: Any = Curve(waves, waves(np.array([[0.50, 0.0]])).tolist())
        found = stuck(work, 0.75)
        work.simulated.clear()
        again(work, found)
        spent.append(len(work.simulated))
    assert spent[0] < 0.75 * spent[1]


def test_a_turn_that_is_explained_is_left_alone():
    work: Any = Curve(valley, valley(np.array([[0.8, 0.3]])).tolist())
    found = stuck(work, 0.7)
    work.simulated.clear()
    assert again(work, found).t == pytest.approx(found.t) and not work.simulated


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_fault_that_was_lost_comes_back(side: float, monkeypatch: pytest.MonkeyPatch):
    def flat(t: np.ndarray) -> np.ndarray:
        size, own = t.T
        return np.stack([20.0 * np.sign(size) * np.maximum(np.abs(size) - 0.02, 0.0), 0.0 * own], axis=1)

    work: Any = Curve(flat, flat(np.array([[0.4 * side, 0.0]])).tolist(), signed=True)
    found = stuck(work, 0.0)
    assert found.t[0, 0] == 0.0
    assert again(work, found).t[0, 0] == pytest.approx(0.4 * side, abs=0.05)
    monkeypatch.setattr(module, "_LOST", 0.0)
    assert again(work, found).t[0, 0] == 0.0


def test_a_fit_does_not_depend_on_what_is_fitted_beside_it():
    truth = np.array([[0.50, 0.0], [0.3, 0.2]])
    alone: Any = Curve(waves, waves(truth[:1]).tolist())
    both: Any = Curve(waves, waves(truth).tolist())
    starts = np.array([[0.6, 0.0], [0.5, 0.0]])
    one = again(alone, descended(alone, starts[:1], np.array([0]), 15))
    two = again(both, descended(both, starts, np.array([0, 1]), 15))
    assert two.t[0] == pytest.approx(one.t[0], abs=1e-12)
