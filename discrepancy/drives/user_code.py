"""Python of the user's: run, and what it raises in one sentence with its line."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from indexer_env.errors import ParameterError, refuse


def executed(path: Path) -> dict[str, Any]:
    """Names that a user's file defines.

    Raises
    ------
    ParameterError
        There is no such file, or it raises.
    """
    if not path.is_file():
        rule = "'indexer' or a Python file that describes a drive"
        raise refuse("discrepancy", "system", rule, str(path), "there is no such file; check the path")
    # a name that no other module has: what runs in it, such as a dataclass, may look its module up
    module = ModuleType(f"drive file {path}")
    module.__file__ = str(path)
    sys.modules[module.__name__] = module
    try:
        exec(compile(path.read_text(encoding="utf-8"), str(path), "exec", dont_inherit=True), module.__dict__)
    except ParameterError:
        raise
    except (Exception, SystemExit) as error:
        raise ParameterError(f"{path.name} must run as Python, got {_said(error, path)}.") from None
    finally:
        del sys.modules[module.__name__]
    return module.__dict__


def _said(error: BaseException, path: Path) -> str:
    """Kind, line of the user's file and words of an exception."""
    line = error.lineno if isinstance(error, SyntaxError) else None
    walk = error.__traceback__
    while walk is not None:
        if walk.tb_frame.f_code.co_filename == str(path):
            line = walk.tb_lineno
        walk = walk.tb_next
    where = "" if line is None else f" in line {line}"
    return f"{type(error).__name__}{where} ({' '.join(str(error).split()) or 'no message'})"


def said_by_user(path: Path, function: Callable[..., Any], error: BaseException) -> ParameterError:
    """The sentence for an exception that the user's function has raised."""
    name = f"{path.name}: {function.__name__}"
    lacking = error.name if isinstance(error, AttributeError) else None
    remedy = f"; name {lacking!r} in channels or in parameters" if lacking else ""
    if lacking and isinstance(getattr(error, "obj", None), np.ndarray):
        remedy = "; of one input u is the array itself, as q, v, a and t are"
    taken = "numbers" if function.__name__ == "rates" else "arrays"
    return ParameterError(f"{name} must take {taken} and give numbers, got {_said(error, path)}{remedy}.")


def law_row(path: Path, name: str, law: Callable[..., Any], track: Any, *given: Any) -> np.ndarray:
    """What the law of an effect gives over a track, one number for each sample; what a user's own raises is one
    sentence."""
    try:
        row = law(track, *given)
    except ParameterError:
        raise
    except (Exception, SystemExit) as error:
        rule = "must take arrays and give numbers"
        raise ParameterError(f"{path.name}: the law of the effect {name} {rule}, got {_said(error, path)}.") from None
    return checked_row(name, row, track.v)


def checked_row(name: str, given: Any, like: np.ndarray) -> np.ndarray:
    """What the law of an effect gives, one number for each sample of `like`."""
    row = np.asarray(given, dtype=float)
    if row.shape not in ((), like.shape) or not np.isfinite(row).all():
        rule = f"one finite number a sample, {like.shape}"
        raise ParameterError(f"the law of the effect {name} must give {rule}, got {row.shape or row}.")
    return np.broadcast_to(row, like.shape)


def unwritable(given: Any) -> Any:
    """A row, or a named tuple of rows, that a user's function cannot write to."""
    if isinstance(given, tuple):
        return type(given)(*map(unwritable, given))
    if not isinstance(given, np.ndarray):
        return given
    view = given.view()
    view.flags.writeable = False
    return view
