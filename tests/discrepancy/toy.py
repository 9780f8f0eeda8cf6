"""What models of the tests have in common."""

from collections.abc import Mapping

import numpy as np

from discrepancy.model import Hypothesis, Model


class Stateless(Model):
    """A model whose windows have no start states of their own, without a library."""

    def hypotheses(self) -> Mapping[str, tuple[Hypothesis, ...]]:
        return {}

    def extended(self, hypothesis: Hypothesis) -> Model:
        return self

    def recording(self, readings: np.ndarray) -> Model:
        raise NotImplementedError("what these models read is not measured")

    def features(self) -> np.ndarray:
        return np.zeros((len(self.counts), int(self.counts.max()), 1))

    def local_count(self, hypothesis: Hypothesis) -> int:
        return 0

    def state_grid(self, hypothesis: Hypothesis, point: np.ndarray, *, shaken: bool = False) -> np.ndarray:
        return np.zeros((0, 0))
