"""The study from the command line: ``python -m classifier.study out=DIR ['claims=[fig4,fig5]'] [size=quick]``."""

from __future__ import annotations

from typing import Any

import torch
from rich.console import Console
from rich.table import Table

from classifier.study.claims import CLAIMS, chosen
from classifier.study.lab import Lab, Size
from classifier.study.report import write_report
from classifier.study.work import findings, open_study, stored, work_on
from datagen.command import hydra_command
from datagen.job_paths import job_folder
from indexer_env.build import from_mapping
from indexer_env.checks import check_integer


@hydra_command("study")
def main(config: dict[str, Any]) -> None:
    """Work on the chosen claims that have not been done, then write the report of all that have."""
    claims = chosen(config["claims"])
    size = from_mapping(Size, config["size"], owner="size")
    check_integer("study", "seed", config["seed"], low=0, high=2**31 - 1)
    check_integer("study", "threads", config["threads"], low=1)
    lab = Lab(size, config["seed"], job_folder("study", config["out"]))
    torch.set_num_threads(config["threads"])
    open_study(lab)
    console = Console(highlight=False, soft_wrap=True)
    for claim in claims:
        finding = stored(claim, lab.folder)
        if finding is None:
            console.print(f"{claim.where}: {claim.title} …")
            finding = work_on(claim, lab)
            write_report(lab)
        else:
            console.print(f"{claim.where}: done before")
    report = write_report(lab)
    table = Table("claim", "where", "verdict")
    for key, finding in findings(CLAIMS.values(), lab.folder).items():
        table.add_row(CLAIMS[key].title, CLAIMS[key].where, str(finding.verdict))
    console.print(table)
    console.print(f"report: {report}")


if __name__ == "__main__":
    main()
