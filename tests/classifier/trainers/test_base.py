"""What all rules share: the loop, early stopping, reasons to stop, and networks that do not feel each other."""

import dataclasses
from itertools import pairwise

import numpy as np
import pytest
import torch
import yaml

from classifier.network import Mlp
from classifier.trainers import TRAINERS, Examples, Training, base, make_trainer
from classifier.trainers.trainbfg import TrainBfg
from classifier.trainers.traincgf import TrainCgf
from classifier.trainers.traingdx import TrainGdx
from classifier.trainers.trainlm import TrainLm
from classifier.trainers.trainscg import TrainScg
from indexer_env.errors import ParameterError
from indexer_env.presets import config_dir


def same(together: Training, i: int, alone: Training) -> bool:
    """Whether network i of a stack is bit for bit the one trained alone, its history included."""
    last = int(alone.epochs[0]) + 1
    return (
        torch.equal(together.parameters[i], alone.parameters[0])
        and (together.epochs[i], together.best_epoch[i]) == (alone.epochs[0], alone.best_epoch[0])
        and together.stopped_by[i] == alone.stopped_by[0]
        and np.array_equal(together.control_error[:last, i], alone.control_error[:, 0])
        and np.array_equal(together.calibration_error[:last, i], alone.calibration_error[:, 0])
        and bool(np.isnan(together.control_error[last:, i]).all())
    )


@pytest.mark.parametrize("wide", [False, True], ids=["narrow", "wide"])
@pytest.mark.parametrize("kind", TRAINERS)
def test_each_network_of_a_stack_is_as_trained_alone(problem, wide_problem, kind, wide):
    network, start, calibration, control = wide_problem if wide else problem
    rule = TRAINERS[kind](epochs=400, patience=6)
    together = rule.train(network, start, calibration, control)
    assert len(set(together.epochs.tolist())) > 1  # networks left the stack at different epochs
    for i in range(len(start)):
        assert same(together, i, rule.train(network, start[i : i + 1], calibration, control))


FIRST_ORDER = ["traingdx", "traingda", "trainrp"]


@pytest.mark.parametrize("kind", FIRST_ORDER)
def test_single_precision_reaches_the_same(wide_problem, kind):
    """Not the same networks, as rounding tells them apart in the end, but networks as good; start of seed 3."""
    network, _, *subsets = wide_problem
    start = network.initial(40, torch.Generator().manual_seed(3))
    reached = []
    for precision in ("float64", "float32"):
        training = TRAINERS[kind](epochs=300, precision=precision).train(network, start, *subsets)
        assert training.parameters.dtype is torch.float64
        single = torch.equal(training.parameters, training.parameters.float().double())
        assert single == (precision == "float32")
        reached.append(np.nanmin(training.control_error, axis=0))
    assert np.mean(reached[1]) == pytest.approx(np.mean(reached[0]), rel=0.02)


@pytest.mark.parametrize("kind", FIRST_ORDER)
def test_each_network_of_a_stack_in_single_precision_is_as_trained_alone(problem, kind):
    network, start, calibration, control = problem
    rule = TRAINERS[kind](epochs=400, patience=6, precision="float32")
    together = rule.train(network, start, calibration, control)
    for i in range(len(start)):
        assert same(together, i, rule.train(network, start[i : i + 1], calibration, control))


@pytest.mark.parametrize("kind", sorted(set(TRAINERS) - set(FIRST_ORDER)))
def test_rules_of_second_order_take_double_precision_alone(kind):
    with pytest.raises(ParameterError, match=r"precision must be one of float64, got 'float32'"):
        TRAINERS[kind](precision="float32")


@pytest.mark.parametrize("kind", ["traingdx", "trainbfg"])
def test_threads_and_sizes_of_stacks_change_nothing(problem, kind, monkeypatch):
    network, _, calibration, control = problem
    start = network.initial(12, torch.Generator().manual_seed(6))
    rule = TRAINERS[kind](epochs=40)
    threads = torch.get_num_threads()
    try:
        torch.set_num_threads(1)
        one = rule.train(network, start, calibration, control)
        monkeypatch.setattr(base, "STACK", 3)
        torch.set_num_threads(3)
        three = rule.train(network, start, calibration, control)
        assert torch.get_num_threads() == 3
    finally:
        torch.set_num_threads(threads)
    assert torch.equal(one.parameters, three.parameters)
    assert np.array_equal(one.control_error, three.control_error, equal_nan=True)


@pytest.mark.gpu
@pytest.mark.parametrize("kind", TRAINERS)
def test_a_cuda_device_gives_the_same_to_rounding(problem, kind):
    network, start, calibration, control = problem
    rule = TRAINERS[kind](epochs=5)
    here = rule.train(network, start, calibration, control)
    move = (Examples(*(part.cuda() for part in examples)) for examples in (calibration, control))
    there = rule.train(network, start.cuda(), *move)
    assert there.control_error == pytest.approx(here.control_error, rel=1e-6)


