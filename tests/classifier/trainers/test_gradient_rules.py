"""The rules that need no more than the gradient, beside the same by hand."""

from itertools import pairwise

import numpy as np
import pytest
import torch

from classifier.trainers import TRAINERS
from classifier.trainers.objective import Point
from classifier.trainers.trainrp import TrainRp

from .conftest import walk


def descent_of_one(w1, b1, w2, b2, x, t, epochs, rate, mc, factor, up, down, worst):
    """The rule for one network in plain numpy: error after each epoch, last weights, steps undone."""

    def look(p):
        w1, b1, w2, b2 = p
        h = 1 / (1 + np.exp(-(x @ w1.T + b1)))
        y = 1 / (1 + np.exp(-(h @ w2.T + b2)))
        d2 = 2 * (y - t) / t.size * y * (1 - y)
        d1 = (d2 @ w2) * h * (1 - h)
        return np.mean((y - t) ** 2), (d1.T @ x, d1.sum(0), d2.T @ h, d2.sum(0))

    p = (w1, b1, w2, b2)
    before = tuple(np.zeros_like(part) for part in p)
    error, gradient = look(p)
    errors, undone = [error], 0
    for _ in range(epochs):
        change = tuple(mc * last - factor * rate * g for last, g in zip(before, gradient, strict=True))
        tried = tuple(part + step for part, step in zip(p, change, strict=True))
        new_error, new_gradient = look(tried)
        if new_error > worst * error:
            rate *= down
            before = tuple(np.zeros_like(part) for part in p)
            undone += 1
        else:
            if new_error < error:
                rate *= up
            p, before, error, gradient = tried, change, new_error, new_gradient
        errors.append(error)
    return errors, p, undone


# Without momentum steps undone soon magnify the last digits, hence fewer epochs from a larger rate.
@pytest.mark.parametrize(("kind", "rate", "epochs"), [("traingdx", 1.0, 120), ("traingda", 20.0, 40)])
def test_against_one_network_by_hand(problem, kind, rate, epochs):
    network, start, calibration, control = problem
    rule = TRAINERS[kind](rate=rate, epochs=epochs, patience=1000)
    training = rule.train(network, start[1:2], calibration, control)
    w1, b1, w2, b2 = (part[0].numpy() for part in network.layers(start[1:2]))
    data = (calibration.inputs.numpy(), calibration.targets.numpy())
    momentum = {"traingdx": (0.9, 0.9), "traingda": (0.0, 1.0)}[kind]
    numbers = (rate, *momentum, 1.05, 0.7, 1.04)
    errors, _, undone = descent_of_one(w1, b1, w2, b2, *data, epochs, *numbers)
    assert undone >= 2  # the test means something only where steps were undone
    assert training.calibration_error[:, 0] == pytest.approx(np.array(errors), rel=1e-9)

    # With the calibration subset as control subset the kept weights are those of the lowest error.
    same = rule.train(network, start[1:2], calibration, calibration)
    lowest = int(np.argmin(errors))
    assert same.best_epoch[0] == lowest > epochs / 2
    _, weights, _ = descent_of_one(w1, b1, w2, b2, *data, lowest, *numbers)
    expected = np.concatenate([part.flatten() for part in weights])
    assert same.parameters[0].numpy() == pytest.approx(expected, rel=1e-7)


def test_resilient_steps_by_hand():
    """E = x² from 0.1, first size 0.07: each step and its size worked out on paper."""

    class Bowl:
        def evaluate(self, x):
            return Point(x, x.square()[:, 0], 2 * x)

    rule, bowl = TrainRp(), Bowl()
    at = bowl.evaluate(torch.tensor([[0.1]], dtype=torch.float64))
    memory, path = rule.begin(at), []
    for _ in range(7):
        at, memory, _ = rule.step(at, memory, bowl)
        path.append((round(at.parameters.item(), 12), round(memory.size.item(), 12)))
    assert path == [
        (0.03, 0.07),  # no derivative before: size kept
        (-0.054, 0.084),  # same sign: size × 1.2
        (0.03, 0.042),  # sign changed: size × 0.5, step undone
        (-0.012, 0.042),  # derivative before counts as 0: size kept
        (0.03, 0.021),
        (0.009, 0.021),
        (-0.0162, 0.0252),
    ]


def test_resilient_sizes_stay_within_their_bounds():
    class Slope:
        def evaluate(self, x):
            return Point(x, x[:, 0], torch.ones_like(x))

    rule = TrainRp(maximum_size=0.1)
    points = walk(rule, Slope(), torch.zeros(1, 2, dtype=torch.float64), 4)
    steps = [(a.parameters - b.parameters)[0, 0].item() for a, b in pairwise(points)]
    assert steps == pytest.approx([0.07, 0.084, 0.1, 0.1])
