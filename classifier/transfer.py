"""A network that was trained on one machine, usually a simulated one, goes on learning from few records of another.

``indexer transfer model=DIR data=DIR out=DIR [counts=[8,16,32] seeds=5 ...]``
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import torch
from matplotlib.figure import Figure

from classifier.codes import CodeBook
from classifier.dataset import SUBSETS, Dataset, load_dataset
from classifier.evaluate import Score, score
from classifier.features import Scaling
from classifier.model import MODEL_TENSORS, MODEL_YAML, Model, load_model, save_model
from classifier.parts import NOT_ASKED_FOR, ON_REQUEST, fit_parts
from classifier.results import RESULT_FILES, Row, markdown, means, write_results
from classifier.style import COLOURS, style
from classifier.train import mean_densities
from classifier.trainers import Examples, Trainer, make_trainer
from indexer_cli.command import hydra_command
from indexer_cli.job_paths import job_folder, path_given, place_given
from indexer_cli.output_folder import check_output_folder, output_folder
from indexer_cli.words import plain_console
from indexer_env.checks import check_integer
from indexer_env.errors import SignalError, refuse
from indexer_records.measured import same_rate

PICTURE = "transfer.png"
FILES = (MODEL_YAML, MODEL_TENSORS, *RESULT_FILES, PICTURE)
"""All that the command leaves in its folder."""

AS_IT_IS, FINE_TUNED, ANEW = "as it is", "fine-tuned", "begun anew"
WRONG, F1 = "misclassified [%]", "macro F1"


def fitted_to(model: Model, dataset: Dataset) -> Dataset:
    """The data set with the model's codes, given by the names of the classes: the network's outputs keep their meaning.

    Raises SignalError for records that the model's features were not made for and for a class that it does not have.
    """
    if not same_rate(dataset.sample_rate, model.sample_rate):
        rate = f"{model.sample_rate:g}"
        raise SignalError(
            f"the records must be sampled at the rate that the model was trained on, {rate} Hz, got "
            f"{dataset.sample_rate:g} Hz; ingest them again with sample_rate={rate}."
        )
    for name, wanted, got in (
        ("in the unit", model.unit, dataset.unit),
        ("of the quantity", model.quantity, dataset.quantity),
        ("of as many channels", model.channels, dataset.channels),
    ):
        if wanted != got:
            raise SignalError(f"the records must be {name} that the model was trained on, {wanted}, got {got}.")
    place = {name: position for position, name in enumerate(model.codes.names)}
    if unknown := sorted(set(dataset.codes.names) - set(place)):
        has = ", ".join(model.codes.names)
        raise SignalError(f"every class must be one of the model's by name ({has}), got {unknown[0]!r}; rename it.")
    positions = np.array([place[name] for name in dataset.codes.names])[dataset.codes.positions(dataset.classes)]
    labels, names, codes = (
        np.array(column)[positions] for column in (model.codes.classes, model.codes.names, model.codes.codes)
    )
    return replace(dataset, classes=labels, codes=CodeBook.of_rows(labels, names, codes))


@dataclass(frozen=True, eq=False)
class Learner:
    """A model and records of another machine.

    values  (n, count) features of all records of the data set
    wanted  (n, bits) targets of the model's network
    """

    model: Model
    dataset: Dataset
    trainer: Trainer
    values: np.ndarray
    wanted: torch.Tensor

    @classmethod
    def of(cls, model: Model, dataset: Dataset, trainer: Trainer) -> Learner:
        """Of a data set that fits the model, see `fitted_to`."""
        bits = torch.from_numpy(dataset.codes.targets(dataset.classes))
        values = model.features.compute(dataset.records, dataset.sample_rate)
        return cls(model, dataset, trainer, values, model.network.targets_of(bits))

    def learn(self, start: torch.Tensor, scaled: np.ndarray, rows: np.ndarray, watch: np.ndarray) -> torch.Tensor:
        """Parameters (count,) of the best of the networks that begin at start (n, count), taught on some rows and
        stopped by others, with features `scaled`."""
        taught, watched = (
            Examples(torch.from_numpy(scaled[at]), self.wanted[torch.from_numpy(at)]) for at in (rows, watch)
        )
        training = self.trainer.train(self.model.network, start, taught, watched)
        return training.parameters[training.best]

    def judged(self, parameters: torch.Tensor, scaled: np.ndarray) -> dict[str, float]:
        """Metrics on the validation records."""
        rows = self.dataset.rows("validation")
        outputs = self.model.network.outputs_of(parameters[None], torch.from_numpy(scaled[rows]))[0]
        scored = self.scored(self.model.network.bits_of(outputs).numpy())
        return {WRONG: scored.misclassified_percent, F1: scored.macro_f1}

    def scored(self, outputs: np.ndarray) -> Score:
        """Score of outputs (k, bits) for the validation records, which may be named by any class of the model."""
        return score(self.model.codes, outputs, self.dataset.classes[self.dataset.rows("validation")])

    def as_it_is(self) -> list[Row]:
        """Rows for 0 records; no chance is in them, so they are of one seed, 0."""
        return self._rows(AS_IT_IS, 0, 0, self.judged(self.model.parameters, self.model.scaling.apply(self.values)))

    def curve(self, counts: Sequence[int], seed: int, restarts: int) -> list[Row]:
        """Rows for each count: the same few records teach the old network and new ones.

        The records are all there is: they scale the features, teach and say when to stop.
        """
        rows: list[Row] = []
        rng = np.random.default_rng(seed)
        order = in_turns(self.dataset, rng.permutation(np.flatnonzero(self.dataset.rows("calibration"))))
        anew = self.model.network.initial(restarts, torch.Generator().manual_seed(seed))
        for count in counts:
            few = order[:count]
            scaled = Scaling.fit(self.values[few]).apply(self.values)
            for method, start in ((FINE_TUNED, self.model.parameters[None]), (ANEW, anew)):
                learnt = self.learn(start, scaled, few, few)
                rows += self._rows(method, count, seed, self.judged(learnt, scaled))
        return rows

    def _provenance(self) -> dict[str, Any]:
        """The model's own, this data set as what it was fine-tuned on, and those of fine-tunings before this one."""
        own = self.model.provenance
        earlier = [*own.get("fine_tuned_before", ()), *([own["fine_tuned_on"]] if "fine_tuned_on" in own else ())]
        told = {**own, "fine_tuned_on": self.dataset.provenance}
        return {**told, "fine_tuned_before": earlier} if earlier else told

    def _lost(self) -> dict[str, str]:
        """Classes of the model that the data set has no record of."""
        lost = [name for name in self.model.codes.names if name not in self.dataset.codes.names]
        return {"classes": f"no record of {', '.join(lost)}, which it does not name any more"} if lost else {}

    def _rows(self, method: str, count: int, seed: int, found: dict[str, float]) -> list[Row]:
        name = f"{count} records"
        return [Row("transfer", name, method, metric, seed, value, float(count)) for metric, value in found.items()]

    def tuned(self, seed: int) -> Model:
        """The model after learning from all calibration records, stopped by the control records. Its parts are learnt
        anew, but for those that a training fits on request alone; what the model was to be without stays left out."""
        calibration, control = (np.flatnonzero(self.dataset.rows(name)) for name in ("calibration", "control"))
        scaling = Scaling.fit(self.values[calibration])
        scaled = scaling.apply(self.values)
        parameters = self.learn(self.model.parameters[None], scaled, calibration, control)
        dataset = self.dataset
        model = replace(
            self.model,
            scaling=scaling,
            parameters=parameters,
            codes=dataset.codes,
            samples=dataset.records.shape[-1],
            conditions=dataset.conditions,
            mean_densities=mean_densities(dataset, self.model.features),
            mean_features=scaled[calibration].mean(axis=0),
            provenance=self._provenance(),
            parts=(),
        )
        outputs = model.outputs_of(scaled)
        scores = {
            name: score(dataset.codes, outputs[dataset.rows(name)], dataset.classes[dataset.rows(name)]).to_dict()
            for name in SUBSETS
        }
        unwanted = [kind for kind, reason in self.model.left_out.items() if reason == NOT_ASKED_FOR]
        fitted, left_out = fit_parts(dataset, scaled, outputs, seed=seed, without=unwanted)
        left_out |= {part.kind: "not learnt anew" for part in self.model.parts if part.kind in ON_REQUEST}
        left_out |= dataset.conditions.left_out() | self._lost()
        return replace(model, metrics=scores, parts=fitted, left_out=left_out)