def test_memory_bounds_a_stack_and_one_network_is_always_trained(problem, monkeypatch):
    network, start, calibration, control = problem
    sizes = []
    begin = TrainGdx.begin
    monkeypatch.setattr(TrainGdx, "begin", lambda self, point: sizes.append(len(point.error)) or begin(self, point))
    one = TrainGdx().memory_of_one(network, 60)
    for memory, expected in ((2 * one + 1, [2, 2]), (one - 1, [1] * 4)):
        sizes.clear()
        monkeypatch.setattr(base, "MEMORY", memory * torch.get_num_threads())
        TrainGdx(epochs=1).train(network, start, calibration, control)
        assert sizes == expected


@pytest.mark.parametrize("kind", TRAINERS)
def test_exclusive_or_is_learnt(kind):
    x = torch.tensor([[0, 0], [0, 1], [1, 0], [1, 1]], dtype=torch.float64)
    examples = Examples(x, torch.tensor([[0], [1], [1], [0]], dtype=torch.float64))
    network = Mlp(inputs=2, hidden=4, outputs=1)
    start = network.initial(10, torch.Generator().manual_seed(0))
    # Gradient descent without momentum or scaling takes its time.
    training = TRAINERS[kind](epochs=3000, patience=3000, goal=1e-2).train(network, start, examples, examples)
    outputs = network.outputs_of(training.parameters, x)[training.best]
    assert torch.equal(outputs.round(), examples.targets)
    assert sum(reason == "goal" for reason in training.stopped_by) >= 5


def test_early_stopping_keeps_the_weights_of_the_lowest_control_error(problem):
    network, start, calibration, control = problem
    training = TrainGdx(epochs=2000, patience=15).train(network, start, calibration, control)
    assert "control" in training.stopped_by
    assert np.array_equal(training.best_epoch, np.nanargmin(training.control_error, axis=0))
    kept = (network.outputs_of(training.parameters, control.inputs) - control.targets).square().mean(dim=(1, 2)).numpy()
    assert kept == pytest.approx(np.nanmin(training.control_error, axis=0), rel=1e-12)
    for i, reason in enumerate(training.stopped_by):
        if reason == "control":
            assert training.epochs[i] - training.best_epoch[i] == 15
    assert training.best == np.argmin(kept)


@pytest.mark.parametrize("kind", TRAINERS)
def test_reasons_to_stop(problem, kind):
    network, start, calibration, control = problem
    rule = TRAINERS[kind]

    def stopped(examples=control, **numbers):
        return rule(**numbers).train(network, start, calibration, examples)

    assert stopped(epochs=3).stopped_by == ("epochs",) * 4
    reached = stopped(goal=1.0)
    assert reached.stopped_by == ("goal",) * 4
    assert reached.epochs.tolist() == [1] * 4
    assert stopped(minimum_gradient=1e3).stopped_by == ("gradient",) * 4
    # Control targets turned round: what is learnt makes it worse.
    against = Examples(calibration.inputs, 1 - calibration.targets)
    early = stopped(against, patience=8, minimum_gradient=0.0, epochs=400)
    assert "control" in early.stopped_by


@pytest.mark.parametrize(
    "rule",
    [
        TrainCgf(trials=1, first_step=1e6),
        TrainBfg(trials=1, first_step=1e6),
        TrainScg(minimum_step=1e6, scale=1e-12),
        TrainLm(maximum_damping=1e-3),
    ],
    ids=lambda rule: rule.kind,
)
def test_a_network_that_no_step_improves_stops(problem, rule):
    """One evaluation far beyond the valley; or a largest damping that is exceeded at the first step refused."""
    network, start, calibration, control = problem
    training = dataclasses.replace(rule, epochs=400, patience=400).train(network, start, calibration, control)
    assert "step" in training.stopped_by
    assert np.isfinite(training.parameters.numpy()).all()


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
        ({"kind": "trainlmm"}, "trainer.kind must be one of traingdx, .*did you mean 'trainlm'"),
        ({"kind": "traingda", "rate": 0}, "rate must be .*> 0"),
        (
            {"kind": "trainrp", "size": 100.0},
            "size must be between minimum_size = 1e-06 and maximum_size = 50",
        ),
        ({"kind": "trainrp", "size_decrease": 1.5}, "size_decrease must be .*< 1"),
        ({"kind": "traincgf", "first_step": 0.0}, "first_step must be .*> 0"),
        ({"kind": "traincgb", "flatness": 1e-4}, "trainer.flatness must be > decrease = 0.001"),
        ({"kind": "trainscg", "sigma": -1.0}, "sigma must be .*> 0"),
        ({"kind": "trainbfg", "updates": 0}, "updates must be a whole number >= 1"),
        ({"kind": "trainoss", "trials": 2.5}, "trials must be a whole number"),
        ({"kind": "trainlm", "increase": 1.0}, "increase must be .*> 1"),
        ({"kind": "trainlm", "maximum_damping": 1e-9}, "maximum_damping must be >= damping = 0.001"),
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


@pytest.mark.parametrize("kind", TRAINERS)
def test_the_configuration_states_the_defaults(kind):
    mapping = yaml.safe_load((config_dir() / "trainer" / f"{kind}.yaml").read_text(encoding="utf-8"))
    assert mapping == {"kind": kind, **dataclasses.asdict(TRAINERS[kind]())}
    assert make_trainer(mapping) == TRAINERS[kind]()
