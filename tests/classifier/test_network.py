import math

import pytest
import torch

from classifier.network import Mlp
from indexer_env.errors import ParameterError


@pytest.fixture
def stack():
    network = Mlp(inputs=3, hidden=4, outputs=2)
    generator = torch.Generator().manual_seed(1)
    inputs = torch.rand(6, 3, generator=generator, dtype=torch.float64)
    targets = torch.randint(0, 2, (6, 2), generator=generator).double()
    return network, network.initial(5, generator), inputs, targets


def test_outputs_by_hand():
    """One input, one hidden node, one output, each number worked out on paper."""
    network = Mlp(inputs=1, hidden=1, outputs=1)
    parameters = torch.tensor([[2.0, -1.0, 3.0, 0.5]], dtype=torch.float64)  # w1, b1, w2, b2
    hidden = 1 / (1 + math.exp(-(2.0 * 0.7 - 1.0)))
    expected = 1 / (1 + math.exp(-(3.0 * hidden + 0.5)))
    got = network.outputs_of(parameters, torch.tensor([[0.7]], dtype=torch.float64))
    assert got.shape == (1, 1, 1)
    assert got.item() == pytest.approx(expected, rel=1e-15)


def test_gradient_against_automatic_differentiation(stack):
    network, parameters, inputs, targets = stack
    error, gradient = network.error_and_gradient(parameters, inputs, targets)
    leaf = parameters.clone().requires_grad_()
    miss = network.outputs_of(leaf, inputs) - targets
    expected = miss.square().mean(dim=(1, 2))
    expected.sum().backward()
    assert torch.allclose(error, expected, rtol=1e-14)
    assert torch.allclose(error, network.error(parameters, inputs, targets), rtol=0)
    assert leaf.grad is not None
    assert torch.allclose(gradient, leaf.grad, rtol=1e-12, atol=1e-16)


def test_layers_tile_the_parameters(stack):
    network, parameters, _, _ = stack
    assert parameters.shape == (5, network.count)
    assert torch.equal(torch.cat([part.flatten(1) for part in network.layers(parameters)], dim=1), parameters)


def test_the_start_follows_the_rule_of_nguyen_and_widrow():
    network = Mlp(inputs=101, hidden=20, outputs=5)
    layers = network.layers(network.initial(3, torch.Generator().manual_seed(0)))
    length = 0.7 * 20 ** (1 / 101)
    assert torch.allclose(layers.w1.norm(dim=2), torch.tensor(4 * length).double())
    # In terms of inputs in ±1 the bias is b/2 + Σ W/4, drawn within ± the length of the weights.
    bias = layers.b1 / 2 + layers.w1.sum(dim=2) / 4
    assert bias.abs().max() <= length
    assert bias.abs().max() > 0.8 * length


def test_the_start_depends_on_the_seed_and_not_on_the_number_of_networks():
    network = Mlp(inputs=3, hidden=4, outputs=2)
    many, few = (network.initial(n, torch.Generator().manual_seed(7)) for n in (4, 2))
    assert torch.equal(many[:2], few)
    assert not torch.equal(few, network.initial(2, torch.Generator().manual_seed(8)))
    assert not torch.equal(few[0], few[1])


@pytest.mark.parametrize("hidden", [0, 2.0, True])
def test_a_network_without_nodes_is_refused(hidden):
    with pytest.raises(ParameterError, match=r"Mlp\.hidden must be a whole number"):
        Mlp(inputs=3, hidden=hidden, outputs=2)