def in_turns(dataset: Dataset, rows: np.ndarray) -> np.ndarray:
    """Row numbers put so that the classes take turns: the first k of them hold every class as evenly as can be."""
    seen: dict[int, int] = {}
    turn = np.empty(len(rows), dtype=int)
    for place, row in enumerate(rows):
        label = int(dataset.classes[row])
        turn[place] = seen[label] = seen.get(label, -1) + 1
    return rows[np.argsort(turn, kind="stable")]


def draw(rows: Sequence[Row]) -> Figure:
    """Misclassified share over the number of records, means with intervals over the seeds."""
    found = {key[:2]: value for key, value in means(rows).items() if key[2] == WRONG}
    places = {row.data: row.x for row in rows}
    x: list[float] = []
    with style():
        figure = Figure(figsize=(6, 4), layout="constrained")
        ax = figure.subplots()
        for method, colour in ((FINE_TUNED, COLOURS[0]), (ANEW, COLOURS[4])):
            curve = [(places[data], value) for (data, name), value in found.items() if name == method]
            x = [place for place, _ in curve]
            ax.fill_between(
                x, [v.low for _, v in curve], [v.high for _, v in curve], color=colour, alpha=0.2, linewidth=0
            )
            ax.plot(x, [v.value for _, v in curve], ".-", color=colour, label=method)
        before = found["0 records", AS_IT_IS].value
        ax.axhline(before, color="0.4", linestyle=":", label=f"{AS_IT_IS}, without a record of this machine")
        ax.set_xscale("log")
        ax.set_xticks(x, [f"{place:g}" for place in x], minor=False)
        ax.minorticks_off()
        ax.set(xlabel="records of the other machine", ylabel=WRONG, ylim=(0, None))
        ax.legend()
    return figure


