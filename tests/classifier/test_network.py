import math

import pytest
import torch

from classifier.network import Mlp, Scratch
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


@pytest.mark.parametrize(
    ("functions", "hidden", "output"),
    [
        (("logistic", "linear", "binary"), lambda s: 1 / (1 + math.exp(-s)), lambda s: s),
        (("tanh", "tanh", "bipolar"), math.tanh, math.tanh),
    ],
)
def test_outputs_of_other_functions_by_hand(functions, hidden, output):
    network = Mlp(1, 1, 1, *functions)
    parameters = torch.tensor([[2.0, -1.0, 3.0, 0.5]], dtype=torch.float64)
    got = network.outputs_of(parameters, torch.tensor([[0.7]], dtype=torch.float64))
    assert got.item() == pytest.approx(output(3.0 * hidden(2.0 * 0.7 - 1.0) + 0.5), rel=1e-15)


def test_targets_and_bits_are_inverse():
    bits = torch.tensor([0.0, 1.0, 0.25])
    assert Mlp(1, 1, 1).targets_of(bits).tolist() == bits.tolist()
    network = Mlp(1, 1, 1, "logistic", "tanh", "bipolar")
    assert network.targets_of(bits).tolist() == [-1.0, 1.0, -0.5]
    assert network.bits_of(network.targets_of(bits)).tolist() == bits.tolist()


def test_the_activity_of_a_stack_is_that_of_each_network(stack):
    network, parameters, inputs, _ = stack
    hidden, output = network.forward(network.layers(parameters), inputs)
    w1, b1, w2, b2 = network.layers(parameters)
    assert torch.allclose(hidden[3], torch.sigmoid(w1[3] @ inputs.T + b1[3][:, None]), rtol=1e-14)
    assert torch.allclose(output[3], torch.sigmoid(w2[3] @ hidden[3] + b2[3][:, None]), rtol=1e-14)
    offset = torch.ones_like(hidden)
    shifted = network.forward(network.layers(parameters), inputs, offset).hidden
    assert torch.allclose(torch.logit(shifted), torch.logit(hidden) + 1, rtol=1e-10)


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


@pytest.mark.parametrize(("function", "steepness"), [("logistic", 2.0), ("tanh", 1.0)])
def test_the_start_fits_the_function_of_the_nodes(function, steepness):
    """Inputs of the first layer lie in [0, 1]; those of the second in [0, 1] or, from tanh, in [−1, 1]."""
    network = Mlp(10, 6, 4, function, "linear")
    layers = network.layers(network.initial(2, torch.Generator().manual_seed(0)))
    assert torch.allclose(layers.w1.norm(dim=2), torch.tensor(2 * steepness * 0.7 * 6 ** (1 / 10)).double())
    length = 0.7 * 4 ** (1 / 6)
    scale = 1.0 if function == "tanh" else 2.0
    assert torch.allclose(layers.w2.norm(dim=2), torch.tensor(scale * length).double())
    bias = layers.b2 if function == "tanh" else layers.b2 + layers.w2.sum(dim=2) / 2
    assert bias.abs().max() <= length


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


@pytest.mark.parametrize(
    ("functions", "words"),
    [
        ({"hidden_function": "linear"}, "Mlp.hidden_function must be one of logistic, tanh, got 'linear'"),
        ({"output_function": "logsitic"}, "Mlp.output_function must be one of .*did you mean 'logistic'"),
        ({"targets": "bi"}, "Mlp.targets must be one of binary, bipolar, got 'bi'"),
        ({"targets": "bipolar"}, "Mlp.output_function must be one that reaches bipolar targets, .*use 'tanh' or 'lin"),
    ],
)
def test_functions_that_do_not_fit_are_refused(functions, words):
    with pytest.raises(ParameterError, match=words):
        Mlp(3, 4, 2, **functions)


def test_scratch_keeps_the_largest_memory_of_a_name_and_no_more():
    room, like = Scratch(), torch.zeros(1, dtype=torch.float32)
    large = room("hidden", like, 4, 6)
    assert large.shape == (4, 6) and large.dtype is torch.float32
    for shape in ((4, 6), (3, 6), (2, 1)):
        assert room("hidden", like, *shape).shape == shape
        assert room("hidden", like, *shape).data_ptr() == large.data_ptr()
    assert room("output", like, 4, 6).data_ptr() != large.data_ptr()
    assert room("hidden", like, 5, 6).shape == (5, 6)
