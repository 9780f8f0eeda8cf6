"""The study from the command line: ``indexer study out=DIR ['claims=[fig4,fig5]'] [size=quick]``."""

from __future__ import annotations

import logging
from typing import Any

import torch
from rich.table import Table

from indexer_cli.command import hydra_command
from indexer_cli.job_paths import job_folder
from indexer_cli.words import plain_console
from indexer_env.build import from_mapping
from indexer_env.checks import check_integer
from indexer_experiments.study.claims import CLAIMS, chosen
from indexer_experiments.study.lab import Lab, Size
from indexer_experiments.study.report import write_report
from indexer_experiments.study.verdicts import deciding
from indexer_experiments.study.work import done, open_study, work_on


@hydra_command("study")
def main(config: dict[str, Any]) -> None:
    """Work on the chosen claims that have not been done, then write the report of all that have been."""
    claims = chosen(config["claims"])
    size = from_mapping(Size, config["size"], owner="size")
    check_integer("study", "seed", config["seed"], low=0, high=2**31 - 1)
    check_integer("study", "threads", config["threads"], low=1)
    lab = Lab(size, config["seed"], job_folder("study", config["out"]))
    torch.set_num_threads(config["threads"])
    open_study(lab)
    # A line for each of a hundred data sets would say less than the claims' own.
    logging.getLogger("datagen").setLevel(logging.WARNING)
    console = plain_console()
    found = {claim.key: finding for claim in CLAIMS.values() if (finding := done(claim, lab)) is not None}
    for claim in claims:
        if claim.key not in found:
            console.print(f"{claim.where}: {claim.title} …")
            found[claim.key] = work_on(claim, lab)
    # Told in the order of the paper, those of earlier runs among them.
    findings = [found[key] for key in CLAIMS if key in found]
    report = write_report(lab, findings)
    table = Table("claim", "where", "the paper", "here", "verdict")
    for finding in findings:
        line = deciding(finding.main)
        table.add_row(finding.claim.title, finding.claim.where, line.paper, line.found, str(finding.verdict))
    console.print(table)
    console.print(f"report: {report}")


if __name__ == "__main__":
    main()
