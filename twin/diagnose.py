"""A diagnosis from the command line: ``indexer twin-diagnose twin=DIR signal=FILES``."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Sequence
from typing import Any

from discrepancy.records.reading import Record, read_records
from indexer_cli.command import BAD_INPUT, check_flag, hydra_command
from indexer_cli.job_paths import files_given, job_folder, path_given
from indexer_cli.json_values import finite
from indexer_cli.output_folder import check_output_folder, output_folder
from indexer_cli.words import plain_console
from indexer_env.build import from_mapping
from indexer_env.errors import IndexerError
from indexer_records.conditions import Pulse
from twin.__main__ import in_words
from twin.answer import Answer, answer_of
from twin.diagnosis import NOT_COMPARABLE, TurnDiagnosis, together
from twin.physics import Physics
from twin.report.answer import answer_page
from twin.twin import Twin

FILES = ("answer.json", "answer.html")


def diagnosed(
    twin: Twin, records: Sequence[Record], *, physics: bool
) -> tuple[Answer, list[tuple[str, TurnDiagnosis]]]:
    """One answer for records of the same machine in the same state, and what the networks say of each."""
    each = [(one.name, twin.diagnose_turn(one.signal, one.conditions, one.pulses)) for one in records]
    comparable = [one for _, one in each if one.verdict != NOT_COMPARABLE]
    network = together(comparable) if comparable else each[0][1]
    found: Physics | None = None
    remarks, why = (), "" if comparable else "No record can be compared."
    if physics and comparable:
        try:
            found = twin.explain([
                (record.signal, record.conditions, record.pulses)
                for record, (_, one) in zip(records, each, strict=True)
                if one.verdict != NOT_COMPARABLE
            ], network.suspected)  # fmt: skip
        except IndexerError as error:
            why = str(error)
            remarks = (f"Physics was left out: {why}",)
    answer = answer_of(network, found, twin.machine, twin.matters, twin.faults)
    left = tuple(f"{name} was left out: {one.reason}" for name, one in each if one.verdict == NOT_COMPARABLE)
    left = left if comparable else ()
    notes = tuple(f"{note}." for _, one in each for note in one.notes)
    said = (*answer.remarks, *_dissent(network, each), *remarks, *left, *notes)
    return dataclasses.replace(answer, remarks=said, no_physics=why), each


def _dissent(network: TurnDiagnosis, each: Sequence[tuple[str, TurnDiagnosis]]) -> tuple[str, ...]:
    """Records that the networks judge otherwise than all of them together."""
    others = [(name, one) for name, one in each if one.verdict not in (network.verdict, NOT_COMPARABLE)]
    return tuple(f"{name} by itself is {one.verdict}: {one.reason}." for name, one in others)


def run(config: dict[str, Any]) -> dict[str, Any]:
    """The command, given its configuration as in conf/twin-diagnose.yaml."""
    check_flag("twin", "physics", config["physics"])
    check_flag("twin", "overwrite", config["overwrite"])
    out = None
    if config["out"] is not None:
        out = check_output_folder(job_folder("twin", config["out"]), FILES, config["overwrite"])
    twin = Twin.load(path_given("twin", "twin", config["twin"]))
    answer, each = diagnosed(twin, records_of(config, "signal"), physics=config["physics"])
    console = plain_console()
    if not twin.about["check"]["trusted"]:
        console.print(f"Caution: {twin.about['check']['reason']}")
    for sentence in (answer.headline, *answer.remarks):
        console.print(sentence)
    if out is not None:
        content = {"answer": answer.plain(), "records": {name: dataclasses.asdict(one) for name, one in each}}
        with output_folder(out, FILES, config["overwrite"]) as folder:
            text = json.dumps(finite(content), indent=1, ensure_ascii=False, default=float)
            (folder / FILES[0]).write_text(text, encoding="utf-8")
            (folder / FILES[1]).write_text(answer_page(answer, each, twin), encoding="utf-8")
        console.print(f"written {out}")
    if answer.verdict == NOT_COMPARABLE:
        raise SystemExit(BAD_INPUT)
    return {"verdict": answer.verdict}


def records_of(config: dict[str, Any], key: str) -> list[Record]:
    """The records that a key of a configuration names."""
    table = None if config["records"] is None else path_given("twin", "records", config["records"])
    files = files_given("twin", key, config[key])
    pulse = from_mapping(Pulse, config["pulse"], "pulse")
    try:
        return read_records(files, table, config["known"], pulse, [])
    except IndexerError as error:
        raise type(error)(in_words(str(error), key)) from None


main = hydra_command("twin-diagnose")(run)

if __name__ == "__main__":
    main()
