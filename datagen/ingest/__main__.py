"""`indexer ingest measured=FOLDER out=FOLDER period=SECONDS`: measured files -> a data set."""

from __future__ import annotations

from typing import Any

import pyarrow.parquet as pq
from rich.table import Table

from datagen.ingest.publish import ingest
from datagen.ingest.settings import PLACES, settings_from
from datagen.ingest.sources import COLUMNS, sources_of
from datagen.store import REJECTED
from indexer_cli.command import check_flag, hydra_command
from indexer_cli.job_paths import job_folder, path_given
from indexer_cli.words import counted, plain_console
from indexer_env.checks import closest

_SHOWN = 3
"""Reasons of rejection that are told at once."""

_LIKE = 0.8
"""Likeness to a column of its own from which a group's name may be a misspelled one."""


@hydra_command("ingest")
def main(config: dict[str, Any]) -> None:
    """Ingest the files of a composed configuration and say what the data set holds."""
    check_flag("ingest", "overwrite", config["overwrite"])
    folder = job_folder("ingest", config["out"])
    settings = settings_from(config)
    labels = None if config["labels"] is None else path_given("ingest", "labels", config["labels"])
    sources = sources_of(str(path_given("ingest", "measured", config["measured"])), labels)
    kept = {key: value for key, value in config.items() if key not in PLACES}
    manifest = ingest(sources, settings, folder, config=kept, overwrite=config["overwrite"])
    _say(manifest, str(folder))
    groups = sorted({name for source in sources for name in source.groups})
    if groups:
        print(f"groups of the labels table: {', '.join(groups)}")
        for name in groups:
            if meant := closest(name, COLUMNS, _LIKE):
                print(f"  {name} is taken for a group; write {meant!r} if that was meant")
    elif labels is None:
        print("no labels table was given, so the files have no groups")
    else:
        print("the labels table has no groups: no further column that files have in common, such as machine or day")


def _say(manifest: dict[str, Any], folder: str) -> None:
    console = plain_console()
    table = Table(title=counted(manifest["files"], "file"), title_justify="left")
    table.add_column("class")
    table.add_column("turns", justify="right")
    for name, turns in manifest["classes"].items():
        table.add_row(name, str(turns))
    console.print(table)
    console.print(f"each turn is a record of {manifest['duration']:g} s at {manifest['sample_rate']:g} Hz")
    subsets = ", ".join(f"{turns} {name}" for name, turns in manifest["subsets"].items())
    console.print(f"{counted(manifest['records'], 'turn')} ({subsets}) in {folder}")
    console.print(f"{counted(manifest['partial_turns'], 'partial turn')} at the ends of the files left out")
    if manifest["rejected"]:
        rejected = counted(manifest["rejected"], "file or turn", "files or turns")
        console.print(f"{rejected} rejected, with reasons in {folder}/{REJECTED}")
        reasons = pq.read_table(f"{folder}/{REJECTED}", columns=["reason"])["reason"].to_pylist()
        for reason in reasons[:_SHOWN]:
            console.print(f"  {reason}")
        if len(reasons) > _SHOWN:
            console.print(f"  and {len(reasons) - _SHOWN} more")


if __name__ == "__main__":
    main()
