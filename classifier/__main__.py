"""Training from the command line: ``indexer train data=DIR out=DIR [net.hidden=20 trainer=traingdx
seed=0 ...]``.
"""

from __future__ import annotations

import json
import time
from typing import Any

import torch
from rich.console import Console
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn
from rich.table import Table

from classifier.conditions import CLIPPED
from classifier.curves import TENSORBOARD, summary_writer, write_curves
from classifier.dataset import SUBSETS, load_dataset
from classifier.feature_choice import chosen, told
from classifier.job import Job
from classifier.model import MODEL_TENSORS, MODEL_YAML, save_model
from classifier.runs import RUNS, collect, row_of, write_runs
from classifier.train import Result
from indexer_cli.command import check_flag, hydra_command
from indexer_cli.job_paths import in_sweep, job_folder, place_given
from indexer_cli.output_folder import check_output_folder, output_folder
from indexer_env.checks import check_integer

RESULTS_JSON = "results.json"
PICTURES = ("accelerations.png", "psds.png", "training.png", "confusion.png", "reliability.png")
FILES = (MODEL_YAML, MODEL_TENSORS, RESULTS_JSON, RUNS, TENSORBOARD, *PICTURES)
"""All that the command may leave in its folder."""


def results_table(result: Result) -> Table:
    """Both errors [%] and the number of records of each subset; the restarts' range in brackets."""
    training = result.training
    many = len(training.epochs) > 1
    table = Table(
        title=f"network {result.kept + 1} of {len(training.epochs)}, "
        f"epoch {training.best_epoch[result.kept]} of {training.epochs[result.kept]} "
        f"(stopped by {training.stopped_by[result.kept]})"
    )
    table.add_column("subset")
    for column in ("records", "mean square error [%]", "misclassified [%]"):
        table.add_column(column, justify="right")
    for subset in SUBSETS:
        kept = result.score(subset)
        cells = []
        for name, digits in (("mse_percent", 3), ("misclassified_percent", 1)):
            values = [getattr(score, name) for score in result.scores[subset]]
            spread = f"  ({min(values):.{digits}f} … {max(values):.{digits}f})" if many else ""
            cells.append(f"{getattr(kept, name):.{digits}f}{spread}")
        table.add_row(subset, str(kept.records), *cells)
    if many:
        table.caption = f"in brackets: range over the {len(training.epochs)} restarts"
    return table


def run(config: dict[str, Any]) -> dict[str, Any]:
    """The command, given its configuration as in conf/train.yaml."""
    started = time.perf_counter()
    out = check_output_folder(job_folder("classifier", config["out"]), FILES, config["overwrite"])
    check_integer("classifier", "threads", config["threads"], low=1)
    torch.set_num_threads(config["threads"])
    check_flag("classifier", "pictures", config["pictures"])
    check_flag("classifier", "tensorboard", config["tensorboard"])
    writer = summary_writer() if config["tensorboard"] else None
    job = Job.of(config)
    console = Console()

    dataset = load_dataset(place_given("classifier", "data", config["data"]))
    if (clipped := dataset.conditions.clipped_share) > CLIPPED:
        share = f"up to {100 * clipped:.3g} % of the samples of a calibration record are clipped"
        console.print(f"{share}: the model will take records of such a sensor for sound", highlight=False)
    if dataset.conditions.sense < 0:
        console.print(
            "each index begins with the deceleration: the sensor was mounted the other way round, or the table runs "
            "backwards; the model will take this sign for sound",
            highlight=False,
        )
    if line := told(job.features, chosen(job.features, dataset), dataset):
        console.print(line, highlight=False, soft_wrap=True)
    columns = (
        TextColumn("epoch {task.completed}"),
        BarColumn(),
        TextColumn("{task.description}"),
        TimeElapsedColumn(),
    )
    # Off a terminal the bar would be a wall of lines; the table that follows says all.
    with Progress(*columns, console=console, transient=True, disable=not console.is_terminal) as bar:
        task = bar.add_task("training", total=job.trainer.epochs)

        def progress(epoch: int, error: float) -> None:
            bar.update(task, completed=epoch, description=f"control error {100 * error:.2f} %")

        result = job.train(dataset, progress)
    console.print(results_table(result))
    for text in result.model.shortcomings():
        console.print(text, highlight=False, soft_wrap=True)

    with output_folder(out, FILES, config["overwrite"]) as folder:
        save_model(result.model, folder)
        results = {**result.to_dict(), "config": config}
        (folder / RESULTS_JSON).write_text(json.dumps(results, indent=1) + "\n", encoding="utf-8")
        if config["pictures"]:
            # Drawing is loaded only now: its import takes as long as the training of a small data set.
            from classifier.pictures import draw_training

            for name, figure in draw_training(dataset, result).items():
                figure.savefig(folder / f"{name}.png")
        seconds = time.perf_counter() - started
        write_runs([row_of(result, config, str(out), seconds)], folder / RUNS)
        if writer is not None:
            write_curves(writer, folder / TENSORBOARD, result)
    if in_sweep():
        console.print(f"{collect(out.parent)} runs in {out.parent / RUNS}", highlight=False, soft_wrap=True)
    console.print(f"written {out} in {time.perf_counter() - started:.1f} s", highlight=False)
    return {f"{subset}_misclassified_percent": result.score(subset).misclassified_percent for subset in SUBSETS}


main = hydra_command("train")(run)

if __name__ == "__main__":
    main()
