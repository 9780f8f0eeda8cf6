"""Measured files of many formats -> `MeasuredTable`: named columns with units, sampling rate where the file has it.

In reading order:
    table          MeasuredTable and Column, what every reader gives
    kind           Format: what a reader tells the door about its files
    gate           exceptions of foreign libraries -> one sentence, in this one place
    csv            CSV as data loggers write it
    parquet        Parquet
    mat            MAT up to version 7 (scipy.io)
    hdf5           HDF5, and with it MAT 7.3 (h5py)
    tdms           TDMS of LabVIEW (npTDMS)
    uff            universal files (UFF), data set 58 and 58b (pyuff)
    wav            WAV (soundfile)
    worker         the process in which libraries read that may hang or crash

A file's format is told by how it begins. Where its ending names another one than CSV, whose .txt and .dat are
anybody's, the two must agree: a damaged file of one format is never taken for one of another. Adding a format is one
file here and its line in `FORMATS`.
"""

from __future__ import annotations

from pathlib import Path

from indexer_env.errors import SignalError
from indexer_records.formats import csv, hdf5, mat, parquet, tdms, uff, wav
from indexer_records.formats.gate import damaged
from indexer_records.formats.kind import HEAD, Format
from indexer_records.formats.table import LARGEST_CONTENT, MeasuredTable
from indexer_records.formats.worker import read_apart

FORMATS: dict[str, Format] = {module.FORMAT.name: module.FORMAT for module in (parquet, mat, hdf5, tdms, uff, wav, csv)}
"""Formats by name, in the order in which a file is tried; CSV takes what no other begins."""

SUFFIXES = tuple(sorted({suffix for kind in FORMATS.values() for suffix in kind.suffixes}))
"""Endings of the files that can be read."""


def read_table(path: str | Path) -> MeasuredTable:
    """Open a measured file.

    Raises
    ------
    SignalError
        Missing, empty, too large or damaged file, or one of unknown format; a library that is not installed.
    """
    path = Path(path)
    kind = format_of(path)
    return read_apart(path, kind.name) if kind.apart else kind.table(path)


def format_of(path: Path) -> Format:
    """The format of a file.

    Raises
    ------
    SignalError
        There is no such file, it cannot be read, is empty or too large, or its ending names another format than its
        first bytes.
    """
    known = ", ".join(FORMATS)
    if not path.exists():
        raise SignalError(f"{path} does not exist; give the path of a measured file ({known}).")
    if path.is_dir():
        raise SignalError(f"{path} is a folder; give the path of one measured file in it.")
    if not path.is_file():
        raise SignalError(f"{path} is no file but a device or a pipe; give the path of a measured file ({known}).")
    try:
        with path.open("rb") as file:
            head = file.read(HEAD)
        size = path.stat().st_size
    except OSError as error:
        raise SignalError(f"{path} cannot be read ({error.strerror}); check the file and its permissions.") from None
    if not head.strip():
        raise SignalError(f"{path} is empty; it must hold a time column and an acceleration column.")
    if size > LARGEST_CONTENT:
        raise SignalError(
            f"{path} must have at most {LARGEST_CONTENT >> 20} MiB, got {size >> 20} MiB; cut it into several files."
        )
    found = next((kind for kind in FORMATS.values() if kind.begins(head)), FORMATS[csv.FORMAT.name])
    named = [kind for kind in FORMATS.values() if path.suffix.lower() in kind.suffixes]
    if named and found not in named and csv.FORMAT not in named:
        raise damaged(path, named[0].name, "it does not begin as one")
    return found
