"""How well a classifier knows a sensor, machine or day that it never saw: each is left out of the training in turn.

``indexer leaveout data=DIR by=machine out=DIR [seeds=5 ...]``
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import torch
from matplotlib.figure import Figure
from rich.console import Console

from classifier.dataset import Dataset, load_dataset
from classifier.evaluate import score
from classifier.features import make_features
from classifier.groups import groups_of, part
from classifier.results import RESULT_FILES, Row, markdown, mean, means, write_results
from classifier.style import COLOURS, GREY, style
from classifier.tasks.need import NotAvailable
from classifier.tasks.novelty import Novelty, enough
from classifier.train import Result, train
from classifier.trainers import make_trainer
from indexer_cli.command import hydra_command
from indexer_cli.job_paths import job_folder, path_given
from indexer_cli.output_folder import check_output_folder, output_folder
from indexer_env.checks import check_integer
from indexer_env.errors import IndexerError, SignalError, refuse

PICTURE = "leaveout.png"
FILES = (*RESULT_FILES, PICTURE)
"""All that the command leaves in its folder."""

KNOWN, NEW = "known groups", "left-out group"
WRONG, F1, REFUSED = "misclassified [%]", "macro F1", "refused as novel [%]"
METRICS = ((WRONG, 2), (F1, 3), (REFUSED, 1))
ALL = "mean over the groups"


@dataclass(frozen=True)
class Split:
    """A data set without one of its groups, and the records of that group.

    group    its value
    rest     all other records, with the subsets that they have
    records, classes  of the group whose classes the others have too
    """

    group: str
    rest: Dataset
    records: np.ndarray
    classes: np.ndarray


def splits(dataset: Dataset, groups: np.ndarray) -> tuple[list[Split], dict[str, str]]:
    """A split for every group, and by group why there is none.

    Raises SignalError where there is but one group.
    """
    labels = np.unique(groups)
    if len(labels) < 2:
        raise SignalError(
            f"at least two groups are needed to leave one out, got {labels[0]!r} alone; choose another by."
        )
    found, without = [], {}
    for label in labels:
        inside = groups == label
        try:
            rest = part(dataset, ~inside)
        except IndexerError as error:
            without[str(label)] = str(error)
            continue
        judged = inside & np.isin(dataset.classes, rest.codes.classes)
        if not judged.any():
            without[str(label)] = "no other group has its classes."
            continue
        found.append(Split(str(label), rest, dataset.records[judged], dataset.classes[judged]))
    return found, without


def judge(split: Split, learn: Callable[[Dataset, int], Result], seed: int) -> list[Row]:
    """Rows of one training without the group: how it does on the validation records of the groups that it knows, and on
    all records of the one that it does not.
    """
    model = learn(split.rest, seed).model
    rest = model.scaled(split.rest.records)
    try:
        novelty = Novelty.fit(split.rest, rest, model.outputs_of(rest), seed)
    except NotAvailable:
        novelty = None  # `run` says why
    validation = split.rest.rows("validation")
    rows = []
    for method, records, classes in (
        (KNOWN, split.rest.records[validation], split.rest.classes[validation]),
        (NEW, split.records, split.classes),
    ):
        scaled = model.scaled(records)
        outputs = model.outputs_of(scaled)
        scored = score(model.codes, outputs, classes)
        found = {WRONG: scored.misclassified_percent, F1: scored.macro_f1}
        if novelty is not None:
            found[REFUSED] = float(100 * novelty.assess(scaled, outputs, records)["is_novel"].mean())
        rows += [Row("leaveout", split.group, method, metric, seed, value) for metric, value in found.items()]
    return rows


def overall(rows: Sequence[Row]) -> list[Row]:
    """Means over the groups, one row for each method, metric and seed."""
    keys = dict.fromkeys((row.method, row.metric, row.seed) for row in rows)
    return [
        Row("leaveout", ALL, *key, mean([row.value for row in rows if (row.method, row.metric, row.seed) == key]).value)
        for key in keys
    ]


def draw(rows: Sequence[Row]) -> Figure:
    """Misclassified share of every left-out group beside that of the known ones; intervals are over the seeds."""
    found = {key[:2]: value for key, value in means(rows).items() if key[2] == WRONG}
    groups = list(dict.fromkeys(group for group, _ in found))
    with style():
        figure = Figure(figsize=(6, 1.2 + 0.35 * len(groups)), layout="constrained")
        ax = figure.subplots()
        for method, colour, shift in ((KNOWN, GREY, -0.1), (NEW, COLOURS[0], 0.1)):
            for line, group in enumerate(groups):
                value, low, high, _ = found[group, method]
                ax.plot([low, high], [line + shift] * 2, color=colour, linewidth=2)
                ax.plot(value, line + shift, "o", color=colour, label=method if line == 0 else None)
        ax.set_yticks(range(len(groups)), groups)
        ax.invert_yaxis()
        ax.set(xlabel=WRONG, xlim=(min(0.0, ax.get_xlim()[0]), None))
        ax.legend()
    return figure


def run(config: dict[str, Any]) -> None:
    """The command, given its configuration as in conf/leaveout.yaml."""
    out = check_output_folder(job_folder("leaveout", config["out"]), FILES, config["overwrite"])
    for key in ("seeds", "restarts", "threads"):
        check_integer("leaveout", key, config[key], low=1)
    if not isinstance(config["by"], str):
        raise refuse("leaveout", "by", "the name of a group or column", config["by"])
    features, trainer = make_features(config["features"]), make_trainer(config["trainer"])
    torch.set_num_threads(config["threads"])
    dataset = load_dataset(path_given("leaveout", "data", config["data"]))

    def learn(rest: Dataset, seed: int) -> Result:
        return train(rest, features, trainer, seed=seed, restarts=config["restarts"], parts=(), **config["net"])

    console = Console(highlight=False, soft_wrap=True)
    found, without = splits(dataset, groups_of(dataset, config["by"]))
    for group, reason in without.items():
        console.print(f"{config['by']} {group} is not left out: {reason}")
    if not found:
        raise SignalError(f"no {config['by']} can be left out: {next(iter(without.values()))}")
    for split in found:
        try:
            enough(split.rest)
        except NotAvailable as reason:
            console.print(f"{config['by']} {split.group}: whether it is refused as novel cannot be told, {reason}")
    rows = [row for split in found for seed in range(config["seeds"]) for row in judge(split, learn, seed)]
    rows += overall(rows)
    table = markdown(rows, METRICS)
    console.print(table)
    with output_folder(out, FILES, config["overwrite"]) as folder:
        write_results(folder, rows, table, config)
        draw(rows).savefig(folder / PICTURE)
    console.print(f"written {out}")


main = hydra_command("leaveout")(run)

if __name__ == "__main__":
    main()
