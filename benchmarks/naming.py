"""Does the search name a hidden effect? ``python -m benchmarks.naming [--play FACTOR] [--seed N] [EFFECT …]``

Each case: a machine drawn ±10 % in all its parameters, one effect (or none) drawn and hidden in it, three noisy records
(two to fit, one at another speed and load held out), start angles known to 0.002 rad. With --reference the truth comes
from the event-located solver, which shares no code with the kernels, and takes minutes a case; else from the kernel at
an eighth of the search's step. One line a case: right, ambiguous, refused or WRONG, what was hidden, gap, CPU time.
"""

from __future__ import annotations

import argparse
import dataclasses
import math
import time

import numpy as np

from discrepancy import explain
from discrepancy.indexer import Experiment, IndexerModel
from discrepancy.indexer.parameters import UNCERTAINTY, changed, read
from indexer_env import OperatingPoint, Run, Sensor, SensorEffect, Signal, load_machine, make_effect, simulate
from indexer_env.effects import Effect
from indexer_env.machine import Machine
from indexer_env.reference import simulate_reference

RPM = 2.0 * math.pi / 60.0
CONDITIONS = ((1500.0, 2.0, 2.0), (1200.0, 2.0, 1.3), (1350.0, 20.0, 1.3))
"""Motor speed [rpm], load [N m] and table turns of each record; the last one is held out."""

HIDDEN: dict[str, dict[str, float | tuple[float, float]]] = {
    "friction.coulomb": {"torque": 22.0},
    "friction.viscous": {"coefficient": 80.0},
    "friction.stribeck": {"torque": 19.0, "speed": (0.04, 0.25)},
    "load.imbalance": {"torque": 95.0, "phase": (0.0, 6.28)},
    "load.process": {"torque": 128.0, "centre": (0.62, 0.88), "half_width": (0.06, 0.12)},
    "drive.slip": {"compliance": 1.5},
    "drive.speed_ripple": {"depth": 0.0052, "phase": (0.0, 6.28)},
    "drive.transmission_error": {"amplitude": 1.06e-3, "phase": (0.0, 6.28)},
    "drive.mesh_stiffness": {"depth": 0.5, "phase": (0.0, 6.28)},
    "cam.profile_error": {"height": 1.06e-3, "centre": (0.08, 0.42), "half_width": (0.04, 0.12)},
    "cam.station_spacing": {"error": 0.011, "station": (0, 7)},
    "roller.crack": {"severity": 0.31},
    "roller.crack_single": {"severity": 0.35, "station": (0, 7)},
    "input.backlash": {"play": 2.8e-3},
    "output.backlash": {"play": 1.9e-4},
    "output.cubic_stiffness": {"stiffness": 4.9e9},
    "base.looseness": {"compliance": 3e-6, "damping_ratio": (0.02, 0.1)},
    "sensor.gain": {"error": 0.1},
    "sensor.lowpass": {"time_constant": 8e-3},
    "sensor.bracket_resonance": {"inverse_square": 1.6e-5, "damping": (0.01, 0.06)},
    "sensor.mains_hum": {"amplitude": 0.95, "phase": (0.0, 6.28)},
    "sensor.offset_drift": {"rate": 0.073},
}
"""What is hidden: the first parameter is drawn log-uniform within a factor of 1.7 about its value, the others uniform
between their two values. Most leave the base model three to ten times the noise."""


def draw(nominal: Machine, rng: np.random.Generator) -> Machine:
    """The machine with each parameter uniform within ±10 %."""
    return changed(nominal, {name: read(nominal, name) * (1.0 + 0.1 * rng.uniform(-1.0, 1.0)) for name in UNCERTAINTY})


def experiments(truth: Machine, sensor: Sensor, rng: np.random.Generator, reference: bool) -> list[Experiment]:
    """Three noisy records: 1.5 % of the first one's spread."""
    found: list[Experiment] = []
    noise = math.nan
    for rpm, load, turns in CONDITIONS:
        point = OperatingPoint(rpm * RPM, load, rng.uniform(0.0, 2.0 * math.pi))
        samples = int(turns * truth.turn_duration(point) * 1000.0)
        if reference:
            run = simulate_reference(truth, point, samples=samples, turns_before=1)
        else:
            run = simulate(truth, point, Run(step=0.5e-3 / 8.0, samples=samples))
        clean = sensor.read(run.channels["table_acceleration"], 1000.0).values
        noise = 0.015 * clean.std() if math.isnan(noise) else noise
        told = dataclasses.replace(point, start_angle=point.start_angle + 0.002 * rng.standard_normal())
        found.append(Experiment(Signal(clean + noise * rng.standard_normal(samples), 1000.0, unit="rad/s^2"), told))
    return found


def hidden_effect(name: str, rng: np.random.Generator) -> Effect | None:
    """The effect of a case, its size and shape drawn."""
    if name == "none":
        return None
    drawn: dict[str, float] = {}
    for parameter, given in HIDDEN[name].items():
        if not isinstance(given, tuple):
            drawn[parameter] = given * 1.7 ** rng.uniform(-1.0, 1.0)
        elif parameter == "station":
            drawn[parameter] = int(rng.integers(given[0], given[1] + 1))
        else:
            drawn[parameter] = rng.uniform(*given)
    return make_effect(name, drawn)


def case(name: str, play: float, seed: int, reference: bool) -> str:
    """Run one case; its line."""
    rng = np.random.default_rng((seed, [*HIDDEN, "none"].index(name)))
    nominal = load_machine("reference")
    nominal = changed(nominal, {"input_joint.backlash": nominal.input_joint.backlash * play})
    truth, sensor, effect = draw(nominal, rng), Sensor(), hidden_effect(name, rng)
    if isinstance(effect, SensorEffect):
        sensor = effect.extend_sensor(sensor)
    elif effect is not None:
        truth = truth.with_effects(effect)  # type: ignore[arg-type]
    records = experiments(truth, sensor, rng, reference)
    start = time.process_time()
    answer = explain(IndexerModel(nominal, records[:2]), IndexerModel(nominal, records[2:]))
    spent = time.process_time() - start
    gap = next(c for c in answer.rounds[0].candidates if c.name == "none").level
    mark = outcome(name, answer.verdict, answer.names, answer.rounds[-1].names)
    found = f"{answer.verdict} {' + '.join(answer.names)}"
    change = f"held out {answer.before:6.2f} -> {answer.after:5.2f}"
    return f"{mark:9s} {name:26s} gap {gap:6.2f}  {change}  {found}  {spent:.0f} s"


def outcome(hidden: str, verdict: str, names: tuple[str, ...], last: tuple[str, ...]) -> str:
    """right, ambiguous (the hidden effect among those named alike), refused or WRONG."""
    expected = () if hidden == "none" else (hidden,)
    if names == expected and verdict in ("named", "none"):
        return "right"
    if verdict == "ambiguous" and hidden in last and len(names) == 1:
        return "ambiguous"
    return "refused" if verdict in ("unexplained", "not_converged", "none") else "WRONG"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("effects", nargs="*", choices=[*HIDDEN, "none", []], help="all of them where none is given")
    parser.add_argument("--play", type=float, default=1.0, help="factor on the healthy 2 arc minutes of play")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--reference", action="store_true", help="truth from the event-located reference solver")
    options = parser.parse_args()
    for name in options.effects or [*HIDDEN, "none"]:
        print(case(name, options.play, options.seed, options.reference), flush=True)


if __name__ == "__main__":
    main()
