"""§4.1: where Model A serves, and where it takes Model B."""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
import scipy.optimize
from matplotlib.axes import Axes

from datagen.changes import with_changes
from indexer_env.machine import Machine
from indexer_env.operating_point import OperatingPoint
from indexer_env.presets import load_machine
from indexer_env.run import Run
from indexer_env.simulate import simulate
from indexer_experiments.study.claims.base import Claim, Rows
from indexer_experiments.study.claims.lines import draw_means
from indexer_experiments.study.lab import Lab
from indexer_experiments.study.measured import JOINTS, SENSOR, drawn, measured, read, scaled
from indexer_experiments.study.settings import Setting
from indexer_experiments.study.verdicts import Interval, Line, by_seed

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

LIMIT = 40.0
"""Largest factor by which a fit may leave the nominal values; a joint 1 that stiff is nearly Model A's rigid one."""

STREAM = 41
"""Tells the machines' random numbers from others of the same seed."""

LEAST = 1e-3
"""Gain below which Model B explains no more: a fit's accuracy."""

QUIET = dataclasses.replace(SENSOR, offset=0.0, offset_drift=0.0, hum_amplitude=0.0, noise_density=0.0, bits=None)
"""The accelerometer as a fit knows it: its bracket and filter."""


@dataclass(frozen=True)
class Truth(Setting):
    """The machine that is measured, besides its factors.

    model  of `Machine`
    slow   factor of the heavy machine's speed
    """

    model: str = "B_on_base"
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
        "Stiffness and damping of the joints are fitted to two cam turns by least squares, inertias are known. The "
        "misfit is the rms of what is left over that of the record; Model B's gain is the rms of what it explains "
        "beyond Model A, over that of the record, in which the noise cancels: gain² = misfit(A)² − misfit(B)².",
        "High speed: 1.5 times; low rigidity: half of both stiffnesses; high inertia: 3 times the table's.",
        "Model B contains Model A, so it never fits worse: “A is to be preferred” is read as B's gain being smaller.",
    )
    settings: ClassVar[tuple[Truth, ...]] = (
        Truth("loose and worn", "housing on screws of finite stiffness, 2′ of play in the reducer"),
        Truth("rigid base", "the housing does not move", model="B"),
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
                machine = scaled(with_changes(drawn(rng), {"model": setting.model}), factors)
                speed *= setting.slow if name == "heavy" else 1.0
                point = dataclasses.replace(OperatingPoint(), motor_speed=speed * OperatingPoint().motor_speed)
                record = measured(machine, point, rng, SAMPLES)
                # A fit begins at the drawing's values.
                drawing = scaled(load_machine(), factors)
                left = misfits(record, drawing, point)
                gain = np.sqrt(max(left["A"] ** 2 - left["B"] ** 2, LEAST**2))
                own = {"variant": name, "misfit_A": left["A"], "misfit_B": left["B"], "gain": float(gain)}
                rows += lab.told(setting, seed, [own])
        return rows

    def judge(self, rows: Rows) -> tuple[Line, ...]:
        """Model B's gain on each machine over that on the plain one."""
        gains = by_seed(rows, "gain")

        def line(name: str, what: str, paper: str, low: float = -np.inf, high: float = np.inf) -> Line:
            misfits = {model: 100 * by_seed(rows, f"misfit_{model}")[name].mean() for model in FITTED}
            left = " and ".join(f"Model {model} leaves {value:.2g} %" for model, value in misfits.items())
            says, gain = f"gain of Model B {what} over that on the plain machine", gains[name]
            return Line(says, paper, Interval.of_ratio(gain, gains["plain"]), f"{left} of the record.", low, high)

        return (
            line("fast", "at high speed", "Model B serves better (above 1)", low=1.0),
            line("soft", "at low rigidity", "Model B serves better (above 1)", low=1.0),
            line("heavy", "at high inertia", "Model A preferred (below 1)", high=1.0),
        )

    def draw(self, axes: list[Axes], rows: Rows) -> None:
        """Misfit of both models, and the gain."""
        shares = {f"Model {model}": (f"misfit_{model}", colour) for model, colour in zip(FITTED, (0, 4), strict=True)}
        for ax, curves, label in (
            (axes[0], shares, "misfit over the record"),
            (axes[1], {"explained by B beyond A": ("gain", 2)}, "gain of Model B"),
        ):
            for name, (value, colour) in curves.items():
                cells = by_seed(rows, value)
                draw_means(ax, [cells[machine] for machine in MACHINES], name, colour)
            ax.set_xticks(range(len(MACHINES)), list(MACHINES))
            ax.set(xlabel="machine", ylabel=label)
            ax.legend()


def misfits(record: np.ndarray, drawing: Machine, point: OperatingPoint) -> dict[str, float]:
    """What the best fit of each model without play leaves of a record [rad/s²]: rms over the rms of the record [-]."""
    stiffness = [path in STIFF for path in JOINTS]
    starts = [np.where(stiffness, np.log(factor), 0.0) for factor in STARTS]
    output = [path.startswith("output") for path in JOINTS]
    simple = _best(record, drawing, point, "A", [start[output] for start in starts])
    # Model A is Model B with a rigid joint 1, so its fit is one more place to start from.
    rigid = np.where(stiffness, np.log(LIMIT / 2), 0.0)
    rigid[output] = simple.x
    full = _best(record, drawing, point, "B", [starts[0], rigid])
    scale = np.std(record) * np.sqrt(len(record))
    return {"A": float(np.sqrt(2.0 * simple.cost) / scale), "B": float(np.sqrt(2.0 * full.cost) / scale)}


def _best(record: np.ndarray, drawing: Machine, point: OperatingPoint, model: str, starts: list[np.ndarray]) -> Any:
    """Least squares over the logarithms of the factors of what is fitted; the best from several starts."""
    nominal = with_changes(drawing, {"model": model, "input_joint.backlash": 0.0})
    paths, run, limit = FITTED[model], Run(samples=len(record), warmup_turns=0), np.log(LIMIT)

    def residual(logarithms: np.ndarray) -> np.ndarray:
        machine = scaled(nominal, dict(zip(paths, np.exp(logarithms), strict=True)))
        left = read(simulate(machine, point, run).channels["table_acceleration"], None, QUIET) - record
        return left - left.mean()  # an accelerometer's offset is nobody's to explain

    def fit(start: np.ndarray) -> Any:
        return scipy.optimize.least_squares(residual, start, bounds=(-limit, limit), diff_step=1e-4, max_nfev=40)

    return min(map(fit, starts), key=lambda one: one.cost)
