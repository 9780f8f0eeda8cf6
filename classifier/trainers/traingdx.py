"""Gradient descent with momentum and a learning rate that varies: the rule the paper chose (§4.2,
"traingdx").
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

from torch import Tensor

from classifier.trainers.variable_rate import Memory, VariableRate
from indexer_env.checks import check_number


@dataclass(frozen=True)
class TrainGdx(VariableRate):
    """Full-batch gradient descent with momentum and variable learning rate:

        change = momentum · previous change − momentum · rate · ∂E/∂parameters

    momentum  share of the previous change that lives on, and factor of the gradient, in (0, 1)

    The other parameters and the variation of the rate are those of `VariableRate`. E is the mean square error
    over records and outputs. Its gradient is small at the start and the rate grows by 5 % an epoch until
    steps start to fail: the first hundred epochs or so are this run-up.
    Sources: T. P. Vogl et al., Biological Cybernetics 59 (1988) 257–263 (the rule); default numbers and the
    factor of the gradient as documented for MATLAB's traingdx.

    Raises ParameterError.
    """

    kind: ClassVar[str] = "traingdx"

    momentum: float = 0.9

    def __post_init__(self) -> None:
        super().__post_init__()
        check_number("TrainGdx", "momentum", self.momentum, low=0.0, high=1.0, low_open=True, high_open=True)

    def change(self, gradient: Tensor, memory: Memory) -> Tensor:
        """A share of the previous change, and downhill as far as the rate says."""
        return memory.change.mul_(self.momentum).addcmul_(memory.rate, gradient, value=-self.momentum)
