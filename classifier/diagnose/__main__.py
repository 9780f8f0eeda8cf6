"""Diagnosis of measured records: ``indexer diagnose model=DIR measured=FILE out=DIR``.

Exit codes are those of `indexer_cli.command`; 1 where no part of the model tells a record unlike all that was taught.
"""

from __future__ import annotations

import itertools
import json
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pyarrow as pa
from pyarrow.csv import write_csv

from classifier.diagnose.report import COLUMN, CaseReport, line, lines, summary, summary_lines
from classifier.diagnose.signals import Asked, Case, cases_of
from classifier.model import Model, load_model
from indexer_cli.command import DIFFERENT, check_flag, hydra_command
from indexer_cli.job_paths import job_folder, path_given
from indexer_cli.output_folder import check_output_folder, output_folder
from indexer_env.build import from_mapping
from indexer_env.checks import check_integer
from indexer_env.errors import SignalError
from indexer_records.conditions import Pulse, RecordConditions
from indexer_records.measured import Reading

SUMMARY = "diagnosis.json"
TURNS = "turns.csv"
ENDINGS = (".diagnosis.json", ".diagnosis.png")
FILES = (SUMMARY, TURNS, *(f"*{ending}" for ending in ENDINGS))
"""All that the command leaves in its folder, as patterns."""

_LINES = 100
"""Signals told in a line each; of further ones the files tell."""


def run(config: dict[str, Any]) -> None:
    """The command, given its configuration as in conf/diagnose.yaml."""
    check_flag("diagnose", "overwrite", config["overwrite"])
    check_integer("diagnose", "pictures", config["pictures"], low=0)
    out = None if config["out"] is None else job_folder("diagnose", config["out"])
    if out is not None:
        check_output_folder(out, FILES, config["overwrite"])
    asked = Asked(
        from_mapping(Reading, config["read"], "read"),
        from_mapping(Pulse, config["pulse"], "pulse"),
        from_mapping(RecordConditions, _stated(config["known"]), "known"),
    )
    asked.pulse.check_named()
    model = load_model(path_given("diagnose", "model", config["model"]))
    cases = cases_of(config["measured"], asked, model)
    if out is None:
        reports = _told(model, cases, None, 0)
    else:
        with output_folder(out, FILES, config["overwrite"]) as folder:
            reports = _told(model, cases, folder, config["pictures"])
            _write_summary(folder, str(config["model"]), model, reports)
        print(f"{'written':<{COLUMN}}{out}")
    problems = [report.problem for report in reports if report.problem]
    if problems:
        raise SignalError(f"{len(problems)} of {len(reports)} signals could not be diagnosed; the first: {problems[0]}")
    if not model.guards:
        raise SystemExit(DIFFERENT)


def _stated(known: Any) -> Any:
    """What is not null, so that null may stand beside a key of another unit."""
    return {key: value for key, value in known.items() if value is not None} if isinstance(known, dict) else known


def _told(model: Model, cases: Iterable[Case], folder: Path | None, pictures: int) -> list[CaseReport]:
    """Diagnose all cases, tell of each and write its files; raises SignalError where none could be diagnosed."""
    first = list(itertools.islice(cases, 2))
    alone, reports, names = len(first) == 1, [], set[str]()
    assumed = set[str]()
    if first:
        _assume(model, first[0], assumed)
    for text in model.shortcomings():
        print(f"{'without':<{COLUMN}}{text}")
    for number, case in enumerate(itertools.chain(first, cases)):
        _assume(model, case, assumed)
        report = _report(case)
        if alone and not report.problem:
            print("\n".join(lines(report)))
        elif not alone and number <= _LINES:
            print(line(report) if number < _LINES else "…")
        if folder is not None:
            _write(folder / _stem(report.name, names), model, report, number < pictures)
        reports.append(_without_records(report))
    if not reports:
        raise SignalError("diagnose.measured must hold at least one record, got a data set without any; give another.")
    if all(report.problem for report in reports):
        more = f" ({len(reports)} signals, none of which could be diagnosed)" if len(reports) > 1 else ""
        raise SignalError(f"{reports[0].problem.removesuffix('.')}{more}.")
    if not alone:
        print("\n".join(summary_lines(summary(reports))))
    return reports


def _assume(model: Model, case: Case, told: set[str]) -> None:
    """Say which conditions of a case are assumed to be those of the training and which cannot be compared with them,
    and add them to those that are told."""
    if keys := [key for key in model.conditions.not_compared(case.known) if key not in told]:
        print(f"{'assumed':<{COLUMN}}{', '.join(keys)} as in the training records; known.{keys[0]}=VALUE says it")
        told.update(keys)
    if keys := [key for key in model.conditions.not_known(case.known) if key not in told]:
        print(f"{'not compared':<{COLUMN}}{', '.join(keys)}, as not all training records state it")
        told.update(keys)


def _report(case: Case) -> CaseReport:
    try:
        return CaseReport.of(case.name, case.true_class, case.reports(), case.subset)
    except SignalError as error:
        return CaseReport(case.name, case.true_class, (), str(error), case.subset)


def _stem(name: str, taken: set[str]) -> str:
    """Name of a signal's files, no two alike."""
    file, item, number = name.rpartition(", item ")
    told = f"{Path(file).name}-item-{number}" if item else Path(name).stem
    plain = "-".join(told.split()) or "signal"
    numbered = (plain if number == 1 else f"{plain}-{number}" for number in itertools.count(1))
    stem = next(candidate for candidate in numbered if candidate not in taken)
    taken.add(stem)
    return stem


def _write(stem: Path, model: Model, report: CaseReport, draw: bool) -> None:
    json_ending, picture_ending = ENDINGS
    text = json.dumps(report.to_dict(), indent=1, ensure_ascii=False)
    stem.with_name(stem.name + json_ending).write_text(text + "\n", encoding="utf-8")
    if draw and report.diagnosed:
        # Drawing is loaded only where a picture is wanted: it takes longer than the diagnosis.
        from classifier.pictures import draw_diagnosis

        draw_diagnosis(model, report).savefig(stem.with_name(stem.name + picture_ending))


def _write_summary(folder: Path, name: str, model: Model, reports: list[CaseReport]) -> None:
    signals = [{"signal": report.name, "verdict": report.verdict, "problem": report.problem} for report in reports]
    told = {
        "model": name,
        "guards": model.guards,
        "left_out": dict(model.left_out),
        **summary(reports),
        "signals_told": signals,
    }
    (folder / SUMMARY).write_text(json.dumps(told, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
    rows = [row for report in reports for row in report.rows()]
    columns = dict.fromkeys(name for row in rows for name in row)
    table = pa.table({name: [row.get(name) for row in rows] for name in columns})
    write_csv(table, folder / TURNS)


def _without_records(report: CaseReport) -> CaseReport:
    return replace(report, turns=tuple(replace(turn, record=None) for turn in report.turns))


main = hydra_command("diagnose")(run)

if __name__ == "__main__":
    main()
