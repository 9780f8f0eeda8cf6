"""Comparison from the command line: ``indexer compare study=baselines out=DIR [seeds=5 ...]``."""

from __future__ import annotations

import shutil
import time
from typing import Any

import torch
from hydra.core.hydra_config import HydraConfig

from classifier.results import RESULT_FILES, Row, chosen_methods, markdown, write_results
from indexer_cli.command import hydra_command
from indexer_cli.job_paths import job_folder, path_given
from indexer_cli.output_folder import check_output_folder, output_folder
from indexer_cli.places.local import whole_file
from indexer_cli.words import plain_console
from indexer_env.checks import check_choice, check_integer
from indexer_env.errors import IndexerError, refuse
from indexer_experiments.compare.beside import beside
from indexer_experiments.compare.study import Setting, Study

LEAST_RECORDS = 200
"""Machines with which every class is likely to be in every subset."""

PART = ".part"
"""Ends the name of the folder beside `out` that holds the seeds done so far, and goes when all are done."""


def run(config: dict[str, Any]) -> None:
    """The command, given its configuration as in conf/compare.yaml."""
    started = time.perf_counter()
    study = _study(config["study"])
    _refuse_records(study, config)
    pictures = tuple(f"{name}.png" for name in study.pictures)
    files = (*RESULT_FILES, *pictures)
    out = check_output_folder(job_folder("compare", config["out"]), files, config["overwrite"])
    part = check_output_folder(out.with_name(f"{out.name}{PART}"), RESULT_FILES, config["overwrite"])
    check_integer("compare", "seeds", config["seeds"], low=1, high=1000)
    check_integer("compare", "records", config["records"], low=LEAST_RECORDS)
    check_integer("compare", "threads", config["threads"], low=1)
    methods = _methods(config["methods"], study)
    data = path_given("compare", "data", config["data"])
    torch.set_num_threads(config["threads"])

    console = plain_console()
    rows: list[Row] = []
    for seed in range(config["seeds"]):
        rows += study.run(Setting(seed, config["records"], data, methods))
        with output_folder(part, RESULT_FILES, overwrite=True) as folder:
            so_far = f"{seed + 1} of {config['seeds']} seeds so far."
            write_results(folder, rows, f"{so_far}\n\n{_told(study, rows)}", config)
        console.print(f"seed {seed}: {time.perf_counter() - started:.0f} s, kept in {part}")
    text = _told(study, rows)
    console.print(text)
    with output_folder(out, files, config["overwrite"]) as folder:
        write_results(folder, rows, text, config)
    shutil.rmtree(part)
    console.print(f"written {out} in {time.perf_counter() - started:.1f} s")
    for name, draw in study.pictures.items():
        figure = draw(rows)
        with whole_file(out / f"{name}.png") as picture:
            figure.savefig(picture, format="png")


def _told(study: Study, rows: list[Row]) -> str:
    """The question, and tables of the answer."""
    tables = [study.question, markdown(rows, study.metrics)]
    if study.beside is not None:
        tables.append(beside(rows, *study.beside))
    return "\n\n".join(table.rstrip("\n") for table in tables if table) + "\n"


def _study(name: object) -> Study:
    try:
        from indexer_experiments.compare.studies import STUDIES
    except ModuleNotFoundError as error:
        if (error.name or "").partition(".")[0] != "sklearn":
            raise
        raise IndexerError(
            "compare must have the package scikit-learn, got none; run: pip install 'indexer-diagnosis[sklearn]'."
        ) from None
    check_choice("compare", "study", name, STUDIES)
    return STUDIES[str(name)]


def _refuse_records(study: Study, config: dict[str, Any]) -> None:
    """A number of records for a study whose data are always the same would be lost without a word."""
    if study.sized or not HydraConfig.initialized():
        return
    if any(override.lstrip("+").partition("=")[0] == "records" for override in HydraConfig.get().overrides.task):
        rule = f"left out with study={config['study']}, whose records are always the same"
        remedy = "leave it out, or compare on data sets of that size with study=baselines"
        raise refuse("compare", "records", rule, config["records"], remedy)


def _methods(given: object, study: Study) -> tuple[str, ...]:
    """The methods to compare; those of a user's own file are loaded once, so that a mistake is told at once."""
    if not study.own or not isinstance(given, list):
        return chosen_methods("compare", given, study.methods)
    from indexer_experiments.compare.methods.own import is_own, method_of

    own = [name for name in given if is_own(name)]
    for name in own:
        method_of(name)
    return chosen_methods("compare", given, (*study.methods, *own))


main = hydra_command("compare")(run)

if __name__ == "__main__":
    main()
