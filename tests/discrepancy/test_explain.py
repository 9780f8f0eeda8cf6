"""An effect that explains everything only from beyond what is possible; a library that is used up. Seeds 5 and 6."""

import copy
import dataclasses
from collections.abc import Mapping

import numpy as np
import pytest

from discrepancy import candidates, explain
from discrepancy.model import Hypothesis, Jobs, Parameter
from discrepancy.naming import MARGIN
from indexer_env.errors import ParameterError
from tests.discrepancy.toy import Stateless


class Hum(Stateless):
    """y = size sin(x) in 4 windows of 200 samples, noise 1; the library knows sizes up to `largest`."""

    def __init__(self, size: float, largest: float, seed: int) -> None:
        self.parameters = (Parameter("offset", "-", 0.0, 0.1, known=True),)
        self.counts, self.groups = np.full(4, 200), np.zeros(4, dtype=np.int64)
        self.x = np.linspace(0.0, 40.0, 800).reshape(4, 200)
        self.y = size * np.sin(self.x) + np.random.default_rng(seed).standard_normal((4, 200))
        self.hum = Hypothesis("hum", (Parameter("hum.size", "-", 0.0, 1.0, 0.0, largest),), {}, ((3.0,), (9.0,)))

    def hypotheses(self) -> Mapping[str, tuple[Hypothesis, ...]]:
        return {"hum": (self.hum,)}

    def residuals(self, hypothesis: Hypothesis, jobs: Jobs) -> np.ndarray:
        points = jobs.points[jobs.point]
        size = points[:, 1] if points.shape[1] > 1 else np.zeros(len(points))
        return 0.1 * points[:, :1] + size[:, None] * np.sin(self.x[jobs.window]) - self.y[jobs.window]


@pytest.mark.parametrize(("largest", "verdict"), [(30.0, "named"), (9.9, "unexplained")])
def test_an_effect_at_its_bound_is_not_named(largest: float, verdict: str) -> None:
    answer = explain(Hum(10.0, largest, 5), Hum(10.0, largest, 6))
    assert answer.verdict == verdict, answer.reason
    assert answer.after < 1.1, "the gap is closed in either case"
    assert ("hum.size is held at its bound of 9.9" in answer.reason) == (verdict == "unexplained")
    # the machine that is shown is the one that the verdict believes
    assert answer.believed.name == ("hum" if verdict == "named" else "none")
    (offset,) = answer.calibration.estimates
    assert offset.value == answer.model.parameters[0].value(answer.believed.place.z[0])


def test_records_held_out_that_are_far_off_are_not_said_to_lack_nothing() -> None:
    answer = explain(Hum(0.0, 30.0, 5), Hum(10.0, 30.0, 6))
    assert (answer.verdict, answer.names) == ("unexplained", ())
    assert answer.before > 5.0 and "held out" in answer.reason
    nothing = explain(Hum(0.0, 30.0, 5), Hum(0.0, 30.0, 6))
    assert nothing.verdict == "none"
    # an effect is charged what a search for it may win by chance
    assert nothing.ranking[0].name == "none" and nothing.ranking[0].probability > 0.95
    scores = {row.name: row.score for row in nothing.ranking}
    assert scores["hum"] - scores["none"] > MARGIN - 10.0


class Spent(Hum):
    """Hum beside a wave that no library knows; once hum is known, nothing is left to look for."""

    def __init__(self, seed: int) -> None:
        super().__init__(10.0, 30.0, seed)
        self.y += 4.0 * np.sin(0.37 * self.x)
        self.known: tuple[Hypothesis, ...] = ()

    def hypotheses(self) -> Mapping[str, tuple[Hypothesis, ...]]:
        return {} if self.known else super().hypotheses()

    def extended(self, hypothesis: Hypothesis) -> "Spent":
        other = copy.copy(self)
        other.known = (hypothesis,)
        return other


def test_a_library_that_is_used_up_ends_the_search() -> None:
    answer = explain(Spent(5), Spent(6))
    assert answer.names == ("hum",) and len(answer.rounds) == 1
    assert answer.verdict == "unexplained" and answer.after > 1.5


class Loud(Hum):
    """Nothing is hidden, but the noise is larger than it is said to be; every effect has two starts side by side."""

    def __init__(self, seed: int) -> None:
        super().__init__(0.0, 30.0, seed)
        self.y *= 1.2
        self.waves = tuple(
            Hypothesis(name, (Parameter(f"{name}.size", "-", 0.0, 1.0),), {}, ((3.0,), (-3.0,))) for name in "ab"
        )

    def hypotheses(self) -> Mapping[str, tuple[Hypothesis, ...]]:
        return {wave.name: (wave,) for wave in self.waves}


def test_noise_above_what_was_stated_gets_no_name() -> None:
    answer = explain(Loud(5), Loud(6))
    assert (answer.verdict, answer.names) == ("unexplained", ())


def test_a_model_without_a_library_is_refused() -> None:
    model = Spent(5)
    with pytest.raises(ParameterError, match="must be a library of one effect or more"):
        explain(model.extended(model.hum), model)


@pytest.mark.parametrize(("at_rest", "verdict"), [(True, "named"), (False, "not_converged")])
def test_a_fit_that_is_not_at_rest_and_leaves_a_gap_gives_no_name(monkeypatch, at_rest: bool, verdict: str) -> None:
    """Half a per cent of the gap is left in all windows: little enough to be named, were the fit at rest."""

    class Shade(Spent):
        def __init__(self, seed: int) -> None:
            super().__init__(seed)
            self.y += 10.0 * np.sin(self.x) - 4.0 * np.sin(0.37 * self.x) + 1.2 * np.cos(3.0 * self.x)

    def settled(model, place, converged):
        return dataclasses.replace(candidate(model, place, converged), converged=at_rest)

    candidate = candidates._candidate
    monkeypatch.setattr(candidates, "_candidate", settled)
    answer = explain(Shade(5), Shade(6))
    assert (answer.verdict, answer.names) == (verdict, ("hum",)), answer.reason
