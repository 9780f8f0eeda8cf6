"""How well a classifier knows a sensor, machine or day that it never saw: each is left out of the training in turn.

``indexer leaveout data=DIR by=machine out=DIR [seeds=5 ...]``
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np
import torch
from matplotlib.figure import Figure

from classifier.dataset import Dataset, load_dataset
from classifier.evaluate import score
from classifier.feature_choice import chosen, make_choice, told
from classifier.groups import groups_of, part
from classifier.job import Net
from classifier.leaveout_methods import CNN, LOGISTIC, METHODS, MLP, WITHOUT_CHANCE, Learn, cnn, logistic, mlp
from classifier.results import RESULT_FILES, Row, chosen_methods, markdown, mean, means, write_results
from classifier.style import COLOURS, style
from classifier.tasks.need import NotAvailable
from classifier.tasks.novelty import enough
from classifier.train import Result, train
from classifier.trainers import make_trainer
from indexer_cli.command import hydra_command
from indexer_cli.job_paths import job_folder, place_given
from indexer_cli.output_folder import check_output_folder, output_folder
from indexer_cli.words import plain_console
from indexer_env.build import from_mapping
from indexer_env.checks import check_integer
from indexer_env.errors import IndexerError, SignalError, refuse

PICTURE = "leaveout.png"
FILES = (*RESULT_FILES, PICTURE)
"""All that the command leaves in its folder."""

ACCURACY, KNOWN = "accuracy [%]", "accuracy on known groups [%]"
F1, REFUSED = "macro F1", "refused as novel [%]"
METRICS = ((ACCURACY, 1), (KNOWN, 1), (F1, 3), (REFUSED, 1))
MEAN = "mean over the groups"


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


def judge(split: Split, method: str, learn: Learn, seed: int) -> list[Row]:
    """Rows of one training of a method without the group: how it does on all records of that group, and on the
    validation records of those that it knows.
    """
    learnt = learn(split.rest, seed)
    validation = split.rest.rows("validation")
    known = score(split.rest.codes, learnt.outputs(split.rest.records[validation]), split.rest.classes[validation])
    new = score(split.rest.codes, learnt.outputs(split.records), split.classes)
    found = {
        ACCURACY: 100.0 - new.misclassified_percent,
        KNOWN: 100.0 - known.misclassified_percent,
        F1: new.macro_f1,
    }
    refused = learnt.refused(split.records)
    if refused is not None:
        found[REFUSED] = float(100 * refused.mean())
    return [Row("leaveout", split.group, method, metric, seed, value) for metric, value in found.items()]


def overall(rows: Sequence[Row]) -> list[Row]:
    """Means over the groups, one row for each method, metric and seed."""
    keys = dict.fromkeys((row.method, row.metric, row.seed) for row in rows)
    return [
        Row(
            "leaveout", MEAN, *key, mean([row.value for row in rows if (row.method, row.metric, row.seed) == key]).value
        )
        for key in keys
    ]


def side_by_side(rows: Sequence[Row]) -> str:
    """Accuracy [%] on every left-out group, a line for each method and a column for each group, their mean last."""
    found = {key[:2]: value for key, value in means(rows).items() if key[2] == ACCURACY}
    groups, methods = (list(dict.fromkeys(key[place] for key in found)) for place in (0, 1))
    lines = [["accuracy [%] on", *groups], ["---", *["---:"] * len(groups)]]
    lines += [[method, *(found[group, method].text(1) for group in groups)] for method in methods]
    return "".join(f"| {' | '.join(line)} |\n" for line in lines)


def draw(rows: Sequence[Row]) -> Figure:
    """Accuracy of every method on every left-out group; intervals are over the seeds."""
    found = {key[:2]: value for key, value in means(rows).items() if key[2] == ACCURACY}
    groups, methods = (list(dict.fromkeys(key[place] for key in found)) for place in (0, 1))
    with style():
        figure = Figure(figsize=(6, 1.2 + 0.35 * len(groups)), layout="constrained")
        ax = figure.subplots()
        for place, method in enumerate(methods):
            shift = 0.5 * ((place + 0.5) / len(methods) - 0.5)
            for line, group in enumerate(groups):
                value, low, high, _ = found[group, method]
                ax.plot([low, high], [line + shift] * 2, color=COLOURS[place], linewidth=2)
                ax.plot(value, line + shift, "o", color=COLOURS[place], label=method if line == 0 else None)
        ax.set_yticks(range(len(groups)), groups)
        ax.invert_yaxis()
        ax.set(xlabel=f"{ACCURACY} on the group left out")
        ax.legend()
    return figure


def run(config: dict[str, Any]) -> None:
    """The command, given its configuration as in conf/leaveout.yaml."""
    out = check_output_folder(job_folder("leaveout", config["out"]), FILES, config["overwrite"])
    for key in ("seeds", "restarts", "threads"):
        check_integer("leaveout", key, config[key], low=1)
    if not isinstance(config["by"], str):
        raise refuse("leaveout", "by", "the name of a group or column", config["by"])
    names = chosen_methods("leaveout", config["methods"], METHODS)
    choice, trainer = make_choice(config["features"]), make_trainer(config["trainer"])
    net = asdict(from_mapping(Net, config["net"], owner="net"))
    torch.set_num_threads(config["threads"])
    dataset = load_dataset(place_given("leaveout", "data", config["data"]))

    features = chosen(choice, dataset)

    def trained(rest: Dataset, seed: int) -> Result:
        return train(rest, features, trainer, seed=seed, restarts=config["restarts"], parts=(), **net)

    learners = {MLP: mlp(trained), LOGISTIC: logistic(features), CNN: cnn(features)}
    console = plain_console()
    if line := told(choice, features, dataset):
        console.print(line)
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
    rows = [
        row
        for split in found
        for name in names
        for seed in range(1 if name in WITHOUT_CHANCE else config["seeds"])
        for row in judge(split, name, learners[name], seed)
    ]
    rows += overall(rows)
    table = f"{side_by_side(rows)}\n{markdown(rows, METRICS)}"
    console.print(table)
    with output_folder(out, FILES, config["overwrite"]) as folder:
        write_results(folder, rows, table, config)
        draw(rows).savefig(folder / PICTURE)
    console.print(f"written {out}")


main = hydra_command("leaveout")(run)

if __name__ == "__main__":
    main()
