"""Training rules, one file each.

    base                what they share: the loop over epochs, early stopping, the leaving of networks
    objective           the error they lower, and the rotation that spares features beyond the records
    variable_rate       what the next two share
    traingdx            gradient descent with momentum and variable learning rate (the paper's choice)
    traingda            gradient descent with variable learning rate
    trainrp             resilient back-propagation
    trainscg            scaled conjugate gradients, without a line search
    line_search         bracket, bisection and cubic interpolation
    descent             what all rules with a line search share
    conjugate_gradient  what the next two share
    traincgf            conjugate gradients, Fletcher and Reeves
    traincgp            conjugate gradients, Polak and Ribière
    traincgb            conjugate gradients, restarts of Powell and Beale
    trainoss            one-step secant
    trainbfg            quasi-Newton, BFGS
    jacobian            derivatives of every single output
    trainlm             Levenberg and Marquardt

TRAINERS finds a rule by its name; `make_trainer` makes one from a plain mapping, as in conf/trainer.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from classifier.trainers.base import Trainer, Training
from classifier.trainers.objective import Examples
from classifier.trainers.trainbfg import TrainBfg
from classifier.trainers.traincgb import TrainCgb
from classifier.trainers.traincgf import TrainCgf
from classifier.trainers.traincgp import TrainCgp
from classifier.trainers.traingda import TrainGda
from classifier.trainers.traingdx import TrainGdx
from classifier.trainers.trainlm import TrainLm
from classifier.trainers.trainoss import TrainOss
from classifier.trainers.trainrp import TrainRp
from classifier.trainers.trainscg import TrainScg
from indexer_env.build import from_mapping
from indexer_env.checks import check_choice

__all__ = ["TRAINERS", "Examples", "Trainer", "Training", "make_trainer"]

TRAINERS: dict[str, type[Trainer]] = {
    rule.kind: rule
    for rule in (
        TrainGdx,
        TrainGda,
        TrainRp,
        TrainCgf,
        TrainCgp,
        TrainCgb,
        TrainScg,
        TrainBfg,
        TrainOss,
        TrainLm,
    )
}


def make_trainer(mapping: Mapping[str, Any]) -> Trainer:
    """Training rule from a plain mapping ``{"kind": ..., parameters}``. Raises ParameterError."""
    parameters = dict(mapping)
    kind = parameters.pop("kind", None)
    check_choice("trainer", "kind", kind, tuple(TRAINERS))
    return from_mapping(TRAINERS[kind], parameters, owner="trainer")
