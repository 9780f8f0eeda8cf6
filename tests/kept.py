"""What takes long to compile is kept from run to run beside the test, as numba keeps what it compiles."""

from __future__ import annotations

import hashlib
import os
from collections.abc import Callable, Iterable
from importlib.metadata import distributions
from pathlib import Path

_COMPILERS = ("numba", "llvmlite", "numpy", "nvidia", "cuda")
"""How the names of the packages begin that have a say in what is compiled."""


def kept(name: str, beside: Path, sources: Iterable[Path], make: Callable[[], str]) -> str:
    """The text that `make` makes of these sources: made anew as soon as one of them, the test or a compiler differs."""
    digest = hashlib.sha256()
    for path in sorted([beside, *sources]):
        digest.update(path.name.encode() + b"\0" + path.read_bytes())
    found = {(str(each.name), each.version) for each in distributions() if str(each.name).startswith(_COMPILERS)}
    digest.update(repr(sorted(found)).encode())
    file = beside.parent / "__pycache__" / f"{beside.stem}.{name}.txt"
    key, _, text = file.read_text(encoding="utf-8").partition("\n") if file.exists() else ("", "", "")
    if key != digest.hexdigest():
        text = make()
        file.parent.mkdir(exist_ok=True)
        part = file.with_suffix(f".{os.getpid()}")
        part.write_text(f"{digest.hexdigest()}\n{text}", encoding="utf-8")
        part.replace(file)
    return text
