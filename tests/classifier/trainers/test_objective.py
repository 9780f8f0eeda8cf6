"""The error of a stack, its gradient, the span of the records, and that nothing depends on neighbours."""

import dataclasses

import pytest
import torch

from classifier.trainers.objective import JudgedError, NetworkError

from .conftest import Problem, noisy_problem

FUNCTIONS = [("logistic", "logistic", "binary"), ("logistic", "linear", "bipolar"), ("tanh", "tanh", "bipolar")]
SHAPES = [(6, 30, 8), (41, 21, 1), (41, 21, 50), (40, 20, 7), (5, 21, 7)]


def objective_of(problem: Problem, in_span: bool = True) -> NetworkError:
    return NetworkError(problem.network, problem.calibration, problem.control, in_span=in_span)


@pytest.mark.parametrize("functions", FUNCTIONS, ids="-".join)
@pytest.mark.parametrize(("features", "records", "hidden"), SHAPES)
def test_error_and_gradient_against_automatic_differentiation(features, records, hidden, functions):
    """Whole networks by autograd; what the rule sees is that, turned into the span of the records."""
    names = dict(zip(("hidden_function", "output_function", "targets"), functions, strict=True))
    problem = noisy_problem(features, records, hidden, **names)
    leaf = problem.start.clone().requires_grad_()
    w1, b1, w2, b2 = problem.network.layers(leaf)
    sums = {"logistic": torch.sigmoid, "tanh": torch.tanh, "linear": lambda s: s}
    hidden_values = sums[functions[0]](problem.calibration.inputs @ w1.transpose(1, 2) + b1[:, None])
    outputs = sums[functions[1]](hidden_values @ w2.transpose(1, 2) + b2[:, None])
    error = (outputs - problem.calibration.targets).square().mean(dim=(1, 2))
    error.sum().backward()
    gradient = leaf.grad
    assert gradient is not None

    for in_span in (True, False):
        objective = objective_of(problem, in_span)
        working, offset = objective.enter(problem.start)
        at = objective.evaluate(working)
        assert torch.allclose(at.error, error, rtol=1e-12)
        assert torch.allclose(at.gradient.norm(dim=1), gradient.norm(dim=1), rtol=1e-10)
        moved = objective.leave(working - 0.1 * at.gradient, problem.start)
        assert torch.allclose(moved, problem.start - 0.1 * gradient, rtol=1e-9, atol=1e-12)
        control = problem.network.outputs_of(problem.start, problem.control.inputs) - problem.control.targets
        assert torch.allclose(objective.control_error(working, offset), control.square().mean(dim=(1, 2)), rtol=1e-11)

        judged = JudgedError(objective, offset).evaluate(working)
        for one, other in zip((*at, objective.control_error(working, offset)), judged, strict=True):
            assert torch.allclose(one, other, rtol=1e-11, atol=1e-15)


def test_the_span_is_taken_where_records_are_fewer(wide_problem, problem):
    assert objective_of(wide_problem).network.inputs == 22  # 21 records, made even
    assert objective_of(wide_problem, in_span=False).network.inputs == 42
    assert objective_of(problem).network.inputs == 6


@pytest.mark.parametrize(("features", "records", "hidden"), SHAPES)
@pytest.mark.parametrize("in_span", [True, False])
def test_a_network_does_not_feel_its_neighbours(features, records, hidden, in_span):
    """Bit for bit, in a stack of more than one tile, at every place that counts."""
    problem = noisy_problem(features, records, hidden, networks=70)
    objective = objective_of(problem, in_span)
    working, offset = objective.enter(problem.start)
    together, control = objective.evaluate(working), objective.control_error(working, offset)
    back = objective.leave(working + 0.1, problem.start)
    for i in (0, 1, 63, 64, 69):
        alone, alone_offset = objective.enter(problem.start[i : i + 1])
        assert torch.equal(alone[0], working[i])
        point = objective.evaluate(alone)
        assert torch.equal(point.error[0], together.error[i])
        assert torch.equal(point.gradient[0], together.gradient[i])
        assert torch.equal(objective.control_error(alone, alone_offset)[0], control[i])
        assert torch.equal(objective.leave(alone + 0.1, problem.start[i : i + 1])[0], back[i])


def test_records_and_features_of_zeros_change_nothing(wide_problem):
    """The idle number that fills a stack's rows stays idle."""
    network = dataclasses.replace(wide_problem.network, hidden=8, outputs=1)
    start = network.initial(2, torch.Generator().manual_seed(0))
    examples = wide_problem.calibration._replace(targets=wide_problem.calibration.targets[:, :1])
    objective = NetworkError(network, examples, examples, in_span=True)
    assert objective.width == objective.network.count + 1
    working, _ = objective.enter(start)
    changed = working.clone()
    changed[:, -1] = 5.0
    assert torch.equal(objective.evaluate(changed).gradient, objective.evaluate(working).gradient)
    assert torch.equal(objective.evaluate(working).gradient[:, -1], torch.zeros(2).double())
