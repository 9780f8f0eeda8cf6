"""Pictures of data, training and diagnosis, in one style; each function returns matplotlib figures and writes
nothing.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from classifier.dataset import SUBSETS, Dataset
from classifier.diagnose import Diagnosis
from classifier.diagnose.report import CaseReport
from classifier.evaluate import BINS, reliability
from classifier.model import Model
from classifier.style import COLOURS as _COLOURS
from classifier.style import DARK as _DARK
from classifier.style import GREY as _GREY
from classifier.style import style as _style
from classifier.tasks.confidence import Confidence, class_logits, softmax
from classifier.train import Result


def _colour(position: int) -> str:
    return _COLOURS[position % len(_COLOURS)]


def _name(quantity: str, unit: str) -> str:
    return f"{quantity.replace('_', ' ')} [{unit.replace('^2', '²')}]"


def _density_name(unit: str) -> str:
    return f"PSD [({unit.replace('^2', '²')})²/Hz]"


def _grid(count: int, columns: int, width: float, height: float, **shared: Any) -> tuple[Figure, list[Axes]]:
    rows = -(-count // columns)
    figure = Figure(figsize=(width, height * rows), layout="constrained")
    axes = figure.subplots(rows, columns, squeeze=False, **shared).flatten()
    for unused in axes[count:]:
        unused.remove()
    return figure, list(axes[:count])


def draw_training(dataset: Dataset, result: Result) -> dict[str, Figure]:
    """All pictures of a training by file name: accelerations, psds, training, confusion, reliability."""
    makers: dict[str, Callable[[Dataset, Result], Figure]] = {
        "accelerations": _accelerations,
        "psds": _psds,
        "training": _training,
        "confusion": _confusion,
        "reliability": _reliability,
    }
    with _style():
        return {name: make(dataset, result) for name, make in makers.items()}


def _accelerations(dataset: Dataset, result: Result) -> Figure:
    """First calibration record of each class: the whole turn, and its first second."""
    codes = dataset.codes
    time = np.arange(dataset.records.shape[-1]) / dataset.sample_rate
    first_second = time <= 1.0
    figure, axes = _grid(2 * len(codes.classes), 2, 11, 1.7, sharex="col", sharey=True, width_ratios=(3, 2))
    for position, label in enumerate(codes.classes):
        row = int(np.flatnonzero((dataset.classes == label) & dataset.rows("calibration"))[0])
        whole, detail = axes[2 * position], axes[2 * position + 1]
        whole.plot(time, dataset.records[row].T, color=_colour(position), linewidth=0.6)
        detail.plot(time[first_second], dataset.records[row].T[first_second], color=_colour(position))
        whole.set_title(f"class {label}: {codes.names[position]} ({codes.codes[position]})")
        detail.set_title("its first second")
    for ax in axes[-2:]:
        ax.set_xlabel("time [s]")
    figure.supylabel(_name(dataset.quantity, dataset.unit), fontsize=9)
    return figure


def _psds(dataset: Dataset, result: Result) -> Figure:
    """Mean and range of the densities of each class's calibration records, the other classes' means
    behind.
    """
    model, codes = result.model, dataset.codes
    frequencies, means = _spectrum(model, model.mean_densities)
    figure, axes = _grid(len(codes.classes), 2, 11, 2.2, sharex=True, sharey=True)
    for position, (ax, label) in enumerate(zip(axes, codes.classes, strict=True)):
        rows = (dataset.classes == label) & dataset.rows("calibration")
        _, densities = _spectrum(model, model.features.density(dataset.records[rows], dataset.sample_rate))
        ax.semilogy(frequencies, means.T, color=_GREY, linewidth=0.6)
        ax.fill_between(
            frequencies,
            densities.min(axis=0),
            densities.max(axis=0),
            color=_colour(position),
            alpha=0.25,
            linewidth=0,
        )
        ax.semilogy(frequencies, means[position], color=_colour(position))
        ax.set_title(f"class {label}: {codes.names[position]}")
    figure.supxlabel("frequency [Hz]", fontsize=9)
    figure.supylabel(_density_name(dataset.unit), fontsize=9)
    count = int(dataset.rows("calibration").sum())
    words = f"mean (line) and range (band) of the {count} calibration records; grey: means of the other classes"
    figure.suptitle(words, fontsize=9)
    return figure


def _training(dataset: Dataset, result: Result) -> Figure:
    """Mean square errors over the epochs: the kept network, and the control errors of the other restarts."""
    training, kept = result.training, result.kept
    calibration, control = (100 * error for error in result.errors())
    figure, (ax,) = _grid(1, 1, 7, 4)
    for other in range(len(training.epochs)):
        if other != kept:
            label = "control, other restarts" if other == (kept == 0) else None
            ax.semilogy(control[:, other], color=_GREY, linewidth=0.6, label=label)
    ax.semilogy(calibration[:, kept], color=_COLOURS[0], label="calibration, kept network")
    ax.semilogy(control[:, kept], color=_COLOURS[4], label="control, kept network")
    best = training.best_epoch[kept]
    ax.axvline(best, color=_DARK, linewidth=0.8, linestyle=":", label=f"weights kept: epoch {best}")
    ax.set(xlabel="epoch", ylabel="mean square error [%]")
    ax.legend()
    return figure


def _confusion(dataset: Dataset, result: Result) -> Figure:
    """True against named class on each subset, counts of records."""
    labels = [str(label) for label in dataset.codes.classes]
    figure, axes = _grid(len(SUBSETS), len(SUBSETS), 11, 4)
    for ax, subset in zip(axes, SUBSETS, strict=True):
        score = result.score(subset)
        counts = np.array(score.confusion)
        ax.imshow(counts / counts.sum(axis=1, keepdims=True), cmap="Blues", vmin=0, vmax=1)
        for (true, named), count in np.ndenumerate(counts):
            colour = "white" if count > 0.5 * counts[true].sum() else _DARK
            if count:
                ax.text(named, true, str(count), ha="center", va="center", color=colour)
        ax.set_xticks(range(len(labels)), labels)
        ax.set_yticks(range(len(labels)), labels)
        ax.grid(visible=False)
        ax.set(xlabel="named class", ylabel="true class")
        ax.set_title(
            f"{subset}: {score.records} records\n"
            f"mean square error {score.mse_percent:.2f} %, misclassified {score.misclassified_percent:.1f} %"
        )
    return figure


def _reliability(dataset: Dataset, result: Result) -> Figure:
    """Share of names that are right over the confidence in them, on the validation records, and below how often each
    confidence comes: of the outputs as they stand, and at the temperature of the model where it has one.
    """
    model, rows = result.model, dataset.rows("validation")
    outputs = model.outputs(dataset.records[rows])
    right = model.codes.decode(outputs) == model.codes.positions(dataset.classes[rows])
    temperatures = {"outputs as they stand": 1.0}
    for part in model.parts:
        if isinstance(part, Confidence):
            temperatures[f"at the temperature {part.temperature:.3g}"] = part.temperature
    figure = Figure(figsize=(5.5, 6), layout="constrained")
    above, below = figure.subplots(2, sharex=True, height_ratios=(3, 1))
    above.plot([0, 1], [0, 1], color=_DARK, linewidth=0.8, linestyle=":", label="as sure as it should be")
    middles, width = (np.arange(BINS) + 0.5) / BINS, 0.4 / BINS
    for place, (words, temperature) in enumerate(temperatures.items()):
        confidence = softmax(class_logits(model.codes.matrix, outputs), temperature).max(axis=1)
        found, colour = reliability(confidence, right), _COLOURS[(4, 0)[place]]
        filled = found.share > 0
        label = f"{words}: calibration error {100 * found.error:.1f} %"
        above.plot(found.confidence[filled], found.right[filled], "o-", color=colour, markersize=5, label=label)
        below.bar(middles + (place - 0.5) * width, found.share, width, color=colour)
    above.set(ylabel="share that is right", ylim=(-0.03, 1.03))
    above.set_title(f"{len(outputs)} validation records, bins of {1 / BINS:g}")
    figure.legend(loc="outside lower center")
    below.set(xlabel="confidence in the named class", ylabel="share of records", xlim=(0, 1))
    return figure


def draw_diagnosis(model: Model, report: CaseReport) -> Figure:
    """The first diagnosed turn of a signal: its record, its PSD among the mean PSDs of the classes, the bands that
    spoke and the outputs beside the nearest code; with several turns what each was named.
    """
    shown = next(turn for turn in report.turns if turn.diagnosis is not None)
    diagnosis = shown.diagnosis
    assert diagnosis is not None and shown.record is not None
    several = len(report.turns) > 1
    with _style():
        figure = Figure(figsize=(11, 9.5 if several else 7.5), layout="constrained")
        heights = (1, 1.3, 0.6) if several else (1, 1.3)
        grid = figure.add_gridspec(len(heights), 3, width_ratios=(2, 1, 1), height_ratios=heights)

        ax = figure.add_subplot(grid[0, :])
        ax.plot(np.arange(model.samples) / model.sample_rate, shown.record.T, color=_DARK, linewidth=0.6)
        ax.set(xlabel="time in the turn [s]", ylabel=_name(model.quantity, model.unit))
        nearest = (
            f"nearest class {diagnosis.class_label}: distance {diagnosis.distance:.3f}, margin {diagnosis.margin:.3f}"
        )
        ax.set_title(f"turn {shown.turn}: {diagnosis.verdict} ({nearest})", fontweight="bold")
        figure.suptitle(report.name, fontsize=9)

        _densities(figure.add_subplot(grid[1, 0]), model, shown.record, diagnosis)
        _bands(figure.add_subplot(grid[1, 1]), diagnosis)
        _outputs(figure.add_subplot(grid[1, 2]), model, diagnosis)
        if several:
            _turns(figure.add_subplot(grid[2, :]), model, report)
    return figure


def _spectrum(model: Model, densities: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Frequencies and densities (n, count) to be drawn, with a gap between one channel and the next."""
    if model.channels == 1:
        return model.frequencies, densities
    each = densities.reshape(len(densities), model.channels, -1)
    frequencies = model.frequencies.reshape(1, model.channels, -1)
    gapped = (np.insert(part, part.shape[-1], np.nan, axis=-1).reshape(len(part), -1) for part in (frequencies, each))
    axis, values = gapped
    return axis[0], values


