"""One record of a machine as configured, as files that anything opens; a command."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from datagen.example import record_csv, truth_of
from datagen.order import Order, order_from
from datagen.produce import produce
from datagen.schema import COLUMNS, RECORD, SAMPLED
from datagen.store import as_json
from indexer_cli.command import hydra_command
from indexer_cli.job_paths import job_folder
from indexer_cli.output_folder import check_output_folder, output_folder
from indexer_cli.words import plain_console
from indexer_env.errors import ParameterError

FILES = ("record.csv", "record.json", "record.png")


def simulate_once(order: Order) -> tuple[dict[str, Any], np.ndarray]:
    """The first item of an order: its row without the record, and the record (samples,) in the row's unit.

    Raises
    ------
    ParameterError
        The machine or its simulation was refused, in the words of the refusal.
    """
    rows, records, rejected = produce(order, [order.campaign.item(0, order.base, order.seed)])
    if rejected:
        raise ParameterError(rejected[0]["reason"])
    return rows[0], records[0]


@hydra_command("simulate")
def main(config: dict[str, Any]) -> dict[str, Any]:
    """Simulate the machine of a composed configuration once and write what its sensor reads."""
    # An order of one item: the machine, its laws and its refusals are read as for a data set.
    order = order_from({**config, "campaign": {"name": "grid"}, "count": 1, "shard_items": 1})
    out = check_output_folder(job_folder("simulate", config["out"]), FILES, config["overwrite"])
    row, record = simulate_once(order)
    _write(row, record, out, config["overwrite"])
    return _say(row, record, out)


def _write(row: dict[str, Any], record: np.ndarray, out: Path, overwrite: bool) -> None:
    # Drawing is loaded only now: its import takes longer than the simulation.
    from datagen.pictures import picture

    signals = {f"{name} [{COLUMNS[name].unit}]": row[name] for name in SAMPLED[1:] if name in row}
    with output_folder(out, FILES, overwrite) as folder:
        (folder / "record.csv").write_text(
            record_csv(record, row["sample_rate"], row["unit"], signals), encoding="utf-8"
        )
        (folder / "record.json").write_bytes(as_json(truth_of(row)))
        heading = f"{row['machine_name']}: {row['class_name']}"
        (folder / "record.png").write_bytes(picture({**row, RECORD: record}, heading))


def _say(row: dict[str, Any], record: np.ndarray, out: Path) -> dict[str, Any]:
    unit, seconds = row["unit"], len(record) / row["sample_rate"]
    rms, peak = float(np.sqrt(np.mean(np.square(record, dtype=float)))), float(np.abs(record).max())
    console = plain_console()
    console.print(f"{row['machine_name']}, {row['class_name']}: {len(record)} samples in {seconds:.4g} s")
    console.print(f"acceleration {rms:.4g} {unit} rms, {peak:.4g} {unit} at most")
    if not row["warmup_settled"]:
        turns = row["warmup_turns"]
        console.print(f"not settled after {turns} turns of warm-up: successive turns differ, as play lets them")
    console.print(f"written {', '.join(str(out / name) for name in FILES)}")
    return {"class": row["class_name"], "rms": rms, "peak": peak, "unit": unit, "settled": row["warmup_settled"]}


if __name__ == "__main__":
    main()
