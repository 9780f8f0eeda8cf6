"""Measured files and their conditions -> records."""

from __future__ import annotations

import dataclasses
import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from discrepancy.records.conditions import TABLES, Conditions, conditions_of, table_beside, written
from indexer_env.errors import SignalError, refuse
from indexer_env.signal import Signal
from indexer_records.conditions import Pulse
from indexer_records.file_table import common_folder, files_found
from indexer_records.measured import read_recording
from indexer_records.turns import pulse_edges


@dataclass(frozen=True, eq=False)
class Record:
    """A measured record with what was known when it was taken.

    Attributes
    ----------
    name : str
        Its file, as below the folder of them all.
    signal : Signal
    conditions : Conditions
    pulses : ndarray (k,) or None
        Times of the once-per-turn pulses after the first sample [s].
    """

    name: str
    signal: Signal
    conditions: Conditions
    pulses: np.ndarray | None = None


def read_records(
    measured: str | Sequence[str], table: Path | None, known: Mapping[str, Any], pulse: Pulse, held_out: Sequence[str]
) -> list[Record]:
    """Records that a folder, a pattern or a list of files names.

    Parameters
    ----------
    measured : str or sequence of str
    table : Path or None
        Table of conditions; None: `records.csv` or `records.yaml` beside the files, where there is one.
    known : mapping
        Conditions of all files, by the names of `Conditions`.
    pulse : Pulse
        The once-per-turn pulse; no column: none.
    held_out : sequence of str
        Files to hold out besides those the table says.

    Raises
    ------
    SignalError, ParameterError
        No file, a table or file that cannot be used, the same samples twice, or whatever keeps a file from being one.
    """
    paths, root = measured_paths(measured)
    table = table or table_beside(paths, root)
    paths = [path for path in paths if path.name not in TABLES and (table is None or path.resolve() != table.resolve())]
    if not paths:
        raise refuse("discrepancy", "measured", "one measured file or more", str(measured), "only the table is there")
    names = [path.relative_to(root).as_posix() for path in paths]
    conditions = conditions_of(names, table, known)
    for name, told in conditions.items() if pulse.column is None else ():
        if told.pulse_angle is not None:
            raise SignalError(
                f"{name}: pulse_angle must be left out where no channel has the pulse, got {told.pulse_angle:g} rad; "
                "name the channel by pulse.column=NAME."
            )
    kept = {name for wanted in held_out for name in _meant(names, wanted)}
    records, seen = [], dict[bytes, str]()
    for name, path in zip(names, paths, strict=True):
        recording = read_recording(path, conditions[name].reading, pulse.column)
        check_new(path, name, recording.signal.values.tobytes(), seen)
        edges = None if recording.pulse is None else _edges(recording.pulse, recording.signal, pulse)
        told = conditions[name]
        noise = None if told.noise is None else told.noise * abs(recording.factor)
        told = dataclasses.replace(told, noise=noise, held_out=told.held_out or name in kept)
        records.append(Record(name, recording.signal, told, edges))
    return records


def measured_paths(measured: str | Sequence[str]) -> tuple[list[Path], Path]:
    """The files that `measured` means, a folder, a pattern or a list, and the folder of them all."""
    if isinstance(measured, str):
        root, paths = files_found("discrepancy", "measured", measured)
        return paths, root
    paths = [Path(name).absolute() for name in measured]
    for path in paths:
        if not path.is_file():
            raise refuse("discrepancy", "measured", "files that exist", str(path), "check the path")
        if paths.count(path) > 1:
            raise refuse("discrepancy", "measured", "different files", str(path), "it is there twice; leave one out")
    return paths, common_folder(paths)


def check_new(path: Path, name: str, samples: bytes, seen: dict[bytes, str]) -> None:
    """Refuse the samples of another file, which `seen` names by their digest: a copy is no new evidence."""
    first = seen.setdefault(hashlib.sha256(samples).digest(), name)
    if first != name:
        raise SignalError(
            f"{path} must differ from the other files, got the same samples as {first}; remove the copy and its row."
        )


def _meant(names: Sequence[str], given: str) -> list[str]:
    """The files meant by a name as a user writes it: the one of that name, or those whose path ends with it or that it
    ends with."""
    wanted = written(given)
    meant = [name for name in names if name == wanted]
    meant = meant or [name for name in names if name.endswith(f"/{wanted}") or wanted.endswith(f"/{name}")]
    if not meant:
        raise refuse("discrepancy", "held_out", f"files among {', '.join(names)}", given)
    return meant


def _edges(pulse: np.ndarray, signal: Signal, settings: Pulse) -> np.ndarray:
    try:
        return pulse_edges(pulse, signal.sample_rate, settings, least=1)
    except SignalError as error:
        raise SignalError(f"{signal.source}: {error}") from None
