"""One network after the other in PyTorch, written the way one would: layers, automatic differentiation, a loop."""

from __future__ import annotations

import torch
from torch import Tensor

from classifier.network import Mlp
from classifier.trainers import Examples
from classifier.trainers.traingdx import TrainGdx


def train(network: Mlp, start: Tensor, calibration: Examples, control: Examples, rule: TrainGdx) -> tuple[int, float]:
    """Epochs and lowest control error of one network (count,) under traingdx and its stopping rules."""
    model = _model(network, start)
    parameters, loss = list(model.parameters()), torch.nn.MSELoss()
    error_now = loss(model(calibration.inputs), calibration.targets)
    gradient = torch.autograd.grad(error_now, parameters)
    error, rate = error_now.item(), rule.rate
    change = [torch.zeros_like(part) for part in parameters]
    with torch.no_grad():
        lowest, since = loss(model(control.inputs), control.targets).item(), 0
    epoch = 0
    while epoch < rule.epochs:
        epoch += 1
        before = [part.detach().clone() for part in parameters]
        with torch.no_grad():
            change = [rule.momentum * (last - rate * g) for last, g in zip(change, gradient, strict=True)]
            for part, step in zip(parameters, change, strict=True):
                part += step
        tried = loss(model(calibration.inputs), calibration.targets)
        if tried.item() > rule.maximum_increase * error:
            with torch.no_grad():
                for part, old in zip(parameters, before, strict=True):
                    part.copy_(old)
            change, rate = [torch.zeros_like(part) for part in parameters], rate * rule.rate_decrease
        else:
            rate *= rule.rate_increase if tried.item() < error else 1.0
            error, gradient = tried.item(), torch.autograd.grad(tried, parameters)
        with torch.no_grad():
            control_error = loss(model(control.inputs), control.targets).item()
        lowest, since = (control_error, 0) if control_error < lowest else (lowest, since + 1)
        length = torch.cat([part.flatten() for part in gradient]).norm()
        if error <= rule.goal or length < rule.minimum_gradient or since >= rule.patience:
            break
    return epoch, lowest


def _model(network: Mlp, start: Tensor) -> torch.nn.Module:
    model = torch.nn.Sequential(
        torch.nn.Linear(network.inputs, network.hidden),
        torch.nn.Sigmoid(),
        torch.nn.Linear(network.hidden, network.outputs),
        torch.nn.Sigmoid(),
    ).to(start.dtype)
    with torch.no_grad():
        for part, value in zip(model.parameters(), network.layers(start[None]), strict=True):
            part.copy_(value[0])
    return model
