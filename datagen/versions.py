"""Which versions made something: the one place that asks for them."""

from __future__ import annotations

import importlib.metadata
from collections.abc import Iterable

NOT_INSTALLED = "not installed"
"""Stands for the version of the project itself where it runs from a checkout that was never installed."""


def versions_of(distributions: Iterable[str]) -> dict[str, str]:
    """Version of each distribution by its name, NOT_INSTALLED where there is none."""
    return {name: _version(name) for name in distributions}


def _version(distribution: str) -> str:
    try:
        return importlib.metadata.version(distribution)
    except importlib.metadata.PackageNotFoundError:
        return NOT_INSTALLED
