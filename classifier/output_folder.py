"""Result folders that appear whole or not at all."""

from __future__ import annotations

import shutil
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from indexer_env.errors import refuse


def check_output_folder(out: str | Path, marker: str, overwrite: bool) -> Path:
    """Refuse an output folder that must not be replaced; to be called before long work.

    out        absent, empty, or, with overwrite, one that holds the file `marker` and so came from the same
               command

    Raises ParameterError.
    """
    if not isinstance(overwrite, bool):
        raise refuse("command", "overwrite", "true or false", overwrite)
    folder = Path(out)
    if not folder.exists():
        return folder
    if not folder.is_dir():
        raise refuse("command", "out", "a folder", str(folder), "name another")
    if not any(folder.iterdir()):
        return folder
    if not (folder / marker).is_file():
        rule = f"a new folder, an empty one or one that holds {marker}"
        raise refuse("command", "out", rule, str(folder), "it holds other files; name another")
    if not overwrite:
        remedy = "set overwrite=true to replace the earlier result, or name another"
        raise refuse("command", "out", "a new or empty folder", str(folder), remedy)
    return folder


@contextmanager
def output_folder(out: str | Path, marker: str, overwrite: bool = False) -> Iterator[Path]:
    """Give a temporary folder beside `out`, which takes its place when the block ends without an error.

    Files of a block that fails are removed and `out` stays as it was.

    Raises ParameterError as `check_output_folder` does.
    """
    folder = check_output_folder(out, marker, overwrite).absolute()
    folder.parent.mkdir(parents=True, exist_ok=True)
    # The work folder itself is private (mode 700); its inner folder gets the usual mode.
    with tempfile.TemporaryDirectory(prefix=f".{folder.name}-", dir=folder.parent) as work:
        fresh = Path(work) / "new"
        fresh.mkdir()
        yield fresh
        if folder.exists():
            folder.rename(Path(work) / "old")
        try:
            fresh.rename(folder)
        except OSError:
            if (Path(work) / "old").exists():
                shutil.move(Path(work) / "old", folder)
            raise
