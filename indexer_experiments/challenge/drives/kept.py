"""Cases judged, kept in a file of one line of JSON each, so that a run that was stopped goes on where it was."""

from __future__ import annotations

import dataclasses
import json
from pathlib import Path
from typing import Any

from indexer_cli.__main__ import version
from indexer_env.errors import refuse
from indexer_experiments.challenge.drives.draw import VERSION
from indexer_experiments.challenge.drives.score import Judged

_TUPLES = ("hidden", "unknown", "hints")


class Kept:
    """The cases of one seed in a file, or in memory alone where there is no file.

    Parameters
    ----------
    path : Path or None
        Made where it is missing; a last line that a stopped run did not end is cut off.
    seed : int

    Raises
    ------
    ParameterError
        A file that cannot be written, or that holds anything but cases of this seed and version.
    """

    def __init__(self, path: Path | None, seed: int) -> None:
        self._path, self._seed = path, seed
        self.cases: dict[int, Judged] = {}
        if path is None:
            return
        try:
            with open(path, "a+b") as file:
                file.seek(0)
                text = file.read()
                whole = text.rfind(b"\n") + 1
                rows = [self._read(path, line) for line in text[:whole].splitlines()]
                file.truncate(whole)
        except OSError as error:
            rule = "a file that can be written"
            raise refuse("drives", "out", rule, str(path), f"{error.strerror}: choose another") from None
        self.cases = {row.number: row for row in rows}

    def add(self, judged: Judged) -> None:
        """Keep one more."""
        self.cases[judged.number] = judged
        if self._path is not None:
            row = {"seed": self._seed, "version": _version(), **dataclasses.asdict(judged)}
            with open(self._path, "a", encoding="utf-8") as file:
                file.write(json.dumps(row) + "\n")

    def _read(self, path: Path, line: bytes) -> Judged:
        rule = f"a new file, or one of seed {self._seed} and version {_version()}"
        try:
            row: dict[str, Any] = json.loads(line)
            seed, made = row.pop("seed"), row.pop("version")
            row |= {name: tuple(row[name]) for name in _TUPLES}
            row["named"] = tuple(tuple(members) for members in row["named"])
            judged = Judged(**row)
        except (ValueError, TypeError, KeyError, AttributeError):
            raise refuse("drives", "out", rule, str(path), "it holds something else") from None
        if (seed, made) != (self._seed, _version()):
            raise refuse("drives", "out", rule, str(path), f"it is of seed {seed} and version {made}")
        return judged


def _version() -> str:
    """Of the project and of the cases."""
    return f"{version()}, cases {VERSION}"
