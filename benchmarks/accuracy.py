"""The simulator against the reference solver: order, a whole turn, play, spectra of many draws, energy."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from benchmarks import cases, peers
from benchmarks.measures import ENERGY_CHANNELS, energies, level_difference, observed_order, relative_rms
from benchmarks.peers.model_b import plain_rk4
from benchmarks.references import reference_records
from benchmarks.report import Row, number
from classifier.features import Psd
from indexer_env.machine import Machine
from indexer_env.operating_point import OperatingPoint
from indexer_env.run import Run
from indexer_env.simulate import simulate, simulate_batch

ORDER_RATE = 400.0
"""Hz; the longest step that the fastest mode allows, 1.25 ms, then divides the sampling interval."""

ORDER_STEPS = 1.0 / ORDER_RATE / np.array([2.0, 4.0, 8.0, 16.0])
"""s; the largest step that the simulator accepts here is 1.34 ms."""

ORDER_SAMPLES = 280
"""0.7 s: the motion and a part of the dwell."""

FINE = 16.0
"""The fine run of itself: so many times finer than the finest step."""

DRAWS = 160
CONTRAST_DRAWS = 8


def measure(*, quick: bool) -> list[Row]:
    """All rows of this section; `quick` shortens the records and draws fewer machines."""
    samples = 1000 if quick else cases.TURN_SAMPLES
    return [
        order(),
        whole_turn(samples),
        play(),
        plain_step(2 if quick else CONTRAST_DRAWS),
        *spectra(2 if quick else DRAWS, samples),
        energy(),
    ]


def accelerations(
    machines: Sequence[Machine], samples: int, *, step: float | None = None, sample_rate: float = 1000.0
) -> np.ndarray:
    """φ̈ [rad/s²] (n, samples) by the simulator from the start of motion, without warm-up."""
    run = Run(sample_rate=sample_rate, samples=samples, step=step, warmup_turns=0)
    batch = simulate_batch(machines, cases.OPERATING_POINT, run)
    if batch.rejected:
        raise ArithmeticError(next(iter(batch.rejected.values())))
    return batch.table_acceleration


def order_errors(steps: np.ndarray, reference: np.ndarray) -> np.ndarray:
    """Relative rms errors of φ̈ of the smooth machine at these steps [s]."""
    return np.array([
        relative_rms(
            accelerations([cases.smooth()], len(reference), step=step, sample_rate=ORDER_RATE)[0], reference
        )
        for step in steps
    ])  # fmt: skip


def fine_record() -> np.ndarray:
    """The smooth machine at a step so fine that its own error does not count."""
    step = float(ORDER_STEPS[-1]) / FINE
    return accelerations([cases.smooth()], ORDER_SAMPLES, step=step, sample_rate=ORDER_RATE)[0]


def order() -> Row:
    """Order observed on the smooth machine, against a fine run of itself and against the reference solver."""
    own = order_errors(ORDER_STEPS, fine_record())
    other = reference_records([cases.smooth()], cases.OPERATING_POINT, samples=ORDER_SAMPLES, sample_rate=ORDER_RATE)[0]
    steps = ORDER_STEPS[:-1]  # at the last one the reference's own error begins to show
    against = order_errors(steps, other)
    orders = observed_order(ORDER_STEPS, own), observed_order(steps, against)
    return Row(
        "observed order, smooth healthy Model B, steps 1.25 to 0.16 ms over 0.7 s",
        "4.0 ± 0.1",
        f"{orders[0]:.3f} against a fine run of itself, {orders[1]:.3f} against the reference (to 0.31 ms)",
        all(abs(value - 4.0) <= 0.1 for value in orders),
        {"orders": orders, "steps_s": ORDER_STEPS.tolist(), "errors": own.tolist(), "against": against.tolist()},
    )


def whole_turn(samples: int) -> Row:
    """Error of the smooth machine at the default step."""
    reference = reference_records([cases.smooth()], cases.OPERATING_POINT, samples=samples)
    error = float(relative_rms(accelerations([cases.smooth()], samples), reference)[0])
    return Row(
        f"relative rms error of φ̈, default step, smooth machine, {samples / 1000:g} s, against the reference",
        "≤ 1e-6", number(error), error <= 1e-6, {"error": error},
    )  # fmt: skip


def play() -> Row:
    """Error with play in both joints at the default step."""
    reference = reference_records([cases.with_play()], cases.OPERATING_POINT, samples=cases.HALF_SECOND)
    error = float(relative_rms(accelerations([cases.with_play()], cases.HALF_SECOND), reference)[0])
    return Row(
        "the same with play in both joints (13.6 and 1 mrad), first 0.5 s",
        "≤ 1e-5", number(error), error <= 1e-5, {"error": error},
    )  # fmt: skip


def plain_step(count: int) -> Row:
    """For contrast: the same step without landing on edges, from the peers' own equations."""
    machines = [cases.with_play(), *cases.draws(count)]
    reference = reference_records(machines, cases.OPERATING_POINT, samples=cases.HALF_SECOND)
    p = [peers.parameters(machine, cases.OPERATING_POINT) for machine in machines]
    plain = np.stack([plain_rk4(row, peers.start(row), 1000.0, cases.HALF_SECOND, 4) for row in p])
    errors = relative_rms(plain, reference)
    nominal, median = float(errors[0]), float(np.median(errors[1:]))
    return Row(
        "for contrast: plain fixed step of 0.25 ms, edges ignored",
        "", f"{number(nominal)} (median of {count} draws {number(median)})", None,
        {"error": nominal, "median_of_draws": median},
    )  # fmt: skip


