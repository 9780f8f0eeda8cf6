"""The gate between the project and the libraries that read foreign formats."""

from __future__ import annotations

import contextlib
import importlib
import warnings
from collections.abc import Iterator
from pathlib import Path
from types import ModuleType

from indexer_env.errors import SignalError

_LONGEST_WORDS = 160
"""Characters of a library's own message that are passed on."""


def library(module: str, path: Path, kind: str) -> ModuleType:
    """Import a reader's library.

    Raises
    ------
    SignalError
        It is not installed; the sentence holds the line that installs it.
    """
    try:
        return importlib.import_module(module)
    except ImportError:
        raise SignalError(
            f"{path} is a {kind} file, for which the package {module} must be installed; "
            "run: pip install 'indexer-diagnosis[formats]'."
        ) from None


@contextlib.contextmanager
def reading(path: Path, kind: str) -> Iterator[None]:
    """Turn whatever a library raises over a file into one sentence about that file.

    The broad `except` belongs here and nowhere else: over a damaged file the libraries raise nearly every class of
    exception, plain `Exception` included, and none of them promises which. The block must hold calls of the library
    only. Warnings count as damage, "the file is corrupt, going on" among them, but for those about the library's own
    code.
    """
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            for about_code in (DeprecationWarning, PendingDeprecationWarning, FutureWarning):
                warnings.simplefilter("ignore", about_code)
            yield
    except (SignalError, MemoryError):
        raise
    except Exception as error:
        raise damaged(path, kind, str(error) or type(error).__name__) from None


def damaged(path: Path, kind: str, why: str) -> SignalError:
    """Build (not raise) the sentence for a file that is not what its kind must be."""
    words = " ".join("".join(sign if sign.isprintable() else " " for sign in why).split()).rstrip(".")
    if len(words) > _LONGEST_WORDS:
        words = words[:_LONGEST_WORDS] + "…"
    return SignalError(f"{path} is a damaged {kind} file ({words}); export the measurement again.")
