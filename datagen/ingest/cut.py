"""One measured file -> its turns as rows with records, or the sentence that refuses the file or one of them."""

from __future__ import annotations

import hashlib
import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field, replace
from typing import Any

import numpy as np

from datagen.campaign import Label
from datagen.ingest.settings import CAMPAIGN, Settings
from datagen.ingest.sources import Source
from datagen.ingest.split import groups_text
from datagen.rows import label_columns, version_columns
from indexer_env.build import from_mapping
from indexer_env.errors import SignalError
from indexer_env.signal import Signal
from indexer_env.units import RPM
from indexer_records.channels import channels_text
from indexer_records.conditions import RecordConditions
from indexer_records.measured import Recording, read_recording
from indexer_records.quality import worst_quality
from indexer_records.resample import resampled
from indexer_records.turns import Turn, pulse_edges, turns_by_period, turns_by_pulse

_OF_SIMULATION = ("numba_version",)


@dataclass(frozen=True)
class Cut:
    """What one file gave: each turn or refusal in the order of the file, and how many partial turns were left out.

    `rows` holds rows without their record and rows of rejected.parquet, both without their item; `records` the record
    of each of the former, None for the latter.
    """

    rows: Sequence[Mapping[str, Any]]
    records: Sequence[np.ndarray | None]
    partial_turns: int = 0


@dataclass
class Seen:
    """What is known of the files before.

    Attributes
    ----------
    names : dict
        Their names by the SHA-256 of their bytes, to tell a copy.
    unit : tuple of str or None
        The unit of all records and the file that gave it, the first with a record.
    """

    names: dict[str, str] = field(default_factory=dict)
    unit: tuple[str, str] | None = None


def cut(source: Source, label: Label, settings: Settings, seen: Seen) -> Cut:
    """Read, cut and resample one file; what is wrong with it is in the answer. `seen` takes it up."""
    try:
        digest = _digest(source, seen.names)
        recording = read_recording(source.path, source.reading(settings.read), settings.pulse.column)
        _check_speed(source, settings)
        _check_unit(source, recording, seen)
        turns, partial = _turns(recording, settings)
        good = [turn for turn in turns if not turn.problem]
        found = iter(_records(recording, good, settings))
    except SignalError as error:
        # Paths differ between machines; the same files give the same bytes.
        reason = str(error).replace(str(source.path), source.name)
        return Cut([_rejected(source, label, settings, "file", reason)], [None])
    common = _columns(source, label, settings, recording) | {"source_sha256": digest}
    rows: list[Mapping[str, Any]] = []
    records: list[np.ndarray | None] = []
    for turn in turns:
        record = None if turn.problem else next(found)
        own_samples = [_own_samples(signal, turn) for signal in recording.signals]
        reason = turn.problem or _flaw(own_samples, record)
        if reason:
            sentence = f"{source.name}: the turn that begins at {turn.start:.6g} s {reason}."
            rows.append(_rejected(source, label, settings, "turn", sentence, turn.start))
            records.append(None)
        else:
            own = {"source_start": turn.start, "source_duration": turn.duration}
            # Of the file's own samples: a filter rounds flat tops.
            rows.append({**common, **worst_quality(own_samples), **own})
            records.append(record)
            seen.unit = seen.unit or (recording.signals[0].unit, source.name)
    return Cut(rows, records, partial)


def _digest(source: Source, seen: dict[str, str]) -> str:
    try:
        with source.path.open("rb") as file:
            digest = hashlib.file_digest(file, "sha256").hexdigest()
    except OSError as error:
        raise SignalError(f"{source.path} cannot be read ({error.strerror}); check its permissions.") from None
    first = seen.setdefault(digest, source.name)
    if first != source.name:
        raise SignalError(
            f"{source.path} must differ from the other files, got the same bytes as {first}; remove the copy."
        )
    return digest


def _check_speed(source: Source, settings: Settings) -> None:
    """Refuse a file that is labelled with another speed than that by which turns are cut."""
    own, cut_by = from_mapping(RecordConditions, source.known, "known").motor_speed, settings.known.motor_speed
    if settings.motor_turns is None or own is None or cut_by is None:
        return
    if abs(own / cut_by - 1.0) > settings.pulse.tolerance:
        raise SignalError(
            f"{source.path} must be of {cut_by / RPM:.6g} rpm (known.motor_speed_rpm), by which turns are cut, got "
            f"{own / RPM:.6g} rpm in the labels; ingest files of other speeds by themselves."
        )


