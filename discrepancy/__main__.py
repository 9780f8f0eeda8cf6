"""The chain from the command line: ``indexer explain measured=FILES machine=YAML out=DIR``."""

from __future__ import annotations

import time
from typing import Any

from discrepancy.chain import STAGES, run_chain
from discrepancy.criteria import Criteria
from discrepancy.stages import stages
from discrepancy.subjects.base import Subject
from indexer_cli.command import check_flag, hydra_command
from indexer_cli.job_paths import job_folder
from indexer_cli.output_folder import check_output_folder, output_folder
from indexer_cli.words import plain_console
from indexer_env.checks import check_integer
from indexer_env.errors import refuse

FILES = ("report.json", "report.html", "machine.yaml", "sensor.yaml", "with_table.yaml")
"""All that the command leaves in its folder."""

_CHECK, _WRITE = "read and check the records", "write the report"


def _subject(config: dict[str, Any]) -> Subject:
    system = config["system"]
    if isinstance(system, str) and system.endswith(".py"):
        from discrepancy.drives.door import drive_subject

        return drive_subject(config)
    if system != "indexer":
        rule = "indexer, or a Python file that describes a drive"
        raise refuse("discrepancy", "system", rule, system, "docs/how-to/own_drive.md shows one")
    from discrepancy.subjects.from_config import indexer_subject

    return indexer_subject(config)


def run(config: dict[str, Any]) -> None:
    """The command, given its configuration as in conf/explain.yaml."""
    started = time.perf_counter()
    check_flag("discrepancy", "overwrite", config["overwrite"])
    check_integer("discrepancy", "seed", config["seed"], low=0)
    criteria = Criteria(seconds=config["seconds"], tolerance=config["tolerance"])
    out = check_output_folder(job_folder("discrepancy", config["out"]), FILES, config["overwrite"])
    with stages((_CHECK, *STAGES, _WRITE)) as begin:
        begin(_CHECK)
        subject = _subject(config)
        outcome = run_chain(subject, config["seed"], begin, criteria)
        begin(_WRITE)
        # Drawing is loaded only now: a record that is refused is refused sooner.
        from discrepancy.report import headline, plain, report_files, to_do

        with output_folder(out, FILES, config["overwrite"]) as folder:
            for name, text in report_files(outcome).items():
                (folder / name).write_text(text, encoding="utf-8")
    console = plain_console()
    first = f"{outcome.answer.verdict}: {headline(outcome)}"
    left = () if outcome.left is None else outcome.left.sentences
    told = *left, *outcome.of_records, *outcome.answer.written.remarks
    rest = *told, f"Next: {to_do(outcome)}", *outcome.failures, *subject.notes
    last = f"written {out} in {time.perf_counter() - started:.0f} s"
    for line in (first, *(f"  {sentence}" for sentence in rest), last):
        console.print(plain(line, console.encoding))


main = hydra_command("explain")(run)

if __name__ == "__main__":
    main()
