"""Diagnosis of one measured record: ``python -m classifier.diagnose model=DIR signal=FILE out=DIR``."""

from __future__ import annotations

import json
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from classifier.model import Model, load_model
from datagen.output_folder import check_output_folder, output_folder
from datagen.command import check_flag, hydra_command
from datagen.job_paths import job_folder, path_given
from datagen.measured import RATE_TOLERANCE, Reading, read_signal
from indexer_env.build import from_mapping
from indexer_env.errors import SignalError
from indexer_env.signal import Signal

DIAGNOSIS_JSON = "diagnosis.json"
DIAGNOSIS_PNG = "diagnosis.png"
FILES = (DIAGNOSIS_JSON, DIAGNOSIS_PNG)
"""All that the command leaves in its folder."""


@dataclass(frozen=True)
class Diagnosis:
    """What a classifier says of one record.

    class_label, class_name, code  the class whose code lies nearest to the outputs
    outputs                        outputs of the network, one per bit, each in [0, 1]
    distance                       Euclidean distance of the outputs from that code; 0 where they agree fully
    margin                         how much farther the second nearest code is; 0 at a tie, 1 between codes
                                   that differ in one bit and are hit exactly
    second_name                    name of the class with the second nearest code
    used_duration, duration        time diagnosed (one turn from the start) and time recorded [s]
    source                         where the record came from

    Distance and margin are measures of agreement, not probabilities: a fault that the classifier was never
    taught can lie near one of its codes.
    """

    class_label: int
    class_name: str
    code: str
    outputs: tuple[float, ...]
    distance: float
    margin: float
    second_name: str
    used_duration: float
    duration: float
    source: str


def check_fits(model: Model, signal: Signal) -> None:
    """Refuse a record that this classifier was not made for.

    Raises SignalError for another quantity, unit or rate, for less than one turn, and for a dead sensor.
    """
    name = signal.source or "the record"
    if (signal.quantity, signal.unit) != (model.quantity, model.unit):
        raise SignalError(
            f"{name} must be {model.quantity} in {model.unit} as the model was trained on, "
            f"got {signal.quantity} in {signal.unit}; convert it (angular = tangential / radius) or train on "
            "records of such a sensor."
        )
    if abs(signal.sample_rate - model.sample_rate) > RATE_TOLERANCE * model.sample_rate:
        raise SignalError(
            f"{name} must be sampled at {model.sample_rate:g} Hz as the model was trained on, "
            f"got {signal.sample_rate:g} Hz; resample it or train on records of that rate."
        )
    needed = model.samples / model.sample_rate
    if signal.duration < needed * (1 - RATE_TOLERANCE):
        raise SignalError(
            f"{name} must last at least {needed:g} s as the records the model was trained on, "
            f"got {signal.duration:g} s; record a whole turn of the table."
        )
    if np.ptp(signal.values) == 0.0:
        raise SignalError(
            f"{name} must vary, got {signal.values.size} samples of {signal.values[0]:g} {signal.unit}; "
            "check the sensor and its cable."
        )


def diagnose(model: Model, signal: Signal) -> Diagnosis:
    """Diagnose the first turn of a record, that is, the length of the records the model was trained on.

    Raises SignalError for a record that does not fit the model.
    """
    check_fits(model, signal)
    used = signal.values[: model.samples]
    outputs = model.outputs(used[None])
    distances = model.codes.distances(outputs)[0]
    order = np.argsort(distances, kind="stable")
    nearest, second = int(order[0]), int(order[1])
    return Diagnosis(
        class_label=model.codes.classes[nearest],
        class_name=model.codes.names[nearest],
        code=model.codes.codes[nearest],
        outputs=tuple(float(value) for value in outputs[0]),
        distance=float(distances[nearest]),
        margin=float(distances[second] - distances[nearest]),
        second_name=model.codes.names[second],
        used_duration=used.size / signal.sample_rate,
        duration=signal.duration,
        source=signal.source,
    )


def lines(diagnosis: Diagnosis) -> list[str]:
    """A diagnosis in words, one line each."""
    outputs = "  ".join(f"{value:.4f}" for value in diagnosis.outputs)
    return [
        f"record    {diagnosis.source or '-'}",
        f"used      first {diagnosis.used_duration:g} s of {diagnosis.duration:g} s",
        f"class     {diagnosis.class_label}: {diagnosis.class_name}",
        f"code      {'  '.join(f'{bit:6s}' for bit in diagnosis.code)}".rstrip(),
        f"outputs   {outputs}",
        f"distance  {diagnosis.distance:.4f} from this code",
        f"margin    {diagnosis.margin:.4f} to the next: {diagnosis.second_name}",
    ]


def run(config: dict[str, Any]) -> None:
    """The command, given its configuration as in conf/diagnose.yaml."""
    check_flag("diagnose", "overwrite", config["overwrite"])
    out = None if config["out"] is None else job_folder("diagnose", config["out"])
    if out is not None:
        check_output_folder(out, FILES, config["overwrite"])
    model = load_model(path_given("diagnose", "model", config["model"]))
    signal = read_signal(
        path_given("diagnose", "signal", config["signal"]), **asdict(from_mapping(Reading, config["read"], "read"))
    )
    diagnosis = diagnose(model, signal)
    print("\n".join(lines(diagnosis)))
    if out is None:
        return
    # Drawing is loaded only where a picture is wanted: it takes longer than the diagnosis.
    from classifier.pictures import draw_diagnosis

    with output_folder(out, FILES, config["overwrite"]) as folder:
        text = json.dumps({**asdict(diagnosis), "model": str(config["model"])}, indent=2, ensure_ascii=False)
        (folder / DIAGNOSIS_JSON).write_text(text + "\n", encoding="utf-8")
        draw_diagnosis(model, signal, diagnosis).savefig(folder / DIAGNOSIS_PNG)
    print(f"written   {out}")


main = hydra_command("diagnose")(run)

if __name__ == "__main__":
    main()
