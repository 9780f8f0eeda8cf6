"""A row's machine, faults, operating point, run and sensor exist and agree with its other columns."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import pyarrow as pa

from datagen.audit.words import Faults
from datagen.order import QUANTITY
from datagen.rows import effects_of_faults, remade
from indexer_env.errors import ParameterError


def rebuild_faults(owner: str, table: pa.Table) -> Faults:
    """Faults of simulated rows (their columns without the record) that describe what cannot be."""
    rows = table.to_pylist()
    found = [(row["item"], fault) for row in rows if row["kind"] == "simulated" and (fault := _fault(row))]
    if found:
        item, fault = found[0]
        more = f", as do {len(found) - 1} more rows after it" if len(found) > 1 else ""
        yield f"{owner}, item {item}: {fault.removesuffix('.')}{more}."


def _fault(row: Mapping[str, Any]) -> str:
    """The first thing in a simulated row that cannot be, as the end of a sentence; empty where there is none."""
    try:
        made, named = remade(row), effects_of_faults(row)
    except ParameterError as error:
        return str(error)
    except (AssertionError, KeyError, TypeError, ValueError) as error:
        return f"its columns must describe a machine, got {type(error).__name__} {error}."
    present = {effect.name for effect in made.machine.effects}
    if named - present:
        return f"effects must hold the row's faults, got none named {min(named - present)}."
    if row["unit"] != made.sensor.unit:
        return f"unit must be {made.sensor.unit}, as its sensor reads, got {row['unit']!r}."
    if row["quantity"] != QUANTITY:
        return f"quantity must be {QUANTITY}, got {row['quantity']!r}."
    if row["warmup_turns"] > row["warmup_limit"]:
        return f"warmup_turns must be at most warmup_limit ({row['warmup_limit']}), got {row['warmup_turns']}."
    difference = row["warmup_difference"]
    if row["warmup_settled"] != (difference is not None and difference <= row["warmup_tolerance"]):
        rule = "true where warmup_difference is at most warmup_tolerance and false elsewhere"
        return f"warmup_settled must be {rule}, got {row['warmup_settled']} with {difference}."
    return ""
