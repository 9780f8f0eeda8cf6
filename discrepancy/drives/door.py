"""The subject of a drive from the command's configuration: all that refuses its file or its records is here."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from discrepancy.drives.both_forms import check_held, said_of_offsets, said_of_places, said_of_slow_channels
from discrepancy.drives.channels import Record, read_drive_records
from discrepancy.drives.description import LOAD, Drive, load_drive
from discrepancy.drives.inverse import InverseModel
from discrepancy.drives.second_look import known_effects, looked_at
from discrepancy.drives.sessions import check_sessions
from discrepancy.drives.subject import DriveSubject
from discrepancy.drives.track import Track, tracks_of
from discrepancy.drives.unplaced import check_unplaced
from discrepancy.drives.windows import Windows, split
from discrepancy.records.machine import DRIVE
from discrepancy.subjects.base import Subject
from indexer_cli.arguments import copied_from
from indexer_cli.job_paths import files_given, path_given, texts_given
from indexer_cli.words import joined
from indexer_env.errors import SignalError, refuse

_KEYS = (
    "system", "measured", "records", "held_out", "machine", "known", "out", "overwrite", "seed", "seconds", "tolerance",
)  # fmt: skip
"""Keys of conf/explain.yaml that a drive takes; the others belong to the indexing machine."""

_KNOWN = ("noise", "sample_rate")
"""Of those under `known`, beside the names of channels."""

_LEAST = 20
"""Samples of a window."""

_AGAINST = -0.5
"""Correlation of a record's force with the equation's below which its sign seems to be the other one."""


def drive_subject(config: Mapping[str, Any]) -> Subject:
    """The subject of a composed conf/explain.yaml with system=FILE.py.

    Raises
    ------
    ParameterError, SignalError
        What keeps the drive's file or its records from being used, before any fit.
    """
    _refuse_others(config)
    drive = load_drive(Path(config["system"]))
    machine = config["machine"] if DRIVE in config["machine"] else {}
    table = None if config["records"] is None else path_given("discrepancy", "records", config["records"])
    known = {key: value for key, value in config["known"].items() if value is not None}
    for key in known:
        if key not in _KNOWN:
            raise refuse("known", key, f"left out for a drive, which takes {' and '.join(_KNOWN)}", known[key])
    measured = files_given("discrepancy", "measured", config["measured"])
    held_out = texts_given("discrepancy", "held_out", config["held_out"], "a list of files or motions, [a.csv,b.csv]")
    records = read_drive_records(drive, measured, table, known, held_out)
    return subject_of(drive, records, machine)


def subject_of(drive: Drive, records: Sequence[Record], machine: Mapping[str, Any] | None = None) -> Subject:
    """The subject of a drive and its records; `machine` is what a first look has left (machine.yaml), if any."""
    drive = looked_at(drive, machine) if machine else drive
    if drive.forward:
        from discrepancy.drives.forward_subject import forward_subject

        return forward_subject(drive, records, machine or {})
    check_held(drive, [role for role in records[0].rows if role not in ("q", "v", "a", LOAD[0])])
    tracks, scales = tracks_of(drive, records)
    lengths, kept = [len(t.measured) for t in tracks], [r.held_out for r in records]
    moving = [~t.rest[t.at] for t in tracks]
    fitted, held, parts = split(lengths, kept, drive.held_out, [_LEAST] * len(tracks), moving=moving)
    model = InverseModel(drive, tracks, scales, fitted)
    library = model.hypotheses()
    if known := known_effects(drive, machine or {}, library):
        model = InverseModel(drive, tracks, scales, fitted, known)
        library = model.hypotheses()
    check_sessions(drive, model.known)
    if any(model.effects[one.name].acts == "dry" for one in model.known):
        _check_moves(tracks, fitted, "fitted")
        _check_moves(tracks, held, "held out")
    other = InverseModel(drive, tracks, scales, held, model.known, library)
    check_unplaced(model)
    notes = (*_notes(model, tracks, held, parts), *said_of_offsets(records), *said_of_slow_channels(records))
    return DriveSubject(drive, model, other, notes, [record.rate for record in records])


def _check_moves(tracks: Sequence[Track], windows: Windows, what: str) -> None:
    """Refuse a standstill throughout: dry friction holds a drive at rest against whatever is measured."""
    parts = zip(windows.track, windows.first, windows.count, strict=True)
    if all(tracks[k].rest[tracks[k].at][first : first + count].all() for k, first, count in parts):
        names = joined([tracks[k].name for k in windows.tracks])
        raise SignalError(
            f"{names}: what is {what} must move, as dry friction is known and takes any force at rest, got a "
            "standstill throughout; choose other records or another held_out."
        )


def _likeness(model: InverseModel, track: Track) -> float:
    """Correlation of a record's force with that of the equation at nominal parameters."""
    asked = model.base(track, tuple(p.nominal for p in model.drive.parameters))(track.q, track.v, track.a)
    rows = [row[track.at] - row[track.at].mean() for row in (asked, track.force)]
    size = float(np.prod([np.linalg.norm(row) for row in rows]))
    return float(rows[0] @ rows[1]) / size if size > 0.0 else 0.0


