import numpy as np
import pytest
import scipy.optimize
import torch

from classifier.network import Mlp
from classifier.trainers.jacobian import linearised
from classifier.trainers.objective import Examples, NetworkError
from classifier.trainers.trainlm import TrainLm

from .conftest import noisy_problem

FUNCTIONS = [("logistic", "logistic", "binary"), ("tanh", "tanh", "bipolar"), ("logistic", "linear", "bipolar")]


def objective_of(features, records, hidden, functions):
    names = dict(zip(("hidden_function", "output_function", "targets"), functions, strict=True))
    problem = noisy_problem(features, records, hidden, networks=3, **names)
    objective = NetworkError(problem.network, problem.calibration, problem.control, in_span=True)
    return problem, objective, objective.enter(problem.start)[0]


@pytest.mark.parametrize("functions", FUNCTIONS)
def test_the_jacobian_against_automatic_differentiation(functions):
    _, objective, parameters = objective_of(6, 10, 3, functions)
    network = objective.network
    linear = linearised(network, parameters, objective.calibration)
    for i, one in enumerate(parameters):

        def outputs(p):
            # Out of place, as differentiation asks for; outputs first, then records.
            layers = network.layers(p[None])
            sums = {"logistic": torch.sigmoid, "tanh": torch.tanh, "linear": lambda s: s}
            hidden = sums[functions[0]](objective.calibration.inputs @ layers.w1[0].T + layers.b1[0])
            return sums[functions[1]](hidden @ layers.w2[0].T + layers.b2[0]).T.flatten()

        expected = torch.func.jacrev(outputs)(one)[:, : network.count]
        jacobian = linear.jacobian()[i]
        assert torch.allclose(jacobian, expected, rtol=1e-11, atol=1e-14)
        assert torch.allclose(linear.gram()[i], expected @ expected.T, rtol=1e-11, atol=1e-13)
        v = torch.arange(len(expected)).double()
        assert torch.allclose(linear.back(v.expand(3, -1))[i], expected.T @ v, rtol=1e-11, atol=1e-12)
        assert torch.allclose(linear.miss[i], outputs(one) - objective.calibration.targets.T.flatten(), atol=1e-15)


@pytest.mark.parametrize(("features", "records", "hidden"), [(6, 40, 3), (41, 21, 3)], ids=["normal", "gram"])
def test_a_step_is_the_formula_written_out(features, records, hidden):
    """With more equations than parameters and with fewer; J from central differences."""
    _, objective, parameters = objective_of(features, records, hidden, FUNCTIONS[0])
    network, rule = objective.network, TrainLm(damping=2.0)
    calibration = objective.calibration
    at = objective.evaluate(parameters)
    after = rule.step(at, rule.begin(at), objective).point
    for i, one in enumerate(parameters):

        def misses(p):
            outputs = network.outputs_of(torch.from_numpy(p)[None], calibration.inputs)[0] - calibration.targets
            return outputs[: calibration.records].numpy().ravel()

        p = one[: network.count].numpy()
        j = np.column_stack([(misses(p + h) - misses(p - h)) / 2e-6 for h in 1e-6 * np.eye(len(p))])
        step = np.linalg.solve(j.T @ j + 2.0 * np.eye(len(p)), j.T @ misses(p))
        assert np.mean(misses(p - step) ** 2) < np.mean(misses(p) ** 2)  # so that the first λ is the one used
        assert after.parameters[i, : network.count].numpy() == pytest.approx(p - step, abs=1e-6)


def test_the_damping_grows_until_the_error_falls():
    """From a far start with hardly any damping, several tries in one epoch."""
    _, objective, parameters = objective_of(6, 40, 3, FUNCTIONS[0])
    at = objective.evaluate(4 * parameters)
    rule = TrainLm(damping=1e-9)
    point, memory, stuck = rule.step(at, rule.begin(at), objective)
    assert (point.error < at.error).all()
    assert not stuck.any()
    # λ = 1e-9 · 10^tries · 0.1
    tries = torch.log10(memory.damping / 1e-10)
    assert torch.allclose(tries, tries.round(), atol=1e-9)
    assert tries.max() >= 2


def test_beside_scipy():
    """From starts around a minimum that MINPACK's Levenberg-Marquardt has found, both find it again; seed 0."""
    generator = torch.Generator().manual_seed(0)
    network = Mlp(1, 2, 1, "tanh", "linear")
    x = torch.linspace(0, 1, 40, dtype=torch.float64)[:, None]
    t = torch.sin(5 * x) + 0.1 * torch.randn(40, 1, generator=generator, dtype=torch.float64)

    def misses(p):
        return (network.outputs_of(torch.from_numpy(p)[None], x)[0] - t).numpy().ravel()

    def least(p):
        return scipy.optimize.least_squares(misses, p, method="lm", xtol=1e-12, ftol=1e-12)

    found = torch.from_numpy(least(network.initial(1, generator)[0].numpy()).x)
    start = found + 0.2 * torch.randn(3, len(found), generator=generator, dtype=torch.float64)
    training = TrainLm(epochs=60, patience=60).train(network, start, Examples(x, t), Examples(x, t))
    for i in range(3):
        assert training.calibration_error[0, i] > 1.5 * np.nanmin(training.calibration_error[:, i])
        expected = 2 * least(start[i].numpy()).cost / len(t)
        assert np.nanmin(training.calibration_error[:, i]) == pytest.approx(expected, rel=1e-6)
