"""Methods by name: those that are here, and those of a user's own file, FILE.py:NAME."""

from __future__ import annotations

import importlib.util
from pathlib import Path
from typing import Any

from indexer_env.errors import refuse
from indexer_experiments.compare.methods import METHODS, Method

_REMEDY = "write FILE.py:NAME, where NAME has fit(dataset, seed) and what that gives has logits(records)"


def is_own(name: object) -> bool:
    """Whether a name is one of a user's own file."""
    return isinstance(name, str) and ".py:" in name


def method_of(name: str) -> Method:
    """The method of this name; a class is called without arguments.

    Raises ParameterError for a file or a name that is not there, a file that cannot be run, and what is no method.
    """
    if not is_own(name):
        return METHODS[name]
    path, _, attribute = name.rpartition(":")
    found = getattr(_module(Path(path), name), attribute, None)
    method: Any = found() if isinstance(found, type) else found
    if not callable(getattr(method, "fit", None)):
        raise refuse("compare", "methods", f"names of methods, which {attribute} of {path} is not", name, _REMEDY)
    return method


def _module(path: Path, name: str) -> Any:
    spec = importlib.util.spec_from_file_location(path.stem, path)
    if not path.is_file() or spec is None or spec.loader is None:
        raise refuse("compare", "methods", "names of methods in files that exist", name, _REMEDY)
    module = importlib.util.module_from_spec(spec)
    try:
        spec.loader.exec_module(module)
    except Exception as error:  # whatever a user's file raises
        rule = f"names of methods in files that run, while {path} raised {type(error).__name__}: {error}"
        raise refuse("compare", "methods", rule, name) from None
    return module
