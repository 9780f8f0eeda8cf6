"""example.csv: one record as a data logger would write it, drawn apart from the items of the data
set, and example.json, its truth."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from datagen.order import Order
from datagen.produce import produce
from datagen.schema import SAMPLED
from datagen.seeds import Part
from datagen.store import as_json
from indexer_cli.places import Place

DIGITS = 6
"""Significant digits of a sample: a 16-bit logger has under five, so none is lost."""


def write_example(order: Order, place: Place) -> None:
    """Write example.csv and example.json into a data set's folder; nothing, where the example's machine was
    rejected."""
    item = order.campaign.example(order.base, order.seed)
    rows, records, _ = produce(order, [item], noise=Part.EXAMPLE_SENSOR)
    if not rows:
        return
    row, record = rows[0], records[0]
    place.publish("example.csv", record_csv(record, row["sample_rate"], row["unit"]).encode())
    note = "The truth about example.csv; it is drawn apart from the items of the data set."
    place.publish("example.json", as_json({"note": note, **truth_of(row)}))


def truth_of(row: Mapping[str, Any]) -> dict[str, Any]:
    """What a row says of a record that stands by itself: without samples and its place in a data set."""
    return {name: value for name, value in row.items() if name not in ("item", "subset", "machine_draw", *SAMPLED)}


def record_csv(
    record: np.ndarray, sample_rate: float, unit: str, signals: Mapping[str, np.ndarray] | None = None
) -> str:
    """A record (samples,) as a logger would write it: time [s], acceleration in `unit`, and further signals (samples,)
    by the heads of their columns."""
    # Enough decimals to tell neighbouring samples apart a hundredfold: 6 at 1 kHz.
    decimals = max(0, round(np.ceil(np.log10(sample_rate)))) + 3 if sample_rate > 1.0 else 3
    more = signals or {}
    lines = [",".join(["time [s]", f"acceleration [{unit}]", *more])]
    for index, values in enumerate(zip(record, *more.values(), strict=True)):
        lines.append(",".join([f"{index / sample_rate:.{decimals}f}", *(f"{value:.{DIGITS}g}" for value in values)]))
    return "\n".join(lines) + "\n"
