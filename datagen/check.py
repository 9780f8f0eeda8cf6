"""`indexer check FOLDER_OR_URL`: assert every line of DATA.md and the checksums, and name what is at fault.

Shards are read one after the other, so memory stays that of one. Exit codes: 0 sound, 1 faults found, 2 no data set.
"""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

from datagen.audit.again import Again
from datagen.audit.files import folder_faults, manifest_faults, rejected_faults, shard_faults
from datagen.audit.rebuild import rebuild_faults
from datagen.audit.records import record_faults
from datagen.audit.together import Together
from datagen.audit.values import value_faults
from datagen.audit.words import Faults
from datagen.progress import progress
from datagen.schema import SAMPLED
from datagen.shard import open_shard, read_manifest
from indexer_cli.command import DIFFERENT, hydra_command
from indexer_cli.job_paths import place_given
from indexer_cli.places import Place, open_place
from indexer_env.checks import check_integer
from indexer_env.errors import SignalError


@dataclass
class Verdict:
    """What a check found.

    Attributes
    ----------
    records : int
        Rows that were looked at.
    remade : int
        Rows that were made again.
    faults : list of str
        One sentence each; empty for a sound data set.
    notes : list of str
        What could not be looked at, and why.
    """

    records: int = 0
    remade: int = 0
    faults: list[str] = field(default_factory=list)
    notes: list[str] = field(default_factory=list)


def check(folder: str | Path | Place, remake: int = 8, seed: int = 0) -> Verdict:
    """Check a data set against datagen/DATA.md.

    Parameters
    ----------
    folder : path or URL
        The data set.
    remake : int
        Simulated rows to make again, at most.
    seed : int
        Which rows these are.

    Raises
    ------
    ParameterError
        `remake` or `seed` is no whole number >= 0.
    SignalError
        `folder` holds no data set of this schema version.
    """
    check_integer("check", "remake", remake, low=0)
    check_integer("check", "seed", seed, low=0)
    place = open_place(folder)
    manifest = read_manifest(place)
    verdict = Verdict(faults=list(manifest_faults(manifest)))
    if verdict.faults:
        return verdict
    verdict.faults += folder_faults(place, manifest)
    rejected, found = rejected_faults(place)
    verdict.faults += found
    together = Together(manifest)
    again = Again(sum(entry["rows"] for entry in manifest["shards"]), remake, seed)
    whole = True
    with progress("checking", manifest["records"], "records") as advance:
        for entry in manifest["shards"]:
            try:
                unread = list(shard_faults(place, entry))
                found = [] if unread else list(_rows_faults(place, entry, together, again))
            except SignalError as error:
                unread, found = [f"{entry['name']}: {error}"], []
            whole &= not unread
            verdict.records += 0 if unread else entry["rows"]
            verdict.faults += unread + found
            advance(entry["rows"])
        if remake:
            advance.now("making rows again")
        verdict.faults += again.faults()
    # Of a data set with shards that could not be read, nothing is known as a whole.
    verdict.faults += together.faults(rejected) if whole else []
    verdict.remade, verdict.notes = again.remade, again.notes
    return verdict


def _rows_faults(place: Place, entry: dict[str, Any], together: Together, again: Again) -> Faults:
    """Faults of the rows of a shard, a row group at a time."""
    name, ends = entry["name"], []
    with open_shard(place, name) as file:
        for group in range(file.num_row_groups):
            table = file.read_row_group(group)
            items = table.column("item").to_numpy()
            plain = table.drop_columns(list(SAMPLED))
            yield from value_faults(name, plain, items)
            yield from record_faults(name, table, items)
            yield from rebuild_faults(name, plain)
            yield from together.add(name, table, items)
            again.take(name, table)
            ends += [int(items[0]), int(items[-1])] if len(items) else []
    for key, found in (("first_item", ends[0]), ("last_item", ends[-1])) if ends else ():
        if entry[key] != found:
            yield f"manifest.json: {key} of {name} must be {found}, as the file holds, got {entry[key]}."


@hydra_command("check", positional="data")
def main(config: dict[str, Any]) -> None:
    """Check a data set and say what is at fault."""
    verdict = check(place_given("check", "data", config["data"]), config["remake"], config["seed"])
    for line in (*verdict.faults, *verdict.notes):
        print(line)
    count = len(verdict.faults)
    found = "sound" if not count else "1 fault" if count == 1 else f"{count} faults"
    print(f"{config['data']}: {found}; {verdict.records} records checked, {verdict.remade} made again")
    if count:
        raise SystemExit(DIFFERENT)


if __name__ == "__main__":
    main()
