"""§4.1: where Model A serves, and where it takes Model B."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import scipy.optimize
from matplotlib.axes import Axes

from classifier.study.claims.base import Claim, Rows
from classifier.study.lab import Lab
from classifier.study.measured import JOINTS, SENSOR, drawn, measured, read, scaled
from classifier.study.settings import Setting
from classifier.study.verdicts import Interval, Line, by_seed
from classifier.style import COLOURS
from datagen.changes import with_changes
from indexer_env.errors import SimulationError
from indexer_env.machine import Machine
from indexer_env.operating_point import OperatingPoint
from indexer_env.run import Run
from indexer_env.simulate import simulate

STIFF = ("input_joint.stiffness", "output_joint.stiffness")

MACHINES: dict[str, tuple[dict[str, float], float]] = {
    "plain": ({}, 1.0),
    "fast": ({}, 1.5),
    "soft": (dict.fromkeys(STIFF, 0.5), 1.0),
    "heavy": ({"table_inertia": 3.0}, 1.0),
}
"""Factors of the machine's parameters, and of the motor's speed."""

FITTED = {"A": tuple(path for path in JOINTS if path.startswith("output")), "B": JOINTS}
"""What is fitted of each model; the inertias are known from the drawing."""

SAMPLES = 2050
"""Two cam turns from rest at 1 kHz, the first with the start's transient, which both models have to follow."""

STARTS = (1.0, 0.6)
"""Factors of the nominal stiffnesses from which a fit starts; Model A has to take in both joints and ends softer."""

LIMIT = 12.0
"""Largest factor by which a fit may leave the nominal values."""

STREAM = 41
"""Tells the machines' random numbers from others of the same seed."""

QUIET = dataclasses.replace(SENSOR, offset=0.0, offset_drift=0.0, hum_amplitude=0.0, noise_density=0.0, bits=None)
"""The accelerometer as a fit knows it: its bracket and filter."""


@dataclass(frozen=True)
class Truth(Setting):
    """The machine that is measured, besides its factors.

    model  of `Machine`
    play   whether joint 1 has its healthy play
    slow   factor of the heavy machine's speed
    """

    model: str = "B_on_base"
    play: bool = True
    slow: float = 1.0


