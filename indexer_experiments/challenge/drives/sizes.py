"""How much a law changes a drive's force, by trial runs: what the challenge says of its sizes is so."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

import numpy as np

from indexer_experiments.challenge.drives.laws import Law, Sizes
from indexer_experiments.challenge.drives.plant import Run, simulate_plant

RATE = 1000.0
"""Of the controller [Hz]."""
SECONDS = 12.0
"""Of a record."""

_BANDWIDTH = 60.0
"""Of the position loop [rad/s], a quarter of it where the force comes late."""
_LATE = ("delay", "lag")
_READ = ("hum", "hum_frequency", "drift")
_ALONE = ("play", *_LATE)
"""What is measured against a drive that differs in nothing else: as many masses, as slow a loop."""

_TRIALS = 4
_NEAR = 0.1
"""A size is met to a tenth; most laws need two runs for that."""


def run_drive(values: Mapping[str, float], motion: np.ndarray) -> Run:
    """A drive on one motion, its force as it is read."""
    plant = {k: v for k, v in values.items() if k not in (*_LATE, *_READ)}
    whole = plant["mass"] + plant.get("load", 0.0)
    width = _BANDWIDTH / 4.0 if any(name in values for name in _LATE) else _BANDWIDTH
    run = simulate_plant(
        plant, motion, RATE, (whole * width**2, 1.6 * whole * width), delay=int(values.get("delay", 0)),
        lag=values.get("lag", 0.0), steps=25,
    )  # fmt: skip
    hum = values.get("hum", 0.0) * np.sin(2.0 * np.pi * values.get("hum_frequency", 1.0) * run.t)
    return Run(run.t, run.q, run.force + hum + values.get("drift", 0.0) * run.t, run.load)


def sizes_of(base: Mapping[str, float], motions: Sequence[np.ndarray]) -> Sizes:
    """Sizes of a drive."""
    speeds = [np.gradient(motion, 1.0 / RATE) for motion in motions]
    force = _rms([run_drive(base, motion).force for motion in motions])
    stroke, acceleration = float(np.ptp(motions[0])), _rms([np.gradient(speed, 1.0 / RATE) for speed in speeds])
    return Sizes(force, 0.5 * stroke, _rms(speeds), acceleration, SECONDS, base["mass"], base.get("coulomb", 0.0))


def change(base: Mapping[str, float], values: Mapping[str, float], motions: Sequence[np.ndarray]) -> float:
    """rms over all motions of the force that a drive has more with these values than without [N]."""
    alone = {name: 0.0 for name in _ALONE if name in values}
    without = {**base, **values, **alone} if alone else base
    both = {**base, **values}
    return _rms([run_drive(both, motion).force - run_drive(without, motion).force for motion in motions])


def sized(
    law: Law,
    base: Mapping[str, float],
    sizes: Sizes,
    span: tuple[float, float],
    motions: Sequence[np.ndarray],
    rng: np.random.Generator,
) -> dict[str, float] | None:
    """Values of a law that change the force by a share of its rms, uniform over a span; None where the law cannot.

    What changes the force less than was asked, however large, is asked for a size between the span's low end and what
    it did.
    """
    low, high = span
    seed = int(rng.integers(2**32))
    while low <= high:
        asked = x = float(rng.uniform(low, high))
        done = 0.0
        for _ in range(_TRIALS):
            values = law(sizes, x, np.random.default_rng(seed))
            done = change(base, values, motions) / sizes.F
            if abs(done - asked) <= _NEAR * asked:
                return values
            x *= min(max(asked / done, 0.1), 10.0) if 0.0 < done < np.inf else 0.1
        if not done < asked:
            return None
        high = done
    return None


def _rms(rows: Sequence[np.ndarray]) -> float:
    """inf where a run was lost."""
    with np.errstate(all="ignore"):
        size = float(np.sqrt(np.mean(np.concatenate(rows) ** 2)))
    return size if np.isfinite(size) else np.inf
