"""What the store holds -> what a view shows."""

from __future__ import annotations

from typing import Any

import numpy as np
from scipy.signal import periodogram

from monitor.analysis.trend import Trend
from monitor.plan import Plan
from monitor.store import Store
from monitor.store.archive import record_of

ORDERS = 320
"""Highest order that the spectrum shows, cycles a turn: 39 Hz at 8.2 s a turn, above the natural frequencies."""

_DRAWN = 2050
"""Samples of a record that are sent: two for each pixel of a wide screen."""


def trends(store: Store, machine: str, plan: Plan) -> dict[str, Any] | None:
    """Every trend of a machine: mode -> quantity -> time [s], value and the ends of the interval; None: no such one."""
    body, _ = store.machine(machine)
    if body is None:
        return None
    told: dict[str, Any] = {}
    for mode, by_name in body.get("trends", {}).items():
        told[mode] = {}
        for name, trend in by_name.items():
            columns = Trend(plan.window, trend).history.T.tolist()
            told[mode][name] = dict(zip(("time", "value", "low", "high"), columns, strict=True))
    return {"machine": machine, "modes": told, "limits": limits(plan)}


def limits(plan: Plan) -> dict[str, list[float]]:
    """Limits of each quantity: alert, alarm, danger."""
    return {name: [one.alert, one.alarm, one.danger] for name, one in plan.limits.items()}


def turn(store: Store, machine: str, number: int) -> dict[str, Any] | None:
    """A turn with its record over the healthy one, and both spectra by order; None: no such one."""
    told = store.turn(machine, number)
    if told is None:
        return None
    found = record_of(store, machine, number)
    told["record"] = None
    if found is None:
        return told
    record, rate, unit = found
    told |= {"unit": unit, "record": _curve(record, rate), "spectrum": _spectrum(record)}
    reference = store.reference(machine, told["mode"], number)
    healthy = None if reference is None else record_of(store, machine, reference)
    if healthy is not None and reference is not None and healthy[0].size == record.size:
        aligned = _aligned(healthy[0], record)
        told["reference"] = {
            "number": reference,
            "record": _curve(aligned, rate),
            "spectrum": _spectrum(aligned),
        }
    return told


def _curve(record: np.ndarray, rate: float) -> dict[str, Any]:
    """Every k-th sample, so that a page gets no more than it can draw."""
    step = max(1, -(-record.size // _DRAWN))
    return {"step_s": step / rate, "values": [round(float(value), 4) for value in record[::step]]}


def _spectrum(record: np.ndarray) -> dict[str, Any]:
    """Amplitude by order, cycles a turn: the record is one turn, however long it took."""
    order, power = periodogram(record - record.mean(), record.size, scaling="spectrum")
    shown = (order > 0.5) & (order <= ORDERS)
    amplitude = np.sqrt(2.0 * np.maximum(power[shown], 1e-14))
    return {"order": np.round(order[shown], 3).tolist(), "amplitude": [float(f"{one:.4g}") for one in amplitude]}


def _aligned(healthy: np.ndarray, record: np.ndarray) -> np.ndarray:
    """The healthy turn shifted round to where it fits the record best: without a pulse turns begin anywhere."""
    product = np.fft.irfft(np.fft.rfft(record) * np.conj(np.fft.rfft(healthy)), record.size)
    return np.roll(healthy, int(np.argmax(product)))
