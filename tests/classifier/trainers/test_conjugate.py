"""Rules of conjugate directions on quadratic errors, where all of them must do the same n exact steps."""

import numpy as np
import pytest
import torch

from classifier.trainers.descent import Searched
from classifier.trainers.objective import Point
from classifier.trainers.trainbfg import TrainBfg
from classifier.trainers.traincgb import TrainCgb
from classifier.trainers.traincgf import TrainCgf
from classifier.trainers.traincgp import TrainCgp
from classifier.trainers.trainoss import TrainOss
from classifier.trainers.trainscg import TrainScg

from .conftest import Quadratic, walk

EXACT = {"decrease": 1e-14, "flatness": 1e-12, "trials": 60}
SEARCHING = [rule(**EXACT) for rule in (TrainCgf, TrainCgp, TrainCgb, TrainBfg, TrainOss)]
N = 6


@pytest.fixture(scope="module")
def quadratic() -> Quadratic:
    return Quadratic(N)


def conjugate_gradients(quadratic: Quadratic, x: np.ndarray) -> list[np.ndarray]:
    """Hestenes and Stiefel's method with the closed step, in plain numpy."""
    a, b = quadratic.a.numpy(), quadratic.b.numpy()
    r = b - a @ x
    p, points = r.copy(), [x]
    for _ in range(N):
        alpha = r @ r / (p @ a @ p)
        x = x + alpha * p
        r_new = r - alpha * a @ p
        p = r_new + (r_new @ r_new) / (r @ r) * p
        r = r_new
        points.append(x)
    return points


@pytest.mark.parametrize("rule", SEARCHING, ids=lambda rule: rule.kind)
def test_with_an_exact_search_the_path_is_that_of_conjugate_gradients(quadratic, rule):
    points = walk(rule, quadratic, quadratic.start, N)
    for i, start in enumerate(quadratic.start.numpy()):
        for epoch, expected in enumerate(conjugate_gradients(quadratic, start)):
            assert points[epoch].parameters[i].numpy() == pytest.approx(expected, abs=2e-6), epoch
    assert points[-2].gradient.norm(dim=1).min() > 1e-3
    assert torch.allclose(points[-1].parameters, quadratic.minimum.expand(3, -1), atol=2e-6)


def test_scaled_conjugate_gradients_need_as_many_steps_as_parameters(quadratic):
    points = walk(TrainScg(scale=1e-14), quadratic, quadratic.start, N)
    for i, start in enumerate(quadratic.start.numpy()):
        for epoch, expected in enumerate(conjugate_gradients(quadratic, start)):
            assert points[epoch].parameters[i].numpy() == pytest.approx(expected, abs=2e-6), epoch


def test_the_trust_region_of_scaled_conjugate_gradients_by_hand():
    """E = x⁴/4 − x²/2 from x = 0.1, where the second derivative is negative; two epochs worked out on paper."""

    class Well:
        def evaluate(self, x):
            return Point(x, (x**4 / 4 - x**2 / 2)[:, 0], x**3 - x)

    start = torch.tensor([[0.1]], dtype=torch.float64)
    points = walk(TrainScg(sigma=1e-7, scale=1e-3), Well(), start, 2)
    g = 0.1**3 - 0.1
    p, bent = -g, 3 * 0.1**2 - 1  # Eʺ
    delta = bent * p * p + 1e-3 * p * p
    raised = 2 * (1e-3 - delta / p**2)
    delta = -delta + 1e-3 * p * p
    x = 0.1 + p * p / delta * p
    assert points[1].parameters.item() == pytest.approx(x, rel=1e-6)
    ratio = 2 * delta * ((0.1**4 - x**4) / 4 - (0.1**2 - x**2) / 2) / (p * p) ** 2
    assert ratio > 0.75
    new = x**3 - x
    p_new = -new + (new * new - new * g) / (p * p) * p
    delta = (3 * x * x - 1 + raised / 4) * p_new**2
    assert delta < 0  # still bent downwards: λ is raised again
    delta = -delta + raised / 4 * p_new**2
    assert points[2].parameters.item() == pytest.approx(x - p_new * new / delta * p_new, rel=1e-5)


