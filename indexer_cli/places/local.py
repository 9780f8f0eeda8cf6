"""A folder of this machine."""

from __future__ import annotations

import contextlib
import fcntl
import hashlib
import os
from collections.abc import Iterable, Iterator
from pathlib import Path

import pyarrow as pa

from indexer_cli.places.base import TEMPORARY, Place, StoreError, told


class LocalPlace(Place):
    """A folder of this machine."""

    shared = False

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def __str__(self) -> str:
        return str(self.folder)

    def check(self) -> None:
        check_place(self.folder)

    def publish(self, name: str, content: bytes) -> None:
        with whole_file(self.folder / name) as temporary:
            temporary.write_bytes(content)

    def claim(self, name: str, content: bytes) -> bool:
        # Only ever asked for under `exclusive`, so nobody comes between the two.
        if self.size(name) is not None:
            return False
        self.publish(name, content)
        return True

    def read(self, name: str) -> bytes | None:
        with told(f"{self.folder / name} cannot be read"):
            try:
                return (self.folder / name).read_bytes()
            except (FileNotFoundError, NotADirectoryError):
                return None

    def open(self, name: str) -> pa.NativeFile:
        with told(f"{self.folder / name} cannot be read"):
            return pa.memory_map(str(self.folder / name))

    def size(self, name: str) -> int | None:
        path = self.folder / name
        with told(f"{path} cannot be read"):
            return path.stat().st_size if path.is_file() else None

    def names(self) -> list[str]:
        with told(f"{self.folder} cannot be read"):
            held = (path for path in self.folder.rglob("*") if not path.is_dir())
            return sorted(path.relative_to(self.folder).as_posix() for path in held)

    def delete(self, names: Iterable[str]) -> None:
        with told(f"{self.folder} cannot be changed"):
            names = list(names)
            for name in names:
                (self.folder / name).unlink(missing_ok=True)
            for below in sorted({name.rpartition("/")[0] for name in names} - {""}, reverse=True):
                # A folder that still holds something stays.
                with contextlib.suppress(OSError):
                    (self.folder / below).rmdir()
            _to_disk(self.folder)

    def intact(self, name: str, size: int, sha256: str) -> bool:
        return self.size(name) == size and file_sha256(self.folder / name) == sha256

    @contextlib.contextmanager
    def exclusive(self) -> Iterator[None]:
        try:
            _make_folder(self.folder)
            lock = os.open(self.folder, os.O_RDONLY)
        except OSError as error:
            raise StoreError(f"out {self} cannot be made ({error.strerror}); choose another folder.") from None
        try:
            try:
                # Held by the system until this process ends, however it ends: a killed run leaves no stale lock.
                fcntl.flock(lock, fcntl.LOCK_EX | fcntl.LOCK_NB)
            except BlockingIOError:
                raise StoreError(
                    f"out must be a folder that no other run is writing to, got {self}; wait for it or choose another."
                ) from None
            except OSError as error:
                # some network file systems have no locks
                rule = f"out must be a folder that can be locked, got {self} ({error.strerror})"
                raise StoreError(f"{rule}; choose one on a local disk.") from None
            yield
        finally:
            os.close(lock)


def check_place(folder: Path) -> None:
    """Refuse, without touching anything, a path where no folder is and none can be made.

    Raises
    ------
    StoreError
        A file stands at the path or at a folder above it, or the place may not be written to.
    """
    place = next(place for place in (folder, *folder.absolute().parents) if place.exists())
    if not place.is_dir():
        raise StoreError(f"out must be a folder, got {folder} where {place} is a file; choose another name.")
    if not os.access(place, os.W_OK | os.X_OK):
        raise StoreError(
            f"out must be a folder that may be written to, got {folder} in {place}; choose another or change its mode."
        )


@contextlib.contextmanager
def whole_file(path: Path, shared: bool = False) -> Iterator[Path]:
    """Give a temporary path beside `path` to write to; it takes its name, safely on the disk, when the block ends
    well, else nothing stays. `shared`: several processes may write the file at the same time; the last one counts."""
    own = f".{os.getpid()}" if shared else ""
    temporary = path.with_name(f"{path.name}{own}{TEMPORARY}")
    try:
        with told(f"{path} cannot be written"):
            _make_folder(path.parent)
            yield temporary
            _to_disk(temporary)
            os.replace(temporary, path)
            _to_disk(path.parent)
    finally:
        with contextlib.suppress(OSError):
            temporary.unlink()


def file_sha256(path: Path) -> str:
    """SHA-256 of a file's bytes, in hexadecimal."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").hexdigest()


def _make_folder(folder: Path) -> None:
    if not folder.is_dir():
        _make_folder(folder.parent)
        folder.mkdir(exist_ok=True)
        _to_disk(folder.parent)


def _to_disk(path: Path) -> None:
    """Wait until the file, or the names in the folder, would survive a power cut."""
    handle = os.open(path, os.O_RDONLY)
    try:
        os.fsync(handle)
    finally:
        os.close(handle)
