"""Small problems for training rules: overlapping classes, and functions whose minimum is known."""

from typing import NamedTuple

import pytest
import torch

from classifier.network import Mlp
from classifier.trainers import Examples
from classifier.trainers.objective import Point


class Problem(NamedTuple):
    network: Mlp
    start: torch.Tensor
    calibration: Examples
    control: Examples


def noisy_problem(features: int, records: int, hidden: int = 8, networks: int = 4, **functions: str) -> Problem:
    """Noisy examples of two classes that overlap, so that control errors turn up again; seed 2."""
    generator = torch.Generator().manual_seed(2)
    network = Mlp(features, hidden, 2, **functions)
    x = torch.rand(2 * records, features, generator=generator, dtype=torch.float64)
    noise = 0.4 * torch.randn(2 * records, generator=generator, dtype=torch.float64)
    first = (x[:, 0] + x[:, 1] + noise > 1).double()
    t = network.targets_of(torch.stack([first, 1 - first], dim=1))
    start = network.initial(networks, generator)
    return Problem(network, start, Examples(x[:records], t[:records]), Examples(x[records:], t[records:]))


@pytest.fixture(scope="session")
def problem() -> Problem:
    """More records than features."""
    return noisy_problem(features=6, records=30)


@pytest.fixture(scope="session")
def wide_problem() -> Problem:
    """More features than records, odd numbers of both."""
    return noisy_problem(features=41, records=21)


class Quadratic:
    """½ xᵀAx − bᵀx for a stack of rows; eigenvalues of A from 1 to `condition`, seed 7."""

    def __init__(self, count: int, condition: float = 50.0) -> None:
        generator = torch.Generator().manual_seed(7)
        q = torch.linalg.qr(torch.randn(count, count, generator=generator, dtype=torch.float64)).Q
        self.a = q @ torch.diag(torch.linspace(1.0, condition, count, dtype=torch.float64)) @ q.T
        self.b = torch.randn(count, generator=generator, dtype=torch.float64)
        self.start = torch.randn(3, count, generator=generator, dtype=torch.float64)

    @property
    def minimum(self) -> torch.Tensor:
        return torch.linalg.solve(self.a, self.b)

    def evaluate(self, parameters: torch.Tensor) -> Point:
        product = parameters @ self.a
        error = 0.5 * (product * parameters).sum(dim=1) - parameters @ self.b
        return Point(parameters, error, product - self.b)


def walk(rule, objective, start: torch.Tensor, epochs: int) -> list[Point]:
    """Points of a rule on any objective, the start first."""
    points = [objective.evaluate(start)]
    memory = rule.begin(points[0])
    for _ in range(epochs):
        point, memory, _ = rule.step(points[-1], memory, objective)
        points.append(point)
    return points