def spectra(count: int, samples: int) -> list[Row]:
    """Spectra of draws with play, whose records part from each other after a second whatever the step."""
    machines = cases.draws(count)
    reference = reference_records(machines, cases.OPERATING_POINT, samples=samples)
    record, half = (accelerations(machines, samples, step=step) for step in (None, 0.25e-3))
    psd = Psd()
    densities = [psd.density(values, 1000.0) for values in (record, reference, half)]
    difference = level_difference(densities[0], densities[1])
    yardstick = level_difference(densities[2], densities[1])
    mean, spread = float(difference.mean()), float(np.abs(difference).mean())
    standard_error = float(difference.mean(axis=1).std(ddof=1) / math.sqrt(count))
    own, own_spread = float(yardstick.mean()), float(np.abs(yardstick).mean())
    errors = relative_rms(record, reference)
    return [
        Row(
            f"mean difference of the 1-Hz PSD, 0–100 Hz, {samples / 1000:g} s, {count} draws (±10 % on k and r, "
            f"seeds ({cases.DRAW_SEED}, 0 … {count - 1}))",
            "≤ 0.05 dB",
            f"{mean:+.3f} ± {standard_error:.3f} dB (mean magnitude bin by bin {spread:.3f} dB)",
            abs(mean) <= 0.05,
            {
                "mean_db": mean, "standard_error_db": standard_error, "mean_magnitude_db": spread,
                "relative_rms_median": float(np.median(errors)), "relative_rms_largest": float(errors.max()),
            },
        ),
        Row(
            "for comparison: the same at steps of 0.25 ms", "",
            f"{own:+.3f} dB (mean magnitude {own_spread:.3f} dB)", None,
            {"mean_db": own, "mean_magnitude_db": own_spread},
        ),
    ]  # fmt: skip


def energy() -> Row:
    """Energy of the undamped, undriven 3-DOF model over two seconds, at the default step."""
    run = Run(samples=2001, warmup_turns=0, channels=ENERGY_CHANNELS)
    machine = cases.free()
    channels = simulate(machine, OperatingPoint(load_torque=0.0), run).channels
    if np.any(channels["region_1"] != 0.0):
        raise ArithmeticError("joint 1 met its flanks, so the model was not undriven.")
    total, cam = energies(machine, channels)
    drift = float(np.abs(total - total[0]).max())
    share, of_exchanged = drift / float(total[0]), drift / float(np.ptp(total - cam))
    return Row(
        "energy kept by the undamped, undriven 3-DOF model over 2 s, relative",
        "≤ 1e-8",
        f"{number(share)} of all, {number(of_exchanged)} of what cam and table exchange",
        of_exchanged <= 1e-8,
        {"of_total": share, "of_exchanged": of_exchanged},
    )
