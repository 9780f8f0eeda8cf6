"""What a model must offer so that its records can be explained: parameters, effects as hypotheses, windows, residuals.

Nothing here knows which machine it is about. A fit works in scaled coordinates z: a parameter's value is
nominal + scale·z, or nominal·exp(scale·z) where it is logarithmic; z = ±1 is one unit of uncertainty.
"""

from __future__ import annotations

import copy
import math
from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from discrepancy.jobs import Jobs
from indexer_env.checks import check_number
from indexer_env.errors import refuse

_AT_BOUND = 1e-3
"""Distance from a bound, in scaled coordinates, at which a parameter counts as held by it."""


@dataclass(frozen=True)
class Parameter:
    """A number that a fit may move.

    Attributes
    ----------
    name, unit : str
    nominal : float
        Value [unit] at z = 0; > 0 where logarithmic.
    scale : float
        Change per unit of z, > 0: [unit], or relative (one standard deviation of ln) where logarithmic.
    low, high : float
        Bounds of the value [unit].
    known : bool
        True where the scale is the uncertainty with which the nominal value is known (a normal prior); False where the
        scale only says how far is far, and nothing is held against a value within the bounds.
    logarithmic : bool
    rough : bool
        True where the records do not depend on it smoothly (a play): it is held while the fit is cautious.
    record : int or None
        The record that the parameter belongs to alone (`Model.groups`); it is fitted anew on a record held out.
    null : float or None
        Value [unit] that stands for no effect where the bounds leave it out, as no record shows what is so small; else
        the nominal one does.
    """

    name: str
    unit: str
    nominal: float
    scale: float
    low: float = -math.inf
    high: float = math.inf
    known: bool = False
    logarithmic: bool = False
    rough: bool = False
    record: int | None = None
    null: float | None = None

    def __post_init__(self) -> None:
        owner = f"Parameter {self.name}"
        low = 0.0 if self.logarithmic else None
        check_number(owner, "nominal", self.nominal, low=low, low_open=self.logarithmic, unit=self.unit)
        check_number(owner, "scale", self.scale, low=0.0, low_open=True)
        if not self.low <= self.nominal <= self.high:
            raise refuse(owner, "nominal", f"within [{self.low:g}, {self.high:g}] {self.unit}", self.nominal)

    @property
    def of_record(self) -> bool:
        """Whether the parameter belongs to one record alone."""
        return self.record is not None

    def value(self, z: float) -> float:
        """Value [unit] at the scaled coordinate z, kept within the bounds."""
        value = self.nominal * math.exp(self.scale * z) if self.logarithmic else self.nominal + self.scale * z
        return min(max(value, self.low), self.high)

    def coordinate(self, value: float) -> float:
        """Scaled coordinate of a value [unit]."""
        if self.logarithmic:
            return math.log(value / self.nominal) / self.scale
        return (value - self.nominal) / self.scale

    @property
    def bounds(self) -> tuple[float, float]:
        """Bounds of z."""
        low = -math.inf if self.logarithmic and self.low <= 0.0 else self.low
        ends = (low if math.isinf(low) else self.coordinate(low)), self.high
        return ends[0], ends[1] if math.isinf(ends[1]) else self.coordinate(ends[1])

    def held(self, z: float) -> bool:
        """Whether one of its bounds holds it at the scaled coordinate z."""
        low, high = self.bounds
        return bool(min(z - low, high - z) < _AT_BOUND)


