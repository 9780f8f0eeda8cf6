"""A folder behind a URL, on any filesystem that fsspec knows."""

from __future__ import annotations

import contextlib
from collections.abc import Iterable
from typing import Any

import pyarrow as pa

from indexer_cli.places.base import TEMPORARY, Place, StoreError, told

_WHOLE_BY_THEMSELVES = {"s3", "s3a", "gs", "gcs", "az", "abfs", "abfss", "memory"}
"""Protocols whose files appear with their last byte only; elsewhere a file is written beside its name and moved."""


class RemotePlace(Place):
    """A folder of a filesystem that fsspec knows, by its URL."""

    shared = True

    def __init__(self, url: str) -> None:
        # Here, as local data sets do without it.
        import fsspec

        self.url = url.rstrip("/")
        self.protocol = url.partition("://")[0]
        try:
            self.filesystem, self.root = fsspec.core.url_to_fs(self.url, use_listings_cache=False)
        except ImportError as error:
            remedy = "pip install 'indexer-diagnosis[s3]'" if self.protocol in ("s3", "s3a") else str(error)
            raise StoreError(f"out {url} needs a package that is not installed; {remedy}.") from None
        except ValueError as error:
            raise StoreError(f"out must be a folder or a URL that fsspec knows, got {url} ({error}).") from None

    def __str__(self) -> str:
        return self.url

    def __reduce__(self) -> tuple[Any, ...]:
        # Connections stay behind: whoever gets the place makes its own.
        return RemotePlace, (self.url,)

    def check(self) -> None:
        """Any name below a bucket can be written to; whether this user may, the first file shows."""

    def publish(self, name: str, content: bytes) -> None:
        with told(f"{self.url}/{name} cannot be written", remote=True):
            if self.protocol in _WHOLE_BY_THEMSELVES:
                self.filesystem.pipe_file(self._path(name), content)
            else:
                self.filesystem.makedirs(self._path(name).rpartition("/")[0], exist_ok=True)
                self.filesystem.pipe_file(self._path(name) + TEMPORARY, content)
                self.filesystem.mv(self._path(name) + TEMPORARY, self._path(name))

    def claim(self, name: str, content: bytes) -> bool:
        with told(f"{self.url}/{name} cannot be written", remote=True):
            try:
                self.filesystem.makedirs(self._path(name).rpartition("/")[0], exist_ok=True)
                self.filesystem.pipe_file(self._path(name), content, mode="create")
            except FileExistsError:
                return False
        return True

    def read(self, name: str) -> bytes | None:
        with told(f"{self.url}/{name} cannot be read", remote=True):
            try:
                return self.filesystem.cat_file(self._path(name))
            except FileNotFoundError:
                return None

    def open(self, name: str) -> pa.NativeFile:
        with told(f"{self.url}/{name} cannot be read", remote=True):
            return pa.BufferReader(self.filesystem.cat_file(self._path(name)))

    def size(self, name: str) -> int | None:
        with told(f"{self.url}/{name} cannot be read", remote=True):
            try:
                return self.filesystem.info(self._path(name))["size"]
            except FileNotFoundError:
                return None

    def names(self) -> list[str]:
        with told(f"{self.url} cannot be read", remote=True):
            self.filesystem.invalidate_cache()
            try:
                held = self.filesystem.find(self.root)
            except FileNotFoundError:
                return []
        return sorted(path.removeprefix(self.root).lstrip("/") for path in held)

    def delete(self, names: Iterable[str]) -> None:
        with told(f"{self.url} cannot be changed", remote=True):
            for name in names:
                with contextlib.suppress(FileNotFoundError):
                    self.filesystem.rm_file(self._path(name))

    def intact(self, name: str, size: int, sha256: str) -> bool:
        # Its files have all their bytes or none; to fetch each for its checksum would cost as much as to make it.
        return self.size(name) == size

    def exclusive(self) -> contextlib.AbstractContextManager[None]:
        # A lock there would outlive a killed run; the claim of the order keeps other orders out.
        return contextlib.nullcontext()

    def _path(self, name: str) -> str:
        return f"{self.root}/{name}"