def _notes(model: InverseModel, tracks: Sequence[Track], held: Windows, parts: bool) -> tuple[str, ...]:
    track = tracks[0]
    notes = [
        f"Motion and force are compared below {track.cutoff:.3g} Hz; the noise of the force there is "
        f"{model.noise[0]:.2g} {model.scales.force_unit}."
    ]
    if any(t.deflection is not None and abs(float(np.mean(t.deflection))) > model.scales.D for t in tracks):
        notes.append(
            "The encoders of drive and load differ by more than the joint's deflections: if they are zeroed elsewhere, "
            "subtract a parameter for it in the equation."
        )
    notes += said_of_places(model.drive, ["q"], len(tracks))
    if against := [t.name for t in tracks if _likeness(model, t) < _AGAINST]:
        notes.append(
            f"The force of {joined(against)} runs against what the equation asks at nominal parameters: if its sign is "
            "the other one, give its channel the factor -1."
        )
    if parts:
        notes.append("No record was held out, so the last part of each is: other times, not other conditions.")
        ends = {k: round((1.0 - model.drive.held_out) * len(t.measured)) for k, t in enumerate(tracks)}
        if standing := [tracks[k].name for k in held.tracks if held.first[held.track == k].min() != ends[k]]:
            notes.append(f"Of {joined(standing)} it is the last part of the time in which it moves, as it stands long.")
    if model.falling:
        notes.append(
            f"The force's noise falls with frequency in {joined(model.falling)}; it is estimated just above the "
            "cut-off, within a factor of two: record the force unfiltered, or state its noise."
        )
    if model.drive.sessions:
        notes.append(f"Each record has its own: {', '.join(model.drive.sessions)}.")
    if model.left_out:
        names = ", ".join(model.left_out)
        notes.append(f"Not looked for, as the drive's own parameters do the same: {names}.")
    return tuple(notes)


def _refuse_others(config: Mapping[str, Any]) -> None:
    from hydra.core.hydra_config import HydraConfig

    if not HydraConfig.initialized():
        return
    for override in HydraConfig.get().overrides.task:
        key = override.lstrip("+~").partition("=")[0]
        if key.partition(".")[0] not in _KEYS:
            raise refuse("discrepancy", key, "left out for a drive, which has no such thing", override)
        if key == "machine" and DRIVE not in config["machine"]:
            rule = "left out for a drive, or the machine.yaml that an earlier look at it has left"
            choice = override.partition("=")[2]
            typed = copied_from("machine", choice, HydraConfig.get().searchpath)
            raise refuse("discrepancy", "machine", rule, typed or choice)