def test_the_bfgs_matrix_is_the_one_written_out():
    """Updates from random pairs, seed 4, beside the dense formula H ← (I − ρsyᵀ) H (I − ρysᵀ) + ρssᵀ."""
    generator = torch.Generator().manual_seed(4)
    count, rule = 5, TrainBfg()
    quadratic = Quadratic(count)
    point = quadratic.evaluate(quadratic.start[:1])
    own, dense = rule.start(point), None
    for _ in range(20):  # more than the room that is there at first
        direction = -point.gradient if dense is None else -(dense @ point.gradient[0])[None]
        length = 0.1 + torch.rand(1, generator=generator, dtype=torch.float64)
        new = quadratic.evaluate(point.parameters + length[:, None] * direction)
        s, y = (length * direction)[0], (new.gradient - point.gradient)[0]
        turn = rule.turn(Searched(point, new, direction, length, length, length), own)
        if dense is None:
            dense = s @ y / (y @ y) * torch.eye(count, dtype=torch.float64)
        left = torch.eye(count, dtype=torch.float64) - torch.outer(s, y) / (s @ y)
        dense = left @ dense @ left.T + torch.outer(s, s) / (s @ y)
        expected = -dense @ new.gradient[0]
        assert torch.allclose(turn.direction[0], expected, rtol=1e-6, atol=1e-9 * expected.norm().item())
        point, own = new, turn.own


def test_bfgs_begins_again_after_its_updates():
    """With room for one update every third direction is steepest descent again."""
    quadratic, rule = Quadratic(N), TrainBfg(updates=1)
    at = quadratic.evaluate(quadratic.start)
    memory, used = rule.begin(at), []
    for _ in range(4):
        at, memory, _ = rule.step(at, memory, quadratic)
        used.append(memory.turn.own.used.tolist())
    assert used == [[1] * 3, [0] * 3, [1] * 3, [0] * 3]


def test_the_one_step_secant_by_hand():
    """s = (1, 0), y = (2, 1), g = (3, 4): s·y = 2, s·g = 3, y·g = 10, y·y = 5."""
    one = torch.ones(1, dtype=torch.float64)
    vectors = [torch.tensor([v], dtype=torch.float64) for v in ((1.0, 3.0), (3.0, 4.0), (1.0, 0.0))]
    old, new, direction = vectors
    searched = Searched(Point(old, one, old), Point(new, one, new), direction, one, -one, one)
    rule = TrainOss()
    got = rule.turn(searched, rule.start(Point(torch.zeros(1, 9), one, old))).direction
    b = 3 / 2
    a = 10 / 2 - (1 + 5 / 2) * b
    assert got.shape == (1, 2)
    # Two parameters and one search: not yet a whole round.
    assert got[0].tolist() == pytest.approx([-3 + a * 1 + b * 2, -4 + b * 1])


def turned(old, new, direction, own, rule=None):
    """Direction and memory of the Powell–Beale rule after one search in four dimensions."""
    rule, one = rule or TrainCgb(), torch.ones(1, dtype=torch.float64)
    old, new, direction = (torch.tensor([v], dtype=torch.float64) for v in (old, new, direction))
    own = own or rule.start(Point(old, one, old))
    turn = rule.turn(Searched(Point(old, one, old), Point(new, one, new), direction, one, -one, one), own)
    return turn.direction[0].tolist(), turn.own


def test_restarts_of_powell_and_beale_by_hand():
    # First search: β = g·y / d·y with y = (−1, 1, 0, 0), g·y = 1, d·y = 1; two terms.
    got, own = turned((1, 0, 0, 0), (0, 1, 0, 0), (-1, 0, 0, 0), None)
    assert got == pytest.approx([-1, -1, 0, 0])
    assert (own.searches.item(), own.change[0].tolist()) == (1, [-1, 1, 0, 0])
    # Orthogonal gradients: three terms. y = (0, −1, 1, 0), d·y = 1, g·y = 1, β = 1; γ = g·y_t / d_t·y_t = 0.
    got, later = turned((0, 1, 0, 0), (0, 0, 1, 0), (-1, -1, 0, 0), own)
    assert got == pytest.approx([-1, -1, -1, 0])
    assert later.searches.item() == 2
    # The same with a gradient that is not orthogonal to y_t: γ = 0.1 / 1, d = −g + βd + 0.1 d_t.
    got, later = turned((0, 1, 0, 0), (0, 0.1, 1, 0), (-1, -1, 0, 0), own)
    beta = (0.1 * -0.9 + 1) / 0.9
    assert got == pytest.approx([-beta - 0.1, -0.1 - beta, -1, 0])
    assert later.searches.item() == 2
    # Gradients far from orthogonal, |g_old·g_new| = 0.5 > 0.2 · 1.25: the last search becomes t.
    _, later = turned((0, 1, 0, 0), (0, 0.5, 1, 0), (-1, -1, 0, 0), own)
    assert (later.searches.item(), later.direction[0].tolist()) == (1, [-1, -1, 0, 0])