def _check_unit(source: Source, recording: Recording, seen: Seen) -> None:
    """Refuse a file of another unit than the records before it, which would be compared with them sample by sample."""
    unit = recording.signals[0].unit
    if seen.unit is not None and unit != seen.unit[0]:
        raise SignalError(
            f"{source.path} must be in {seen.unit[0]} as {seen.unit[1]}, got {unit}; ingest files of other units by "
            "themselves."
        )


def _turns(recording: Recording, settings: Settings) -> tuple[list[Turn], int]:
    signal, period = recording.signals[0], settings.turn_duration
    if recording.pulse is None:
        turns, partial = turns_by_period(signal.duration, period)
    else:
        try:
            edges = pulse_edges(recording.pulse, signal.sample_rate, settings.pulse)
        except SignalError as error:
            raise SignalError(f"{signal.source}: {error}") from None
        turns, partial = turns_by_pulse(edges, period, settings.pulse.tolerance)
    if not turns:
        raise SignalError(
            f"{signal.source} must last {period:g} s, one turn of the table, got {signal.duration:g} s; "
            "record for longer."
        )
    return turns, partial


def _records(recording: Recording, turns: Sequence[Turn], settings: Settings) -> np.ndarray:
    """The record of each turn (turns, channels · samples), channel after channel."""
    samples, rate = settings.grid.samples, settings.grid.rate
    if not turns:
        return np.empty((0, samples), dtype=np.float32)
    starts, durations = (np.array([getattr(turn, name) for turn in turns]) for name in ("start", "duration"))
    # By the pulse, samples lie evenly over the turn; by the period, at the rate exactly.
    by_pulse = recording.pulse is not None
    steps = durations / samples if by_pulse else np.full(len(turns), 1.0 / rate)
    try:
        channels = [
            resampled(signal.values, signal.sample_rate, rate, starts, steps, samples) for signal in recording.signals
        ]
    except SignalError as error:
        raise SignalError(f"{recording.signals[0].source}: {error}") from None
    records = np.concatenate(channels, axis=1)
    with np.errstate(over="ignore"):
        return records.astype(np.float32)


def _own_samples(signal: Signal, turn: Turn) -> np.ndarray:
    """The samples of the file between the turn's begin and end, one at least."""
    first = math.ceil(turn.start * signal.sample_rate - 1e-6)
    return signal.values[first : max(first + 1, math.ceil((turn.start + turn.duration) * signal.sample_rate - 1e-6))]


def _flaw(own_samples: Sequence[np.ndarray], record: np.ndarray | None) -> str:
    if any(np.ptp(samples) == 0.0 for samples in own_samples):
        return "must vary, got one value throughout; check the sensor and its cable"
    if not np.isfinite(record).all():  # type: ignore[arg-type]
        return "must stay within the range of float32, got a larger number"
    return ""


def _columns(source: Source, label: Label, settings: Settings, recording: Recording) -> dict[str, Any]:
    signal = recording.signals[0]
    own = asdict(from_mapping(RecordConditions, source.known, "known"))
    known = replace(settings.known, **{name: value for name, value in own.items() if value is not None})
    versions = {name: value for name, value in version_columns().items() if name not in _OF_SIMULATION}
    return {
        "kind": "measured",
        "campaign": CAMPAIGN,
        "seed": settings.seed,
        "sample_rate": settings.sample_rate,
        "quantity": signal.quantity,
        "unit": signal.unit,
        **label_columns(label),
        "motor_speed": known.motor_speed,
        "load_torque": known.load_torque,
        "sensor_radius": known.sensor_radius,
        **source.faults,
        "source": source.name,
        "source_channel": channels_text(recording.channels),
        "source_rate": signal.sample_rate,
        "groups": groups_text(source),
        **versions,
    }


def _rejected(
    source: Source, label: Label, settings: Settings, stage: str, reason: str, start: float | None = None
) -> dict[str, Any]:
    place = {"source": source.name, "source_start": start, "groups": dict(source.groups)}
    columns = {name: value for name, value in label_columns(label).items() if name != "remaining_turns"}
    return {
        "seed": settings.seed,
        **columns,
        "stage": stage,
        "reason": reason,
        "draws": json.dumps(place, ensure_ascii=False),
    }