def run(config: dict[str, Any]) -> None:
    """The command, given its configuration as in conf/transfer.yaml."""
    out = check_output_folder(job_folder("transfer", config["out"]), FILES, config["overwrite"])
    for key in ("seeds", "restarts", "threads"):
        check_integer("transfer", key, config[key], low=1)
    counts = config["counts"]
    if not isinstance(counts, list) or not counts:
        raise refuse("transfer", "counts", "a list of numbers of records", counts, "for instance counts=[8,16,32]")
    for count in counts:
        check_integer("transfer", "counts", count, low=1, unit="records")
    torch.set_num_threads(config["threads"])
    trainer = make_trainer(config["trainer"])
    model = load_model(path_given("transfer", "model", config["model"]))
    dataset = fitted_to(model, load_dataset(place_given("transfer", "data", config["data"])))
    learner = Learner.of(model, dataset, trainer)
    held = int(dataset.rows("calibration").sum())
    used = sorted({count for count in counts if count <= held})
    if not used:
        raise refuse("transfer", "counts", f"numbers of records up to the {held} for calibration", counts, "give fewer")

    curves = [row for seed in range(config["seeds"]) for row in learner.curve(used, seed, config["restarts"])]
    rows = [*learner.as_it_is(), *curves]
    table = markdown(rows, ((WRONG, 2), (F1, 3)))
    console = plain_console()
    console.print(table)
    tuned = learner.tuned(0)
    for text in tuned.shortcomings():
        console.print(text)
    with output_folder(out, FILES, config["overwrite"]) as folder:
        save_model(tuned, folder)
        write_results(folder, rows, table, config)
        draw(rows).savefig(folder / PICTURE)
    console.print(f"written {out}")


main = hydra_command("transfer")(run)

if __name__ == "__main__":
    main()