def _densities(ax: Axes, model: Model, record: np.ndarray, diagnosis: Diagnosis) -> None:
    frequencies, means = _spectrum(model, model.mean_densities)
    for position, label in enumerate(model.codes.classes):
        width = 2.0 if label == diagnosis.class_label else 0.8
        colour = _colour(position)
        ax.semilogy(frequencies, means[position], color=colour, linewidth=width, label=f"class {label}")
    _, density = _spectrum(model, model.features.density(record[None], model.sample_rate))
    ax.semilogy(frequencies, density[0], color="black", linewidth=1.2, label="record")
    ax.set(xlabel="frequency [Hz]", ylabel=_density_name(model.unit))
    ax.set_title("record among the mean PSDs of the classes")
    ax.legend(ncols=2)


def _bands(ax: Axes, diagnosis: Diagnosis) -> None:
    """What each band added to the agreement with the code."""
    values = [band.contribution for band in diagnosis.bands]
    colours = [_COLOURS[2] if value >= 0 else _COLOURS[4] for value in values]
    ax.barh([f"{band.low_hz:g}–{band.high_hz:g}" for band in diagnosis.bands], values, color=colours)
    ax.axvline(0.0, color=_DARK, linewidth=0.8)
    ax.set(xlabel="contribution to the agreement", ylabel="band [Hz]")
    ax.set_title("the bands that spoke")


