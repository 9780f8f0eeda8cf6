from itertools import pairwise

import numpy as np
import pytest
import torch

from classifier.network import Mlp
from classifier.trainers import TRAINERS, Examples, TrainGdx, make_trainer
from indexer_env.errors import ParameterError


def traingdx_of_one(w1, b1, w2, b2, x, t, epochs, rate, mc, up, down, worst):
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
        change = tuple(mc * last - mc * rate * g for last, g in zip(before, gradient, strict=True))
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


@pytest.fixture(scope="module")
def problem():
    """Four networks and noisy examples of two classes that overlap, so that control errors turn up again."""
    generator = torch.Generator().manual_seed(2)
    network = Mlp(inputs=6, hidden=8, outputs=2)
    x = torch.rand(60, 6, generator=generator, dtype=torch.float64)
    noise = 0.4 * torch.randn(60, generator=generator, dtype=torch.float64)
    first = (x[:, 0] + x[:, 1] + noise > 1).double()
    t = torch.stack([first, 1 - first], dim=1)
    return network, network.initial(4, generator), Examples(x[:30], t[:30]), Examples(x[30:], t[30:])


def test_against_one_network_by_hand(problem):
    network, start, calibration, control = problem
    rule = TrainGdx(rate=1.0, epochs=120, patience=1000)
    training = rule.train(network, start[1:2], calibration, control)
    w1, b1, w2, b2 = (part[0].numpy() for part in network.layers(start[1:2]))
    data = (calibration.inputs.numpy(), calibration.targets.numpy())
    numbers = (1.0, 0.9, 1.05, 0.7, 1.04)
    errors, _, undone = traingdx_of_one(w1, b1, w2, b2, *data, 120, *numbers)
    assert undone >= 3  # the test means something only where steps were undone
    assert training.calibration_error[:, 0] == pytest.approx(np.array(errors), rel=1e-9)

    # With the calibration subset as control subset the kept weights are those of the lowest error.
    same = rule.train(network, start[1:2], calibration, calibration)
    lowest = int(np.argmin(errors))
    assert same.best_epoch[0] == lowest > 60
    _, weights, _ = traingdx_of_one(w1, b1, w2, b2, *data, lowest, *numbers)
    expected = np.concatenate([part.flatten() for part in weights])
    assert same.parameters[0].numpy() == pytest.approx(expected, rel=1e-8)


@pytest.mark.parametrize("kind", TRAINERS)
def test_each_network_of_a_stack_is_as_trained_alone(problem, kind):
    network, start, calibration, control = problem
    rule = TRAINERS[kind](epochs=400, patience=10)
    together = rule.train(network, start, calibration, control)
    assert len(set(together.epochs.tolist())) > 1  # networks left the stack at different epochs
    for i in range(len(start)):
        alone = rule.train(network, start[i : i + 1], calibration, control)
        assert together.epochs[i] == alone.epochs[0]
        assert together.best_epoch[i] == alone.best_epoch[0]
        assert together.stopped_by[i] == alone.stopped_by[0]
        assert torch.allclose(together.parameters[i], alone.parameters[0], rtol=1e-9, atol=1e-12)
        last = int(alone.epochs[0]) + 1
        assert together.control_error[:last, i] == pytest.approx(alone.control_error[:, 0], rel=1e-9)
        assert np.isnan(together.control_error[last:, i]).all()


@pytest.mark.parametrize("kind", TRAINERS)
def test_exclusive_or_is_learnt(kind):
    x = torch.tensor([[0, 0], [0, 1], [1, 0], [1, 1]], dtype=torch.float64)
    examples = Examples(x, torch.tensor([[0], [1], [1], [0]], dtype=torch.float64))
    network = Mlp(inputs=2, hidden=4, outputs=1)
    start = network.initial(10, torch.Generator().manual_seed(0))
    training = TRAINERS[kind](epochs=3000, patience=3000, goal=1e-3).train(network, start, examples, examples)
    outputs = network.outputs_of(training.parameters, x)[training.best]
    assert torch.equal(outputs.round(), examples.targets)
    assert sum(reason == "goal" for reason in training.stopped_by) >= 5


def test_early_stopping_keeps_the_weights_of_the_lowest_control_error(problem):
    network, start, calibration, control = problem
    training = TrainGdx(epochs=2000, patience=15).train(network, start, calibration, control)
    assert "control" in training.stopped_by
    assert np.array_equal(training.best_epoch, np.nanargmin(training.control_error, axis=0))
    kept = network.error(training.parameters, *control).numpy()
    assert kept == pytest.approx(np.nanmin(training.control_error, axis=0), rel=1e-12)
    for i, reason in enumerate(training.stopped_by):
        if reason == "control":
            assert training.epochs[i] - training.best_epoch[i] == 15
    assert training.best == np.argmin(kept)


def test_reasons_to_stop(problem):
    network, start, calibration, control = problem
    assert TrainGdx(epochs=3).train(network, start, calibration, control).stopped_by == ("epochs",) * 4
    reached = TrainGdx(goal=1.0).train(network, start, calibration, control)
    assert reached.stopped_by == ("goal",) * 4
    assert reached.epochs.tolist() == [1] * 4
    flat = TrainGdx(minimum_gradient=1e3).train(network, start, calibration, control)
    assert flat.stopped_by == ("gradient",) * 4


def test_progress_is_told_each_epoch(problem):
    network, start, calibration, control = problem
    seen = []
    TrainGdx(epochs=5).train(network, start, calibration, control, lambda *told: seen.append(told))
    assert [epoch for epoch, _ in seen] == [1, 2, 3, 4, 5]
    assert all(later <= earlier for (_, earlier), (_, later) in pairwise(seen))


def test_the_start_is_left_as_it_was(problem):
    network, start, calibration, control = problem
    before = start.clone()
    TrainGdx(epochs=5).train(network, start, calibration, control)
    assert torch.equal(start, before)


def test_an_empty_subset_is_refused(problem):
    network, start, calibration, _ = problem
    empty = Examples(torch.zeros(0, 6, dtype=torch.float64), torch.zeros(0, 2, dtype=torch.float64))
    with pytest.raises(ParameterError, match="control must be a subset"):
        TrainGdx().train(network, start, calibration, empty)


@pytest.mark.parametrize(
    ("mapping", "words"),
    [
        ({"kind": "trainlm"}, "trainer.kind must be one of traingdx"),
        ({"kind": "traingdx", "momentun": 0.9}, "momentum"),
        ({"kind": "traingdx", "momentum": 1.0}, "momentum must be .*< 1"),
        ({"kind": "traingdx", "rate": -0.01}, "rate must be .*> 0"),
        ({"kind": "traingdx", "rate_decrease": 1.0}, "rate_decrease must be .*< 1"),
        ({"kind": "traingdx", "rate_increase": 0.9}, "rate_increase must be .*>= 1"),
        ({"kind": "traingdx", "maximum_increase": 0.9}, "maximum_increase must be .*>= 1"),
        ({"kind": "traingdx", "epochs": 0}, "epochs must be a whole number >= 1"),
        ({"kind": "traingdx", "patience": 2.5}, "patience must be a whole number"),
        ({"kind": "traingdx", "goal": -1.0}, "goal must be .*>= 0"),
    ],
)
def test_bad_rules_are_refused(mapping, words):
    with pytest.raises(ParameterError, match=words):
        make_trainer(mapping)
