"""`indexer challenge count=… seed=… out=FOLDER`: hide effects, search for them, score the answers."""

from __future__ import annotations

from typing import Any

from indexer_cli.command import hydra_command
from indexer_cli.job_paths import job_folder
from indexer_cli.words import plain_console
from indexer_experiments.challenge.plan import orders
from indexer_experiments.challenge.run import run_challenge


@hydra_command("challenge")
def main(config: dict[str, Any]) -> None:
    """Run the challenge of a composed configuration and print its tables."""
    folder = job_folder("challenge", config["out"])
    table = run_challenge(orders(config), folder, config["executor"], config["processes"], config["address"])
    console = plain_console()
    console.print(table, markup=False)
    console.print(f"Cases, table.md and cases.parquet are in {folder}", markup=False)


if __name__ == "__main__":
    main()