class Models(Claim):
    """Which model explains which machine."""

    key: ClassVar[str] = "models"
    where: ClassVar[str] = "§4.1"
    title: ClassVar[str] = "Model B for high speed and low rigidity, Model A for high inertia"
    says: ClassVar[str] = (
        "Compared with measured accelerations of many machines, Model B better explains those of high speed and low "
        "rigidity, while Model A is to be preferred for high loads and high inertias."
    )
    choices: ClassVar[tuple[str, ...]] = (
        "No comparison is printed. “Measured” is here a richer machine than either model (housing on screws, play in "
        "the reducer), simulated by another solver (indexer_env.reference) and read by the bench's accelerometer.",
        "Stiffness and damping of the joints are fitted to two cam turns by least squares, inertias are known. The misfit "
        "is the rms of what is left over the rms of the record; Model B's gain is the misfit of A over that of B.",
        "High speed: 1.5 times; low rigidity: half of both stiffnesses; high inertia: 3 times the table's.",
        "Model B contains Model A, so it never fits worse: “A is to be preferred” is read as B's gain being smaller.",
    )
    settings: ClassVar[tuple[Truth, ...]] = (
        Truth("loose and worn", "housing on screws of finite stiffness, 2′ of play in the reducer"),
        Truth("rigid base", "the housing does not move", model="B"),
        Truth("no play", "no play in the reducer", play=False),
        Truth("heavy is slow", "the heavy machine also turns at half the speed", slow=0.5),
    )
    panels: ClassVar[int] = 2

    def collect(self, lab: Lab, setting: Truth) -> Rows:
        """Misfit of both models for every machine and draw."""
        rows: Rows = []
        for seed in lab.seeds:
            for name, (factors, speed) in MACHINES.items():
                # The same draw for all four machines of a seed.
                rng = np.random.default_rng([seed, STREAM])
                machine = scaled(drawn(rng, model=setting.model), factors)
                if not setting.play:
                    machine = with_changes(machine, {"input_joint.backlash": 0.0})
                speed *= setting.slow if name == "heavy" else 1.0
                point = dataclasses.replace(OperatingPoint(), motor_speed=speed * OperatingPoint().motor_speed)
                record = measured(machine, point, rng, SAMPLES)
                # A fit begins at the drawing's values.
                drawing = scaled(drawn(rng, paths=()), factors)
                misfits = {model: misfit(record, drawing, point, model) for model in FITTED}
                own = {"variant": name, **{f"misfit_{model}": value for model, value in misfits.items()}}
                rows += lab.told(setting, seed, [own | {"gain": misfits["A"] / misfits["B"]}])
        return rows

    def judge(self, rows: Rows) -> tuple[Line, ...]:
        """Model B's gain on each machine over that on the plain one."""
        gains = by_seed(rows, "gain")

        def line(name: str, what: str, paper: str, **limit: float) -> Line:
            misfits = {model: 100 * by_seed(rows, f"misfit_{model}")[name].mean() for model in FITTED}
            left = " and ".join(f"Model {model} leaves {value:.2g} %" for model, value in misfits.items())
            says = f"gain of Model B {what} over that on the plain machine"
            return Line(says, paper, Interval.of_ratio(gains[name], gains["plain"]), f"{left} of the record.", **limit)

        return (
            line("fast", "at high speed", "larger (above 1)", low=1.0),
            line("soft", "at low rigidity", "larger (above 1)", low=1.0),
            line("heavy", "at high inertia", "smaller (below 1)", high=1.0),
        )

    def draw(self, axes: list[Axes], rows: Rows) -> None:
        """Misfit of both models, and the gain."""
        places = np.arange(len(MACHINES))
        for ax, values, label in (
            (
                axes[0],
                {f"Model {model}": by_seed(rows, f"misfit_{model}") for model in FITTED},
                "misfit [% of the record]",
            ),
            (axes[1], {"A over B": by_seed(rows, "gain")}, "gain of Model B"),
        ):
            for number, (name, cells) in enumerate(values.items()):
                factor = 100 if ax is axes[0] else 1
                spans = [Interval.of(np.log(factor * cells[machine])) for machine in MACHINES]
                middle, low, high = (np.exp([getattr(span, end) for span in spans]) for end in ("mean", "low", "high"))
                arms = None if np.isinf(high).any() else np.array([middle - low, high - middle])
                ax.errorbar(places, middle, arms, fmt="o-", color=COLOURS[(0, 4)[number]], label=name)
            ax.set_yscale("log")
            ax.set_xticks(places, list(MACHINES))
            ax.set(xlabel="machine", ylabel=label)
            ax.legend()


def misfit(record: np.ndarray, drawing: Machine, point: OperatingPoint, model: str) -> float:
    """What the best fit of a model without play leaves of a record [rad/s²]: rms over the rms of the record [-]."""
    nominal = with_changes(drawing, {"model": model, "input_joint.backlash": 0.0})
    paths, run = FITTED[model], Run(samples=len(record), warmup_turns=0)
    limit = np.log(LIMIT)

    def residual(logarithms: np.ndarray) -> np.ndarray:
        machine = scaled(nominal, dict(zip(paths, np.exp(logarithms), strict=True)))
        try:
            motion = simulate(machine, point, run).channels["table_acceleration"]
        except SimulationError:
            return np.full(len(record), 1e3)
        return read(motion, None, QUIET) - record

    fits = []
    for start in STARTS:
        first = np.array([np.log(start) if path in STIFF else 0.0 for path in paths])
        fits.append(scipy.optimize.least_squares(residual, first, bounds=(-limit, limit), diff_step=1e-4, max_nfev=40))
    left = min(2.0 * fit.cost for fit in fits)
    return float(np.sqrt(left / len(record)) / np.std(record))
