"""What the command is to diagnose: files, patterns, folders and data sets as signals, one at a time."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from classifier.conditions import TOLERANCE
from classifier.dataset import manifest_sha256, rows_sha256
from classifier.diagnose.incremental import TurnReport, diagnose
from classifier.model import Model
from datagen.schema import RECORD
from datagen.shard import iterate_shards, read_manifest, records_of
from datagen.store import MANIFEST
from indexer_cli.places import open_place
from indexer_env.errors import SignalError, refuse
from indexer_env.signal import Signal
from indexer_records.conditions import Pulse, RecordConditions
from indexer_records.file_table import files_found
from indexer_records.measured import Reading, read_recording
from indexer_records.resample import resampled


@dataclass(frozen=True)
class Asked:
    """What the command says of all signals: how to read files, where turns begin, what is known beside the samples."""

    read: Reading
    pulse: Pulse
    known: RecordConditions


@dataclass(frozen=True)
class Case:
    """A signal before it is opened.

    name        what reports call it
    true_class  the name of its class as its data set says; None: not known
    known       what is known of it beside its samples
    reports     opens it and diagnoses every turn; raises SignalError for one that cannot be used
    subset      the one that it was in when the model learnt; None: the model has not learnt from its data set
    """

    name: str
    true_class: str | None
    known: RecordConditions
    reports: Callable[[], Sequence[TurnReport]]
    subset: str | None = None


def cases_of(signal: object, asked: Asked, model: Model) -> Iterator[Case]:
    """The cases that `signal` names for a model: a file, a list of files, a pattern, a folder of files, or a data set.

    Raises ParameterError where it names nothing, SignalError for a data set that cannot be read.
    """
    names: list[Any] = signal if isinstance(signal, list) else [signal]
    wrong = [name for name in names if not isinstance(name, str) or not name.strip()]
    if wrong or not names:
        rule = "a file, a list of files, a pattern, a folder or a data set"
        remedy = "write measured=./NAME for a name that reads as something else"
        raise refuse("diagnose", "measured", rule, wrong[0] if wrong else signal, remedy)
    for name in names:
        if (Path(name) / MANIFEST).is_file():
            yield from _rows(Path(name), asked, model)
        elif Path(name).is_file():
            yield _file(Path(name), asked, model)
        else:
            yield from (_file(path, asked, model) for path in _named(name))


def _named(name: str) -> list[Path]:
    # A name without a sign of a pattern is a path that is not there: the reader says so best.
    if not Path(name).is_dir() and not set(name) & set("*?["):
        return [Path(name)]
    return files_found("diagnose", "measured", name)[1]


def _file(path: Path, asked: Asked, model: Model) -> Case:
    def reports() -> list[TurnReport]:
        recording = read_recording(path, asked.read, asked.pulse.column)
        return diagnose(model, recording.signals, asked.known, recording.pulse, asked.pulse)

    return Case(str(path), None, asked.known, reports)


def _known(key: str, stated: Any, given: Any, name: str) -> Any:
    """What the row states, else what was given with `known.`, which may not contradict it."""
    if not stated or given is None:
        return stated or given
    alike = stated == given if key == "machine" else abs(stated - given) <= TOLERANCE[key] * abs(stated)
    if not alike:
        rule = f"{stated if key == 'machine' else format(stated, '.6g')} as {name} states it"
        raise refuse("known", key, rule, given, "leave it out, or give the files themselves")
    return stated


def _refuse_idle(asked: Asked, folder: Path) -> None:
    """How to read files says nothing of records that were read already."""
    read_already = replace(asked.pulse, tolerance=Pulse.tolerance)  # the one that bounds their duration
    for section, got, usual in (("read", asked.read, Reading()), ("pulse", read_already, Pulse())):
        for key, value in vars(got).items():
            if value != getattr(usual, key):
                rule = f"left out for the data set {folder}, whose records are read and cut already"
                raise refuse(section, key, rule, value, "give its files themselves, or ingest them again")


def _rows(folder: Path, asked: Asked, model: Model) -> Iterator[Case]:
    _refuse_idle(asked, folder)
    place = open_place(folder)
    learnt = model.items_learnt(manifest_sha256(place), rows_sha256(read_manifest(place)))
    for table in iterate_shards(folder):
        records = records_of(table, str(folder))
        for row, record in zip(table.drop_columns([RECORD]).to_pylist(), records, strict=True):
            yield replace(
                _row(folder, row, record, asked, model), subset=row["subset"] if row["item"] < learnt else None
            )


def _of_one_turn(values: np.ndarray, rate: float, turn: float) -> np.ndarray:
    """A record of a turn (n,) as one that lasts `turn` [s], as turns between pulses are made: the table turned a little
    faster or slower."""
    samples = round(turn * rate)
    if samples == len(values):
        return values
    step = len(values) / rate / samples
    return resampled(values.astype(float), rate, rate, np.zeros(1), np.array([step]), samples)[0]


def _row(folder: Path, row: dict[str, Any], record: np.ndarray, asked: Asked, model: Model) -> Case:
    name = f"{folder}, item {row['item']}"
    stated = RecordConditions(
        motor_speed=_known("motor_speed", row["motor_speed"], asked.known.motor_speed, name),
        sensor_radius=_known("sensor_radius", row["sensor_radius"], asked.known.sensor_radius, name),
        machine=_known("machine", row["machine_name"], asked.known.machine, name),
    )

    def reports() -> list[TurnReport]:
        lasts, turn = record.shape[-1] / row["sample_rate"], model.samples / model.sample_rate
        if abs(lasts - turn) > asked.pulse.tolerance * turn:
            raise SignalError(
                f"{name} must last {turn:g} s within {100 * asked.pulse.tolerance:g} %, one turn as the model was "
                f"trained on, got {lasts:g} s; train on records of this speed or machine."
            )
        signals = [
            Signal(
                _of_one_turn(channel, row["sample_rate"], turn), row["sample_rate"], row["quantity"], row["unit"], name
            )
            for channel in np.atleast_2d(record)
        ]
        told = diagnose(model, signals, stated)
        # A measured record went through a filter, which hides flat tops that its file had.
        flaw = model.conditions.flaw(row["clipped_share"], row["constant_share"])
        return [replace(one, problem=flaw, diagnosis=None, record=None) for one in told] if flaw else told

    return Case(name, row["class_name"], stated, reports)
