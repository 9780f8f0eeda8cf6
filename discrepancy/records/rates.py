"""Records at one sampling rate, the lowest of them or less, and the noise of each, as it was measured and there."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence

from discrepancy.indexer.reading import of_its_rate
from discrepancy.noise import limited_noise, noise_of, shared_noise
from discrepancy.records.conditions import grouped
from discrepancy.records.reading import Record
from indexer_env.sensors import Sensor
from indexer_env.signal import Signal
from indexer_records.measured import RATE_TOLERANCE
from indexer_records.resample import CUTOFF, entire

Noise = tuple[float, float]
"""Standard deviation and correlation from sample to sample."""

_RATE = 1000.0
"""Sampling rate [Hz] that tells what a machine lacks: its modes lie below 100 Hz."""


def noises(records: Sequence[Record]) -> list[Noise]:
    """The noise of each record as it was measured: of those for which none is stated, that of all of one unit and rate
    together, as one sensor took them. Rates that count as one differ by what their clocks are off."""
    numbers, _ = grouped([record.signal.sample_rate for record in records])
    kinds = [(record.signal.unit, number) for record, number in zip(records, numbers, strict=True)]
    alike: dict[tuple[str, int], list[Signal]] = {}
    for record, kind in zip(records, kinds, strict=True):
        if record.conditions.noise is None:
            alike.setdefault(kind, []).append(record.signal)
    shared = {kind: shared_noise([one.values for one in those], those[0].sample_rate) for kind, those in alike.items()}
    return [
        noise_of(r.signal.values, r.signal.sample_rate) if r.conditions.noise is not None else shared[kind]
        for r, kind in zip(records, kinds, strict=True)
    ]


def at_rate_of_all(record: Record, sensor: Sensor, noise: Noise, lowest: float) -> tuple[Record, Noise]:
    """A record of several whose `lowest` rate [Hz] is given, at that rate, and its noise, which is told above that
    band. Rates that differ by their clocks alone stay, as the clock is fitted.

    Where the lowest is twice `_RATE` or more, all are taken at about `_RATE`, as what moves lies far below half of it;
    not where the sensor has a bracket or a low-pass, which would be others at a lower rate.
    """
    # rates that are one but for their clocks must not be thinned by different factors
    every = 1 if of_its_rate(sensor) else max(1, int(lowest // _RATE))
    signal, rate, least = record.signal, record.signal.sample_rate, lowest / every
    target = rate / every
    if target - least > RATE_TOLERANCE * least:
        target = least
    if target == rate:
        return record, noise
    values = entire(signal.values, rate, target)
    spread, colour = noise
    stated, limit = record.conditions.noise, CUTOFF * target
    estimate = limited_noise(stated or spread, colour, rate, limit, target)
    conditions = record.conditions if stated is None else dataclasses.replace(record.conditions, noise=estimate[0])
    thin = Signal(values, target, unit=signal.unit, source=signal.source)
    return dataclasses.replace(record, signal=thin, conditions=conditions), estimate
