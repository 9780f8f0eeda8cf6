"""The folder in which a twin is being made: what it holds, and whose it is."""

from __future__ import annotations

import shutil
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import yaml

from indexer_cli.__main__ import version
from indexer_env.errors import ParameterError
from twin.folder import FORMAT, FORMER, NETWORKS, PAPER, VERSION

_OWN_FILES = (
    "stage.yaml", "machine.yaml", "sensor.yaml", "calibration.yaml", "posterior.parquet", "remains.safetensors",
    "synthesis.safetensors", "learned.yaml", "detection.yaml", "check.yaml", "twin.yaml", "report.html", "data",
    *(f"{name}.safetensors" for name in (*NETWORKS, PAPER)),
)  # fmt: skip

_PARTS = tuple(f".{Path(name).stem}.part" for name in _OWN_FILES)
"""What a run that was killed leaves of a file that it was writing."""


def keep(path: Path, content: bytes) -> None:
    """Write a file of a twin, whole or not at all, and as readable as the umask says: the writers of safetensors leave
    it to its owner alone, and a monitor may run as another user."""
    fresh = path.with_name(f".{path.stem}.part")
    fresh.write_bytes(content)
    fresh.rename(path)


class Workplace:
    """A folder, taken for a twin of these records and settings, or gone on with."""

    def __init__(self, out: Path, made_of: str, overwrite: bool) -> None:
        """`made_of` is the fingerprint of records and settings.

        Raises
        ------
        ParameterError
            A folder that holds something else.
        """
        self.out = out
        mark = {"format": FORMAT, "version": VERSION, "made_of": made_of, "software": version()}
        if out.exists():
            held = sorted(path.name for path in out.iterdir() if path.name not in (*_PARTS, FORMER))
            foreign = [name for name in held if name not in _OWN_FILES]
            if foreign or (held and "stage.yaml" not in held):
                raise ParameterError(
                    f"twin.out must be a new folder, an empty one or that of a twin, got {out}, which holds "
                    f"{(foreign or held)[0]}; name another."
                )
            before = self.read("stage") if held else mark
            if before != mark:
                if not overwrite:
                    same = before.get("made_of") == made_of
                    whose = (
                        f"was begun by version {before.get('software')} of this software" if same else "is of others"
                    )
                    raise ParameterError(
                        "twin.out must be a new folder, or that of a twin of the same records and settings, got "
                        f"{out}, which {whose}; set overwrite=true to make it anew, or name another."
                    )
                self._put_aside(held)
            for name in _PARTS:
                (out / name).unlink(missing_ok=True)
        out.mkdir(parents=True, exist_ok=True)
        self.write("stage", mark)

    def _put_aside(self, held: Sequence[str]) -> None:
        """Make room; a twin that is finished stays in a folder of its own until the new one is."""
        former = self.out / FORMER
        if "twin.yaml" in held:
            if (former / "twin.yaml").exists():
                shutil.rmtree(former)
            former.mkdir(exist_ok=True)
        # what makes it a twin, and ours, goes last: a run that was killed here is gone on with
        for name in sorted(held, key=lambda name: {"twin.yaml": 1, "stage.yaml": 2}.get(name, 0)):
            path = self.out / name
            if "twin.yaml" in held:
                path.rename(former / name)
            elif path.is_dir():
                shutil.rmtree(path)
            else:
                path.unlink()

    def finished(self) -> None:
        """The twin is made: what is left of the way there goes, and the twin that it replaces."""
        for name in ("data", FORMER):
            shutil.rmtree(self.out / name, ignore_errors=True)

    def read(self, name: str) -> Any:
        """What NAME.yaml holds."""
        return yaml.safe_load((self.out / f"{name}.yaml").read_text(encoding="utf-8"))

    def write(self, name: str, content: Any) -> None:
        """Write NAME.yaml, whole or not at all."""
        text = yaml.safe_dump(content, sort_keys=False, allow_unicode=True)
        keep(self.out / f"{name}.yaml", text.encode())

    def forget(self, *names: str) -> None:
        """Remove these files where there are any."""
        for name in names:
            (self.out / name).unlink(missing_ok=True)

    def has(self, names: Sequence[str]) -> bool:
        """Whether it holds all of these files."""
        return all((self.out / name).exists() for name in names)
