"""The samples of each record, and what other columns say of them."""

from __future__ import annotations

import json

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc

from datagen.audit.words import Faults, rows_at_fault
from datagen.schema import RECORD, SAMPLED
from indexer_records.channels import channels_of
from indexer_records.quality import quality_columns


def record_faults(owner: str, table: pa.Table, items: np.ndarray) -> Faults:
    """Faults of the records of some rows; the table has all columns."""
    column = table.column(RECORD).combine_chunks()
    lengths = pc.list_value_length(column).fill_null(0).to_numpy()  # type: ignore[attr-defined]
    yield from rows_at_fault(owner, items, lengths == 0, "record must hold samples", lambda at: int(lengths[at]))
    channels = np.array([len(channels_of(text)) for text in table.column("source_channel").to_pylist()], dtype=int)
    rule = "record must hold as many samples of each of its channels"
    yield from rows_at_fault(owner, items, lengths % channels != 0, rule, lambda at: int(lengths[at]))
    for length in np.unique(lengths[lengths > 0]):
        places = np.flatnonzero(lengths == length)
        some = column if len(places) == len(column) else column.take(pa.array(places))
        matrix = some.flatten().to_numpy(zero_copy_only=False).reshape(len(places), length)
        yield from _sample_faults(owner, table.take(pa.array(places)), matrix, items[places])
    yield from _length_faults(owner, table, lengths, items)
    yield from _signal_faults(owner, table, lengths, items)


def _signal_faults(owner: str, table: pa.Table, lengths: np.ndarray, items: np.ndarray) -> Faults:
    """A signal of the drive has the samples of its record, all finite, and is there where `drive_sensors` lists it."""
    told = [json.loads(text)["signals"] if text else [] for text in table.column("drive_sensors").to_pylist()]
    for name in SAMPLED[1:]:
        column = table.column(name).combine_chunks()
        listed, there = np.array([name in signals for signals in told]), column.is_valid().to_numpy(False)
        rule = f"{name} must be given where drive_sensors lists it, and null elsewhere"
        yield from rows_at_fault(owner, items, listed != there, rule, lambda at, there=there: bool(there[at]))
        own = pc.list_value_length(column).fill_null(0).to_numpy()  # type: ignore[attr-defined]
        rule = f"{name} must have the samples of its record"
        yield from rows_at_fault(owner, items, there & (own != lengths), rule, lambda at, own=own: int(own[at]))
        rows = np.repeat(np.arange(len(column)), own)
        bad = np.zeros(len(column), bool)
        bad[rows[~np.isfinite(column.flatten().to_numpy(zero_copy_only=False))]] = True
        yield from rows_at_fault(owner, items, bad, f"{name} must hold finite samples", lambda _: "others")


def _sample_faults(owner: str, table: pa.Table, records: np.ndarray, items: np.ndarray) -> Faults:
    # A sum is not finite where a sample is not, and is twenty times as fast as looking at each.
    finite = np.isfinite(records.sum(axis=1, dtype=np.float64))
    rule = "record must hold finite samples"
    yield from rows_at_fault(owner, items, ~finite, rule, lambda at: float(records[at][~np.isfinite(records[at])][0]))
    told = quality_columns(np.where(np.isfinite(records), records, 0.0) if not finite.all() else records)
    # Those of a measured row are of the file's own samples, before any filter: only the file can tell.
    simulated = np.array([kind == "simulated" for kind in table.column("kind").to_pylist()])
    for name in ("clipped_share", "constant_share"):
        true = np.array([columns[name] for columns in told])
        given = table.column(name).to_numpy()
        rule = f"{name} must be that of its record"
        yield from rows_at_fault(
            owner, items, simulated & (given != true), rule, lambda at, given=given: float(given[at])
        )


def _length_faults(owner: str, table: pa.Table, lengths: np.ndarray, items: np.ndarray) -> Faults:
    """A simulated record has the samples and the rate of its simulation, every m-th where the sensor gives fewer."""
    simulated = np.array([kind == "simulated" for kind in table.column("kind").to_pylist()])
    given = _numbers(table, "sample_rate")
    # A rate of 0 or no number at all is a fault of its own and fails here too.
    with np.errstate(divide="ignore", invalid="ignore"):
        every = _numbers(table, "simulation_rate") / given
        whole = np.abs(every - np.round(every)) < 1e-6 * every
        expected = np.ceil(_numbers(table, "simulation_samples") / np.round(every))
    rule = "sample_rate must be simulation_rate over a whole number"
    yield from rows_at_fault(owner, items, simulated & ~whole, rule, lambda at: float(given[at]))
    wrong = simulated & whole & (lengths != expected)
    rule = "record must have the samples of its simulation at its rate"
    yield from rows_at_fault(owner, items, wrong, rule, lambda at: int(lengths[at]))


def _numbers(table: pa.Table, name: str) -> np.ndarray:
    return table.column(name).cast(pa.float64()).to_numpy()
