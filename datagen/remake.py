"""Make a row's record again from its own columns, bit for bit.

`indexer remake FOLDER item=N [out=FILE.parquet]` does so with one item or several (`item=[3,17]`) and says
where the records differ. Exit codes: 0 all equal, 1 one differs, 2 bad input.
"""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from datagen.rows import remade, version_columns
from datagen.schema import RECORD
from datagen.seeds import Part, stream
from datagen.shard import parquet_bytes, read_rows, to_table
from indexer_cli.command import DIFFERENT, hydra_command
from indexer_cli.job_paths import path_given, place_given
from indexer_cli.places import open_place
from indexer_env.checks import check_integer
from indexer_env.errors import SignalError, refuse
from indexer_env.simulate import simulate


def remake(row: Mapping[str, Any]) -> np.ndarray:
    """Simulate and sense the record of a row anew.

    Parameters
    ----------
    row : mapping
        The columns of `datagen.schema`, e.g. `Records.row(index)`; its record is not looked at.

    Returns
    -------
    numpy.ndarray, shape (samples,), float32
        Equal to the row's record in every bit when the versions named in the row made it, on the same kind of
        processor.

    Raises
    ------
    SignalError
        The row is measured.
    """
    if row["kind"] != "simulated":
        raise SignalError(
            f"item {row['item']} must be simulated to be made again, got a measured one ({row['source']})."
        )
    made = remade(row)
    trajectory = simulate(made.machine, made.operating_point, made.run)
    noise = stream(made.seed, Part.SENSOR, made.item)
    signal = made.sensor.read(trajectory.table_acceleration, trajectory.sample_rate, noise)
    return signal.values.astype(np.float32)


def difference(made: np.ndarray, record: np.ndarray) -> str:
    """Where a row's record differs from the one made again, in words; empty where every bit is equal."""
    if made.shape != record.shape:
        return f"{len(record)} samples instead of {len(made)}"
    apart = np.flatnonzero(made.view(np.uint32) != record.view(np.uint32))
    if not len(apart):
        return ""
    first, most = apart[0], np.abs(made.astype(float) - record)[apart].max()
    values = f"{record[first]:.9g} instead of {made[first]:.9g}"
    return f"{len(apart)} of {len(made)} samples apart, first sample {first} ({values}), by {most:.3g} at most"


def other_versions(row: Mapping[str, Any]) -> str:
    """The versions that made a row where they are not those installed here, in words; empty where all are."""
    here = version_columns()
    return ", ".join(
        f"{name.removesuffix('_version')} {row[name]} (here {here[name]})" for name in here if row[name] != here[name]
    )


@hydra_command("remake", positional="data")
def main(config: dict[str, Any]) -> None:
    """Make the items asked for again and say for each whether it is the same."""
    items = config["item"] if isinstance(config["item"], list) else [config["item"]]
    for item in items:
        check_integer("remake", "item", item, low=0)
    out = None if config["out"] is None else path_given("remake", "out", config["out"])
    if out is not None and (out.suffix != ".parquet" or out.exists()):
        raise refuse("remake", "out", "a new file that ends in .parquet", str(out))
    rows = read_rows(place_given("remake", "data", config["data"]), items)
    records = [remake(row) for row in rows]
    if out is not None:
        _write(out, rows, records)
    if any([_said(row, record) for row, record in zip(rows, records, strict=True)]):
        raise SystemExit(DIFFERENT)


def _said(row: Mapping[str, Any], made: np.ndarray) -> bool:
    """Say how a row's record compares with the one made again; True where they differ."""
    apart, versions = difference(made, np.asarray(row[RECORD], dtype=np.float32)), other_versions(row)
    note = f"; made by {versions}" if versions else ""
    print(f"item {row['item']}: {apart or f'equal in every bit of its {len(made)} samples'}{note}")
    return bool(apart)


def _write(out: Path, rows: list[dict[str, Any]], records: list[np.ndarray]) -> None:
    if len({len(record) for record in records}) > 1:
        raise refuse("remake", "item", "items of one record length where they go to one file", len(rows))
    open_place(out.parent).publish(out.name, parquet_bytes(to_table(rows, np.stack(records))))


if __name__ == "__main__":
    main()
