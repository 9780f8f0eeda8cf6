"""What a format is to the door: a name, how its files begin and end, and its reader."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from indexer_env.errors import SignalError
from indexer_records.formats.table import MeasuredTable

HEAD = 2**16
"""Bytes from the start of a file that are looked at to tell its format."""


@dataclass(frozen=True)
class Format:
    """One kind of file.

    Attributes
    ----------
    name : str
        As users say it, e.g. "WAV".
    suffixes : tuple of str
        Endings of its files in lower case, dot included.
    begins : callable
        Whether the first HEAD bytes are those of such a file.
    read : callable
        Path -> MeasuredTable; raises SignalError.
    apart : bool
        Read in a process of its own, as its library may hang or crash over a damaged file.
    """

    name: str
    suffixes: tuple[str, ...]
    begins: Callable[[bytes], bool]
    read: Callable[[Path], MeasuredTable]
    apart: bool = True

    def table(self, path: Path) -> MeasuredTable:
        """Read a file; raises SignalError, also where the disk or the memory fails."""
        try:
            return self.read(path)
        except OSError as error:
            why = error.strerror or str(error)
            raise SignalError(f"{path} cannot be read ({why}); check the file and its permissions.") from None
        except MemoryError:
            raise SignalError(f"{path} does not fit into memory as a {self.name} file; cut it into several.") from None
