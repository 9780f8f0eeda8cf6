"""Motion laws of a third party: what is no rise is refused, with the place, before it is simulated."""

import dataclasses
import math
from typing import ClassVar

import numpy as np
import pytest

from indexer_env.errors import ParameterError
from indexer_env.motion_law import MOTION_LAWS, Peaks
from indexer_env.motion_law.rise import RiseLaw
from indexer_env.simulate import Run, simulate

TAU = 2.0 * math.pi


@dataclasses.dataclass(frozen=True)
class Own(RiseLaw):
    """The cycloid, but for one factor on what it gives."""

    name: ClassVar[str] = "own"
    factor_y: float = 1.0
    factor_v: float = 1.0
    factor_a: float = 1.0
    rate: float = 0.0

    def _first_half(self, s):
        height, velocity = s - np.sin(TAU * s) / TAU, 1.0 - np.cos(TAU * s)
        acceleration, jerk = TAU * np.sin(TAU * s), TAU**2 * np.cos(TAU * s)
        return self.factor_y * height, self.factor_v * velocity + self.rate, self.factor_a * acceleration, jerk

    def peaks(self):
        return Peaks(2.0, TAU, TAU**2, -(TAU**2))


@dataclasses.dataclass(frozen=True)
class Junctions(Own):
    junctions: ClassVar[tuple[float, ...]] = (0.25, 1.0 / 3.0)


@pytest.mark.parametrize(
    ("law", "said"),
    [
        (Own(factor_y=0.25), r"Own\.y\(1/2\) must be 0\.5, got 0\.125; .* mirrors the first\."),
        (Own(rate=1.0), r"Own\.v\(0\) must be 0, got 1\.0; a rise begins at rest"),
        (Own(factor_v=0.99), r"Own\.v must be the derivative of y by s, with the integral .* from 0 to 0\.\d+, got"),
        (Own(factor_a=1.01), r"Own\.a must be the derivative of v by s, with the integral .* from 0 to 0\.\d+, got"),
        (Own(factor_a=math.nan), r"Own\.a must be the derivative of v by s"),
        (Junctions(), r"Junctions\.junctions must be multiples of 1/128, .* got 0\.333\d+; take the nearest"),
    ],
)  # fmt: skip
def test_what_is_no_rise_is_refused(smooth, law, said):
    with pytest.raises(ParameterError, match=f"^{said}"):
        simulate(dataclasses.replace(smooth, motion_law=law), run=Run(samples=10, warmup_turns=0))


def test_a_rise_of_ones_own_is_taken_as_it_is():
    """The simple harmonic one's acceleration jumps at both ends, which is allowed there."""
    cycloid = MOTION_LAWS["cycloidal"]().pieces(8, 0.5)
    np.testing.assert_allclose(Own().pieces(8, 0.5).coefficients, cycloid.coefficients, rtol=0.0, atol=1e-7)

    @dataclasses.dataclass(frozen=True)
    class SimpleHarmonic(Own):
        def _first_half(self, s):
            sine, cosine = np.sin(math.pi * s), np.cos(math.pi * s)
            return 0.5 - 0.5 * cosine, 0.5 * math.pi * sine, 0.5 * math.pi**2 * cosine, -0.5 * math.pi**3 * sine

    assert SimpleHarmonic().pieces(8, 0.5).breaks.sum() == 3