def _outputs(ax: Axes, model: Model, diagnosis: Diagnosis) -> None:
    nodes = np.arange(1, model.codes.bits + 1)
    named = model.codes.classes.index(diagnosis.class_label)
    ax.bar(nodes, diagnosis.outputs, color=_colour(named), width=0.6, label="output")
    code = [int(bit) for bit in diagnosis.code]
    ax.plot(nodes, code, linestyle="none", marker="_", markersize=20, color="black", label="nearest code")
    ax.set_xticks(nodes, [f"{node}\n{value:.2f}" for node, value in zip(nodes, diagnosis.outputs, strict=True)])
    ax.set(xlabel="output node", ylabel="output", ylim=(-0.05, 1.3))
    ax.set_title(f"outputs and code {diagnosis.code}")
    ax.legend(loc="upper center", ncols=2, columnspacing=0.8, handlelength=1.2)


def _turns(ax: Axes, model: Model, report: CaseReport) -> None:
    """What each turn was named; a cross where it is none of the classes, a grey stretch where it was not diagnosed."""
    for turn in report.turns:
        if turn.diagnosis is None:
            ax.axvspan(turn.start, turn.start + turn.duration, color=_GREY, linewidth=0)
            continue
        position = model.codes.classes.index(turn.diagnosis.class_label)
        marker, middle = ("x" if turn.diagnosis.is_novel else "o"), turn.start + turn.duration / 2
        ax.plot(middle, position, marker, color=_colour(position), markersize=5)
    ax.set_yticks(range(len(model.codes.classes)), [f"class {label}" for label in model.codes.classes])
    end = report.turns[-1].start + report.turns[-1].duration
    ax.set(xlabel="time [s]", xlim=(0.0, end), ylim=(-0.5, len(model.codes.classes) - 0.5))
    ax.set_title("each turn: circle: its class; cross: none of the classes taught; grey: not diagnosed")
