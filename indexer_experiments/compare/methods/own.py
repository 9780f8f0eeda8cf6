"""Methods by name: those that are here, and those of a user's own file, FILE.py:NAME."""

from __future__ import annotations

import contextlib
import dataclasses
import importlib.util
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from classifier.dataset import Dataset
from indexer_env.errors import refuse
from indexer_experiments.compare.methods import METHODS, Fitted, Method

_REMEDY = "write FILE.py:NAME, where NAME has fit(dataset, seed) and what that gives has logits(records)"
_LOGITS = "an array (n, classes) of finite numbers"


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
    with _told(name, "can be made without arguments"):
        method: Any = found() if isinstance(found, type) else found
    if not callable(getattr(method, "fit", None)):
        raise refuse("compare", "methods", f"names of methods, which {attribute} of {path} is not", name, _REMEDY)
    return _Own(name, method)


@dataclass(frozen=True)
class _Own(Method):
    """A user's method, which does not see the records that will judge it; what it raises or gives amiss is told in a
    sentence."""

    name: str
    method: Any

    def fit(self, dataset: Dataset, seed: int) -> Fitted:
        with _told(self.name, "can fit"):
            fitted = self.method.fit(_without_validation(dataset), seed)
        return _FittedOwn(self.name, fitted, len(dataset.codes.classes))


@dataclass(frozen=True)
class _FittedOwn(Fitted):
    name: str
    fitted: Any
    classes: int

    def logits(self, records: np.ndarray) -> np.ndarray:
        with _told(self.name, f"give {_LOGITS} as logits"):
            found = np.asarray(self.fitted.logits(records), float)
        shape = (len(records), self.classes)
        if found.shape == shape and np.isfinite(found).all():
            return found
        amiss = "what is not finite" if found.shape == shape else f"the shape {found.shape}"
        rule = f"names of methods whose logits are {_LOGITS}, here {shape}"
        raise refuse("compare", "methods", rule, self.name, f"they have {amiss}")


@contextlib.contextmanager
def _told(name: str, rule: str) -> Iterator[None]:
    try:
        yield
    except Exception as error:  # whatever a user's file raises
        remedy = f"it raised {_one_line(error)}; HYDRA_FULL_ERROR=1 shows where"
        raise refuse("compare", "methods", f"names of methods that {rule}", name, remedy) from error


def _one_line(error: Exception) -> str:
    return f"{type(error).__name__}: {' '.join(str(error).split())}"


def _without_validation(dataset: Dataset) -> Dataset:
    """The data set with NaN for the records that judge a method."""
    records = dataset.records.copy()
    records[dataset.rows("validation")] = np.nan
    return dataclasses.replace(dataset, records=records)


def _module(path: Path, name: str) -> Any:
    spec = importlib.util.spec_from_file_location(path.stem, path)
    if not path.is_file() or spec is None or spec.loader is None:
        raise refuse("compare", "methods", "names of methods in files that exist", name, _REMEDY)
    module = importlib.util.module_from_spec(spec)
    try:
        spec.loader.exec_module(module)
    except Exception as error:  # whatever a user's file raises
        rule = f"names of methods in files that run, while {path} raised {_one_line(error)}"
        raise refuse("compare", "methods", rule, name, "HYDRA_FULL_ERROR=1 shows where") from error
    return module
