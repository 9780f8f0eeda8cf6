"""What every folder of files offers, and the one sentence for what a filesystem refuses."""

from __future__ import annotations

import contextlib
from abc import ABC, abstractmethod
from collections.abc import Iterable, Iterator

import pyarrow as pa

from indexer_env.errors import IndexerError

TEMPORARY = ".part"
"""Ending of a file that is being written."""

GO_ON = "run the same command again, which goes on where this run stopped"


class StoreError(IndexerError, OSError):
    """A folder or file of a data set cannot be written or read as one."""


class Place(ABC):
    """Names are paths below the folder, with "/" between their steps. Every method raises StoreError for what the
    filesystem refuses."""

    shared: bool
    """Whether other machines reach the folder under the same name."""

    @abstractmethod
    def check(self) -> None:
        """Refuse, without touching anything, a place where no folder is and none can be made."""

    @abstractmethod
    def publish(self, name: str, content: bytes) -> None:
        """Write a file, whole or not at all, over the one that has the name."""

    @abstractmethod
    def claim(self, name: str, content: bytes) -> bool:
        """Write a file unless one has the name already; whether it was written."""

    @abstractmethod
    def read(self, name: str) -> bytes | None:
        """The content of a file; None where there is none."""

    @abstractmethod
    def open(self, name: str) -> pa.NativeFile:
        """A file opened to be read in pieces."""

    @abstractmethod
    def size(self, name: str) -> int | None:
        """Bytes of a file; None where there is none."""

    @abstractmethod
    def names(self) -> list[str]:
        """Names of all files in the folder, sorted; none where there is no folder."""

    @abstractmethod
    def delete(self, names: Iterable[str]) -> None:
        """Delete files in this order; those that are not there are passed over."""

    @abstractmethod
    def intact(self, name: str, size: int, sha256: str) -> bool:
        """Whether a file is there as it was published."""

    @abstractmethod
    def exclusive(self) -> contextlib.AbstractContextManager[None]:
        """Make the folder and keep other runs out of it while the block lasts."""


@contextlib.contextmanager
def told(what: str, *, remote: bool = False) -> Iterator[None]:
    """Turn what a filesystem raises into one sentence; those of fsspec share no class, each package has its own."""
    try:
        yield
    except IndexerError:
        raise
    except Exception as error:
        if not remote and not isinstance(error, OSError):
            raise
        cause = getattr(error, "strerror", None) or str(error).partition("\n")[0] or type(error).__name__
        where = "the connection, the URL and your access" if remote else "the disk and the folder"
        raise StoreError(f"{what} ({cause}); check {where}, then {GO_ON}.") from None
