"""A data set as a folder for the Hugging Face Hub, with a split for each subset.

`indexer publish DATA out=FOLDER` copies the rows, one file for each shard and subset, so that the splits calibration,
control and validation are there without a word of code: `datasets.load_dataset("FOLDER")`.
"""

from __future__ import annotations

import hashlib
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.compute as pc

from datagen.campaign import SUBSETS
from datagen.card import PublishedFiles, write_card
from datagen.shard import iterate_shards, parquet_bytes, read_manifest
from datagen.store import CARD, CROISSANT, PICTURES, REJECTED, RUN, SHARD_FOLDER, read_json
from indexer_cli.command import hydra_command
from indexer_cli.job_paths import job_folder, place_given
from indexer_cli.output_folder import check_output_folder, output_folder
from indexer_cli.places import Place, open_place
from indexer_cli.words import plain_console

FILES = (CROISSANT, CARD, PICTURES, SHARD_FOLDER, REJECTED)
"""What the command leaves."""


def publish(data: Place, out: Path, overwrite: bool = False) -> dict[str, int]:
    """Write a data set into a new folder with a file for each shard and subset, its card and its metadata.

    Parameters
    ----------
    data : Place
        Folder or URL of the data set.
    out : Path
        Folder to be; it appears whole or not at all.
    overwrite : bool
        Whether an earlier result may be replaced.

    Returns
    -------
    dict
        Records of each split; splits without a record are left out.

    Raises
    ------
    SignalError, StoreError, ParameterError
        No data set, a damaged one, or a folder that must not be written.
    """
    manifest = read_manifest(data)
    with output_folder(out, FILES, overwrite) as folder:
        place, entries, records = open_place(folder), [], dict.fromkeys(SUBSETS, 0)
        for number, table in enumerate(iterate_shards(data)):
            for subset in SUBSETS:
                rows = table.filter(pc.equal(table.column("subset"), subset))  # type: ignore[attr-defined]
                if len(rows):
                    entries.append(_file(place, f"{SHARD_FOLDER}/{subset}-{number:05d}.parquet", rows))
                    records[subset] += len(rows)
        if manifest["rejected"]:
            place.publish(REJECTED, data.read(REJECTED) or b"")
        records = {name: count for name, count in records.items() if count}
        files = PublishedFiles(tuple((name, f"{SHARD_FOLDER}/{name}-*.parquet") for name in records))
        write_card(place, {**manifest, "shards": entries}, read_json(data, RUN) or {}, files)
        return records


def _file(place: Place, name: str, rows: pa.Table) -> dict[str, Any]:
    """Write rows as a file; what a manifest says of it."""
    content = parquet_bytes(rows)
    place.publish(name, content)
    return {"name": name, "bytes": len(content), "sha256": hashlib.sha256(content).hexdigest()}


@hydra_command("publish", positional="data")
def main(config: dict[str, Any]) -> dict[str, int]:
    """Write the folder and say what is in it."""
    data = place_given("publish", "data", config["data"])
    out = check_output_folder(job_folder("publish", config["out"]), FILES, config["overwrite"])
    records = publish(open_place(data), out, config["overwrite"])
    plain_console().print(
        f"written {out}: " + ", ".join(f"{count} records in {name}" for name, count in records.items())
    )
    return records


if __name__ == "__main__":
    main()
