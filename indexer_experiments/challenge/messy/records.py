"""The measured files of a messy case: CSV records and `records.yaml` with what was stated of them, right or wrong."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pyarrow as pa
import pyarrow.csv

from indexer_env.operating_point import OperatingPoint
from indexer_env.units import RPM
from indexer_experiments.challenge.messy.draw import RecordDraw
from indexer_experiments.challenge.messy.sizes import MessyCase, read_of
from indexer_experiments.challenge.running import lead_of
from indexer_experiments.challenge.truth import run, seen

PULSE = 0.002
"""rad; standard deviation of the cam angle that is stated for the first sample."""

_HEADROOM = 1.1
"""Range of the quantiser over the largest reading of the case."""


def write_messy(case: MessyCase, folder: Path) -> None:
    """Simulate the records of a case and write their files."""
    import yaml

    rng = np.random.default_rng(case.drawn.seeds[1])
    made = [true_record(case, record) for record in case.drawn.records]
    noisy = [clean + correlated(len(clean), case.noise, case.drawn.correlation, rng) for clean, _ in made]
    step = 2.0 * _HEADROOM * max(float(np.abs(y).max()) for y in noisy) / 2**case.drawn.bits
    rows = []
    for number, (record, values, (_, point)) in enumerate(zip(case.drawn.records, noisy, made, strict=True)):
        name = f"record_{number}.csv"
        time = np.arange(len(values)) / case.drawn.rate
        columns = {"time [s]": time, "table_acceleration [rad/s^2]": step * np.rint(values / step)}
        pyarrow.csv.write_csv(pa.table(columns), folder / name)
        rows.append({
            "file": name, "motor_speed_rpm": point.motor_speed / RPM, "load_torque": record.stated_load,
            "start_angle": point.start_angle + PULSE * rng.standard_normal(), "start_uncertainty": PULSE,
            "held_out": record.held_out,
        })  # fmt: skip
    (folder / "records.yaml").write_text(yaml.safe_dump(rows, sort_keys=False), encoding="utf-8")


def true_record(case: MessyCase, record: RecordDraw) -> tuple[np.ndarray, OperatingPoint]:
    """The reading without noise [rad/s²], at the times at which the clock that is off takes it, and the operating point
    as a tachometer and a once-per-turn pulse show it."""
    rate = case.drawn.rate / (1.0 + case.drawn.clock)
    samples = record.samples(case.machine, case.drawn.rate)
    sensor = dataclasses.replace(case.sensor, hum_phase=record.hum_phase)
    lead = lead_of(sensor, case.machine, record.point, rate)
    whole = run(case.machine, record.point, samples, rate, case.unlisted(record), lead=lead)
    motion = whole[:, lead:]
    reading = read_of(motion, case.readers(record), sensor, rate, before=whole[:, :lead])
    return reading, seen(case.machine, record.point, motion, rate)


def correlated(samples: int, spread: float, correlation: float, rng: np.random.Generator) -> np.ndarray:
    """e_k = ρ e_{k-1} + √(1 - ρ²) w_k, w white, of this standard deviation from the first sample on (samples,)."""
    from scipy.signal import lfilter

    white = rng.standard_normal(samples)
    white[1:] *= np.sqrt(1.0 - correlation**2)
    return spread * np.asarray(lfilter([1.0], [1.0, -correlation], white))
