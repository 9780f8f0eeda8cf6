"""Result folders that appear whole or not at all."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from fnmatch import fnmatchcase
from pathlib import Path

from indexer_cli.command import check_flag
from indexer_cli.places import StoreError
from indexer_cli.places.local import check_place
from indexer_env.errors import refuse


def check_output_folder(out: str | Path, own: tuple[str, ...], overwrite: bool) -> Path:
    """Refuse an output folder that must not be replaced, or an `overwrite` that is no flag; to be called before
    long work.

    out        absent, empty, or, with overwrite, one that came from the same command and holds nothing else
    own        names of all files that the command leaves, or patterns of such names; first the one by which its
               folder is known

    Raises ParameterError, and StoreError where no folder can be made.
    """
    check_flag("command", "overwrite", overwrite)
    folder = Path(out)
    check_place(folder)
    if not folder.exists():
        return folder
    _check_replaceable(folder)
    held = sorted(path.name for path in folder.iterdir())
    if not held:
        return folder
    foreign = [name for name in held if not any(fnmatchcase(name, pattern) for pattern in own)]
    if foreign or own[0] not in held:
        rule = f"a new folder, an empty one or one that holds an earlier {own[0]} and nothing else"
        remedy = f"it holds other files ({(foreign or held)[0]}); name another"
        raise refuse("command", "out", rule, str(folder), remedy)
    if not overwrite:
        remedy = "set overwrite=true to replace the earlier result, or name another"
        raise refuse("command", "out", "a new or empty folder", str(folder), remedy)
    return folder


def _check_replaceable(folder: Path) -> None:
    """Refuse a folder whose place a new one cannot take, or should not take while somebody works in it."""
    whole = folder.resolve()
    if whole.is_mount():
        why = "where a disk is mounted"
    elif not os.access(whole.parent, os.W_OK | os.X_OK):
        why = f"in {whole.parent}, which may not be written to"
    elif Path.cwd().is_relative_to(whole):
        why = "which is the working folder or one above it"
    else:
        return
    raise StoreError(f"out must be a folder that a new one can replace, got {folder}, {why}; name a folder in it.")


@contextmanager
def output_folder(out: str | Path, own: tuple[str, ...], overwrite: bool = False) -> Iterator[Path]:
    """Give a temporary folder beside `out`, which takes its place when the block ends without an error.

    Files of a block that fails are removed and `out` stays as it was.

    Raises as `check_output_folder` does.
    """
    # Resolved, so that a link stays a link and the folder it leads to is what is replaced.
    folder = check_output_folder(out, own, overwrite).resolve()
    try:
        folder.parent.mkdir(parents=True, exist_ok=True)
        # The work folder itself is private (mode 700); its inner folder gets the usual mode.
        temporary = tempfile.TemporaryDirectory(prefix=f".{folder.name}-", dir=folder.parent)
    except OSError as error:
        raise StoreError(f"out {out} cannot be made ({error.strerror}); choose another folder.") from None
    with temporary as work:
        fresh = Path(work) / "new"
        fresh.mkdir()
        yield fresh
        # Another run may have come first.
        check_output_folder(folder, own, overwrite)
        if folder.exists():
            folder.rename(Path(work) / "old")
        try:
            fresh.rename(folder)
        except OSError:
            if folder.exists():
                rule = f"out must be a folder that no other run is writing to, got {out}"
                raise StoreError(f"{rule}, where another has just ended; look at it or choose another.") from None
            if (Path(work) / "old").exists():
                # moved by shutil, it would end inside a folder that is there by now
                os.rename(Path(work) / "old", folder)
            raise