@dataclass(frozen=True)
class Hypothesis:
    """One answer to "what is missing": a set of effects with their parameters, or none.

    Attributes
    ----------
    name : str
        "none", the name of an effect, or several joined by " + ".
    parameters : tuple of Parameter
        Of its effects, in their order, nominal at their null values.
    fixed : mapping
        Discrete choices (a station, an order) that a single effect has made.
    starts : tuple of tuple of float
        Values of a single effect's parameters [units] from which its fit may begin.
    alike : tuple of str
        Effects that some records cannot tell from a single one: they are compared with it whatever they promise.
    limits : tuple of str
        Effects that a single one becomes where its shape comes to an end: where it is no better than one of them, it is
        no rival.
    over : str
        The table over the variable of which a single effect's force is a law; "" where there is none.
    series : str
        The model's stiffness with which a single effect's first parameter, a compliance, lies in series; "" where it is
        none.
    effects : tuple of Hypothesis
        The single effects of a set; the effect itself where it is single, nothing where it is none.
    """

    name: str
    parameters: tuple[Parameter, ...] = ()
    fixed: Mapping[str, float] = field(default_factory=dict)
    starts: tuple[tuple[float, ...], ...] = ((),)
    alike: tuple[str, ...] = ()
    effects: tuple[Hypothesis, ...] = ()
    over: str = ""
    limits: tuple[str, ...] = ()
    series: str = ""

    def __post_init__(self) -> None:
        if not self.effects and self.name != "none":
            object.__setattr__(self, "effects", (self,))

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the effects."""
        return tuple(effect.name for effect in self.effects)

    def coordinates(self, values: Sequence[float]) -> np.ndarray:
        """Scaled coordinates of parameter values [units]."""
        return np.array([p.coordinate(v) for p, v in zip(self.parameters, values, strict=True)])

    def places(self, effect: int) -> np.ndarray:
        """Indices into `parameters` of those of one of the effects."""
        first = sum(len(one.parameters) for one in self.effects[:effect])
        return np.arange(first, first + len(self.effects[effect].parameters))


NONE = Hypothesis("none")
"""Nothing is missing: the base model alone."""


def together(*effects: Hypothesis) -> Hypothesis:
    """The set of the effects of several hypotheses."""
    single = tuple(one for hypothesis in effects for one in hypothesis.effects)
    if len(single) < 2:
        return single[0] if single else NONE
    name = " + ".join(one.name for one in single)
    return Hypothesis(name, tuple(p for one in single for p in one.parameters), effects=single)


class Model(ABC):
    """A model of a machine together with records of it, cut into windows.

    Attributes
    ----------
    parameters : tuple of Parameter
        The base model's global parameters.
    counts : ndarray (w,)
        Samples of each window.
    groups : ndarray (w,) of int
        The record each window belongs to.
    names : tuple of str
        Of the records; none, or "" for one, where they have no names.
    """

    parameters: tuple[Parameter, ...]
    counts: np.ndarray
    groups: np.ndarray
    names: tuple[str, ...] = ()
    tolerated = 1.0
    """Mean square, over the noise's, that noise and the model's tolerance leave together."""

    def tolerating(self, share: float) -> Model:
        """The model with a discrepancy term beside its noise: it may miss this share of the signal (rms over rms, of
        what the model reads at its nominal parameters), and nothing need be missing."""
        w, other = len(self.counts), copy.copy(self)
        jobs = Jobs.at(np.zeros(len(self.parameters)), np.arange(w), np.zeros((w, self.local_count(NONE))))
        squares = float((self.readings(NONE, jobs) ** 2).sum())
        other.tolerated = 1.0 + share**2 * squares / float(self.counts.sum())
        return other

    @abstractmethod
    def hypotheses(self, residual: np.ndarray | None = None) -> Mapping[str, tuple[Hypothesis, ...]]:
        """The library: for each effect's name its hypotheses of one effect, one per discrete choice.

        What a fit has left of all samples, residuals (w, n), may add choices (a line's frequency, say)."""

    @abstractmethod
    def residuals(self, hypothesis: Hypothesis, jobs: Jobs) -> np.ndarray:
        """(simulated - measured)/noise of each job (n, samples); 0 beyond a window's end."""

    def squares(self, hypothesis: Hypothesis, jobs: Jobs) -> np.ndarray:
        """Sum of squared residuals of each job (n,). To be overridden where it takes less than all residuals."""
        residuals = self.residuals(hypothesis, jobs)
        return np.einsum("in,in->i", residuals, residuals)

    def told(self, hypothesis: Hypothesis, point: np.ndarray) -> np.ndarray:
        """Samples (w,) of each window whose residuals tell how well a global point fits. To be overridden where some
        are 0 whatever is measured, as those that friction at rest takes."""
        return self.counts

    def readings(self, hypothesis: Hypothesis, jobs: Jobs) -> np.ndarray:
        """What an instrument would read of each job, over the noise; 0 beyond a window's end. To be overridden where
        residuals leave anything out that is unknown of single windows."""
        return self.recording(np.zeros((len(self.counts), int(self.counts.max())))).residuals(hypothesis, jobs)

    def kin(self, hypothesis: Hypothesis, point: np.ndarray) -> np.ndarray:
        """Other global points (k, g) that explain the records almost as well, by a symmetry of the equations that is
        nearly exact: single steps do not lead there. None where nothing is known of such a symmetry."""
        return np.zeros((0, len(point)))

    def record(self, g: int) -> str:
        """What its record of this number is called; its number where it has no name."""
        return (self.names[g] if self.names else "") or f"record {g + 1}"

    def part(self, windows: int) -> Model:
        """The model with about so many windows of all its records, or itself where it has no more."""
        return self

    def among(self, whole: Model) -> np.ndarray:
        """Numbers (w,) that this model's windows have in the whole of which it is a part."""
        return np.arange(len(self.counts))

    def with_all_samples(self) -> Model:
        """The model with the samples of its windows that a part may have left out."""
        return self

    def noise_left(self, residual: np.ndarray) -> tuple[float, float]:
        """The noise that residuals (w, n) of all samples show, as a share of that which was estimated, and its
        correlation from sample to sample. To be overridden where it was: what a machine does looks like noise."""
        return 1.0, 0.0

    def with_noise(self, share: float, colour: float) -> Model:
        """The model with this share of the noise that was estimated. To be overridden with `noise_left`."""
        return self

    def repeats(self) -> Sequence[tuple[int, int]]:
        """Pairs of windows that see the same: what their residuals differ in does not repeat. None where nothing is
        known of that."""
        return ()

    @abstractmethod
    def recording(self, readings: np.ndarray) -> Model:
        """The model with these readings (w, samples), in units of the noise, in the place of its records."""

    def states_for(self, hypothesis: Hypothesis, states: np.ndarray) -> np.ndarray:
        """Scaled states (w, k) found under another hypothesis, with as many local parameters as this one has."""
        size = self.local_count(hypothesis)
        kept = states[:, :size]
        return np.concatenate([kept, np.zeros((len(states), size - kept.shape[1]))], axis=1)

    @abstractmethod
    def local_count(self, hypothesis: Hypothesis) -> int:
        """Local parameters l of each window: what is unknown about the state it starts in, 0 where nothing is; those
        that hypotheses share come first, and z = 0 is where a search begins."""

    def freed(self, hypothesis: Hypothesis) -> int:
        """Unknowns of each window that a set has more than the model as it came: its search and its judgement make it
        pay for them, as each explains one sample of noise in every window."""
        return self.local_count(hypothesis) - self.local_count(NONE)

    @abstractmethod
    def state_grid(self, hypothesis: Hypothesis, point: np.ndarray, *, shaken: bool = False) -> np.ndarray:
        """Scaled local parameters (c, k) among which a window's start may have to be looked for; the first k local
        parameters take part. No rows where nothing has to be looked for. Where it is `shaken`, also those that the
        machine gets to by being excited steadily, if the hypothesis does that."""
