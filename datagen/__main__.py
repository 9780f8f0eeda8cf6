"""`python -m datagen campaign=table2 out=FOLDER`: generate a data set."""

from __future__ import annotations

from typing import Any

from rich.console import Console
from rich.table import Table

from datagen.command import hydra_command, job_folder
from datagen.generate import generate
from datagen.order import order_from
from datagen.store import REJECTED
from indexer_env.errors import refuse


@hydra_command("datagen")
def main(config: dict[str, Any]) -> None:
    """Generate the data set of a composed configuration and say what it holds."""
    overwrite = config["overwrite"]
    if not isinstance(overwrite, bool):
        raise refuse("datagen", "overwrite", "true or false", overwrite)
    folder = job_folder(config["out"])
    manifest = generate(order_from(config), folder, overwrite=overwrite)
    _say(manifest, str(folder))


def _say(manifest: dict[str, Any], folder: str) -> None:
    console = Console(highlight=False, soft_wrap=True)
    table = Table(title=f"{manifest['campaign']}, seed {manifest['seed']}", title_justify="left")
    table.add_column("class")
    table.add_column("records", justify="right")
    for name, records in manifest["classes"].items():
        table.add_row(name, str(records))
    console.print(table)
    subsets = ", ".join(f"{records} {name}" for name, records in manifest["subsets"].items())
    console.print(f"{manifest['records']} records ({subsets}) in {folder}")
    if manifest["not_settled"]:
        console.print(f"{manifest['not_settled']} of them not settled after the warm-up (column warmup_settled)")
    if manifest["rejected"]:
        console.print(f"{manifest['rejected']} items rejected, with reasons in {folder}/{REJECTED}")


if __name__ == "__main__":
    main()
