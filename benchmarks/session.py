"""The cores used, and what the header of the table says about the machine."""

from __future__ import annotations

import datetime
import importlib.metadata
import os
import platform

from datagen.run_log import processor

CORES = 2
"""The table's numbers are for two cores, whatever the machine has."""

_PACKAGES = ("numpy", "numba", "scipy", "jax", "diffrax", "scikit-sundae", "torch")


def keep_to_cores() -> None:
    """Bind this process and those it starts to CORES cores, where the system can; before any library counts them."""
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, sorted(os.sched_getaffinity(0))[:CORES])


def version(package: str) -> str | None:
    """Version of an installed distribution, None where it is not installed."""
    try:
        return importlib.metadata.version(package)
    except importlib.metadata.PackageNotFoundError:
        return None


def description() -> dict[str, str]:
    """The machine, the versions and the load by others, for the header."""
    versions = ", ".join(f"{package} {version(package) or 'not installed'}" for package in _PACKAGES)
    used = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    return {
        "processor": processor(),
        "cores": f"{used} of {os.cpu_count()} cores",
        "versions": f"{platform.system()}, Python {platform.python_version()}, {versions}",
        "date": datetime.date.today().isoformat(),
        "load": f"{os.getloadavg()[0]:.1f}",
    }
