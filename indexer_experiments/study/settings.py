"""The settings under which claims are judged: the first of a claim is the most likely bench of the paper and gives the
verdict, the others change what the paper leaves open and show what the verdict hangs on.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Any

from datagen.recipes import Recipe

STEPS = 10
"""Steps of the play between none and that of the faulty classes, fig. 11."""

BACKLASHES = (0.0, 0.25, 0.5, 0.75, 1.0)
"""Targets of the bench's third node for its five backlashes."""


@dataclass(frozen=True)
class Setting:
    """How one claim is worked out.

    key    a few words, its name in tables
    words  what is particular about it
    """

    key: str
    words: str

    def commands(self, seed: int) -> tuple[str, ...]:
        """Command lines that make its data set of a seed."""
        return ()


@dataclass(frozen=True)
class Training(Setting):
    """Data and choices of a training.

    recipe    of the data sets
    patience  epochs without a lower control error before a training stops
    scaled    whether features are taken to [0, 1] before training
    scale     of the PSD, "linear" or "log"
    """

    recipe: Recipe
    patience: int = 6
    scaled: bool = True
    scale: str = "linear"

    def commands(self, seed: int) -> tuple[str, ...]:
        """The data set's."""
        return (self.recipe.command(seed),)


@dataclass(frozen=True)
class Simulated(Training):
    """The simulated case, paper §4.

    sweep  records of Model B with linear joints, at plays of joint 2 from none to that of the faulty classes
    """

    sweep: Recipe = dataclasses.field(kw_only=True)


@dataclass(frozen=True)
class OnBench(Training):
    """The bench, paper §5.

    targets      of the third node for each of the five backlashes
    judge_stops  the validation records stop the training too, and all others are calibration records
    """

    targets: tuple[float, ...] = BACKLASHES
    judge_stops: bool = False


def table2(
    name: str, *, faults: tuple[float, float] = (1e-3, 0.6), share: float = 0.1, noise: float = 0.0
) -> dict[str, Any]:
    """Recipes of the simulated case: play [rad] and stiffness ratio of joint 2 in the faulty classes, half-width of the
    draws, signal-to-noise ratio [dB], 0 for none.
    """
    play, ratio = faults
    quantities = [f"{joint}_joint.{quantity}" for joint in ("input", "output") for quantity in ("stiffness", "damping")]
    shapes = ("output_joint.backlash", "output_joint.stiffness_ratio")
    draws = [f"campaign.draws.machine.{quantity}.around={share:g}" for quantity in (*quantities, *shapes)]
    sizes = (f"campaign.output_backlash={play:g}", f"campaign.stiffness_ratio={ratio:g}")
    noisy = (f"sensor.noise_snr_db={noise:g}",) if noise else ()
    plays = ",".join(f"{play * step / STEPS:g}" for step in range(STEPS + 1))
    sweep = (
        "campaign=grid",
        "campaign.repeats=12",
        "machine.input_joint.backlash=0",
        f"+campaign.axes.machine.output_joint.backlash=[{plays}]",
        *(f"+{draw}" for draw in draws[: len(quantities)]),
        *noisy,
    )
    recipe = Recipe(f"table2-{name}", ("campaign=table2", *draws, *sizes, *noisy))
    return {"recipe": recipe, "sweep": Recipe(f"table2-{name}-sweep", sweep)}


_PAPER = table2("paper")
_HARDER = table2("harder", faults=(2e-4, 0.8), share=0.2, noise=15.0)
HARDER = Simulated(
    "harder data",
    "scaled, 20 epochs of patience, machines ±20 %, noise 15 dB below the signal, play 0.2 mrad, ρ = 0.8",
    patience=20,
    **_HARDER,
)
RAW = Simulated("raw inputs", "raw inputs, 6 epochs of patience", scaled=False, **_PAPER)
SCALED = Simulated("scaled inputs", "inputs scaled to 0 … 1, 6 epochs of patience", **_PAPER)
PATIENT = Simulated("raw, 100 epochs", "raw inputs, 100 epochs of patience", scaled=False, patience=100, **_PAPER)

ANALYSIS = (RAW, SCALED, HARDER)
"""The analysis of choices, §4.2. The toolbox of the time hands inputs on as they are and gives up after 5 failures (6
in later releases), and of all trainings tried on data without noise this one ends most often near the paper's 0.06
(fig. 5), which is therefore not judged.
"""

DIAGNOSIS = (
    SCALED,
    RAW,
    PATIENT,
    Simulated("noise", "noise 10 dB below the signal", **table2("noisy", noise=10.0)),
    Simulated("mild faults", "play 0.2 mrad, ρ = 0.8", **table2("mild", faults=(2e-4, 0.8))),
    HARDER,
)
"""The network that the paper settles on, §4.3. One network with 0.3 % cannot come from trainings of which four of five
end near 6 %: something changed since §4.2. Scaled to 0 … 1 the inputs are still “all positive values” and the result no
longer hangs on the unit of the record, which is not printed.
"""

_BENCH = "campaign=bench"
_TRIGGER = "campaign.drift.operating_point.start_angle_deg=0"
_TRIGGERED = Recipe("bench-trigger", (_BENCH, _TRIGGER))

TRIGGER = OnBench("trigger", "records start at the same cam angle; scaled inputs, 6 epochs of patience", _TRIGGERED)
RANDOM = OnBench("random start", "records start at any cam angle", Recipe("bench-random", (_BENCH,)))
ROUGH = OnBench(
    "rough bench",
    "joints and backlash ±10 %, 25 times the noise",
    Recipe(
        "bench-rough",
        (
            _BENCH,
            _TRIGGER,
            "campaign.draws.machine.input_joint.stiffness.around=0.1",
            "campaign.draws.machine.output_joint.stiffness.around=0.1",
            "campaign.drift.faults.backlash.around=0.1",
            "sensor.noise_density=0.05",
        ),
    ),
)
BENCH = (
    TRIGGER,
    RANDOM,
    ROUGH,
    OnBench("raw inputs", "inputs as they are", _TRIGGERED, scaled=False),
    OnBench("raw, 100 epochs", "inputs as they are, 100 epochs of patience", _TRIGGERED, scaled=False, patience=100),
    OnBench("printed targets", "0.24, 0.48 and 0.76", _TRIGGERED, targets=(0.0, 0.24, 0.48, 0.76, 1.0)),
    OnBench("seven teach", "the 3 others stop the training and judge it", _TRIGGERED, judge_stops=True),
)
"""The bench, §5. The records are one turn of the table and are laid over computed motions in figs. 1 and 10, which
needs the cam angle of the first sample: a trigger. The training is that of §4.3.
"""
