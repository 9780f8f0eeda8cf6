"""Make a row's record again from its own columns, bit for bit.

`indexer remake FOLDER item=N [out=FILE.parquet]` does so with one item or several (`item=[3,17]`) and says
where the records differ. Exit codes: 0 all equal, 1 one differs, 2 bad input.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from datagen.order import QUANTITY
from datagen.rows import remade, version_columns
from datagen.schema import RECORD
from datagen.seeds import Part, stream
from datagen.shard import parquet_bytes, read_rows, to_table
from indexer_cli.command import DIFFERENT, hydra_command
from indexer_cli.job_paths import path_given, place_given
from indexer_cli.places import open_place
from indexer_env.checks import check_integer
from indexer_env.device import on_host
from indexer_env.errors import SignalError, SimulationError, refuse
from indexer_env.simulate import simulate_batch


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
        processor; those of a GPU need one of the same kind.

    Raises
    ------
    SignalError
        The row is measured.
    """
    return remake_all(row)[RECORD]


def remake_all(row: Mapping[str, Any]) -> dict[str, np.ndarray]:
    """The record and the signals of the drive of a row anew, (samples,) float32 by column. Raises as `remake`."""
    if row["kind"] != "simulated":
        raise SignalError(
            f"item {row['item']} must be simulated to be made again, got a measured one ({row['source']})."
        )
    made = remade(row)
    run = dataclasses.replace(made.run, channels=(QUANTITY, *made.drive_sensors.channels))
    batch = simulate_batch([made.machine], made.operating_point, run, device=made.device)
    if batch.rejected:
        raise SimulationError(batch.rejected[0])
    channels = {name: on_host(values)[0] for name, values in batch.channels.items()}
    noise, of_drive = (stream(made.seed, part, made.item) for part in (Part.SENSOR, Part.DRIVE))
    signal = made.sensor.read(channels[QUANTITY], batch.sample_rate, noise)
    drive = made.drive_sensors.read(made.machine, channels, batch.sample_rate, of_drive)
    return {RECORD: signal.values.astype(np.float32), **drive}


def differences(made: Mapping[str, np.ndarray], row: Mapping[str, Any]) -> str:
    """Where a row differs from what `remake_all` gives of it, in words; empty where every bit is equal."""
    for name, samples in made.items():
        given = np.asarray([] if row[name] is None else row[name], dtype=np.float32)
        if apart := difference(samples, given):
            return apart if name == RECORD else f"{name} with {apart}"
    return ""


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
    made = [remake_all(row) for row in rows]
    if out is not None:
        _write(out, rows, made)
    if any([_said(row, samples) for row, samples in zip(rows, made, strict=True)]):
        raise SystemExit(DIFFERENT)


def _said(row: Mapping[str, Any], made: Mapping[str, np.ndarray]) -> bool:
    """Say how a row compares with what was made again; True where they differ."""
    apart, versions = differences(made, row), other_versions(row)
    note = f"; made by {versions}" if versions else ""
    print(f"item {row['item']}: {apart or f'equal in every bit of its {len(made[RECORD])} samples'}{note}")
    return bool(apart)


def _write(out: Path, rows: list[dict[str, Any]], made: list[dict[str, np.ndarray]]) -> None:
    if len({len(samples[RECORD]) for samples in made}) > 1:
        raise refuse("remake", "item", "items of one record length where they go to one file", len(rows))
    again = [{**row, **samples} for row, samples in zip(rows, made, strict=True)]
    records = np.stack([samples[RECORD] for samples in made])
    open_place(out.parent).publish(out.name, parquet_bytes(to_table(again, records)))


if __name__ == "__main__":
    main()
