"""What every test needs: no windows, no crowding of the processors, and the same examples on every run."""

import gc
import logging
import os
import sys

# Before torch and matplotlib are imported: they read these once. Test processes already share the cores.
os.environ.setdefault("MPLBACKEND", "Agg")
if "PYTEST_XDIST_WORKER" in os.environ:
    os.environ.setdefault("OMP_NUM_THREADS", "1")

import pytest
from hydra.core.global_hydra import GlobalHydra
from hypothesis import HealthCheck, settings

from indexer_env.engine import prepare_kernel
from tests import compositions

# Some hundred thousand objects live as long as the tests: to look for cycles among them after every 700 new ones, as
# Python does unless told otherwise, takes a tenth of the time.
gc.set_threshold(50_000, 20, 10)

# No deadline and no check of how fast examples are made: the first may compile a kernel, and a machine may be busy.
# Derandomised: a failure in CI is the same failure here.
settings.register_profile(
    "project", deadline=None, derandomize=True, database=None, suppress_health_check=[HealthCheck.too_slow]
)
settings.load_profile("project")


def pytest_collection_finish() -> None:
    """Modules and collected tests stay to the end: the collector need not walk over them again and again."""
    gc.collect()
    gc.freeze()


@pytest.fixture(scope="session")
def simulator() -> None:
    """The simulator is compiled: no command that follows, in this process or another, has a word to say about it."""
    prepare_kernel()


@pytest.fixture(autouse=True)
def root_logger():
    """Hydra gives the root logger a handler for the stdout of its time, which a later test would write to."""
    root = logging.getLogger()
    handlers, level = root.handlers[:], root.level
    yield
    root.handlers[:], root.level = handlers, level


@pytest.fixture(scope="session", autouse=True)
def composed_once():
    """In this process the configuration is composed from files read before; commands in processes of their own still go
    the whole way."""
    with pytest.MonkeyPatch.context() as patch:
        compositions.keep(patch)
        yield


@pytest.fixture
def run_command(monkeypatch, capsys, simulator):
    """Run the `main` of a command's module with these arguments; gives exit code, stdout and stderr."""

    def run(module, *arguments: str) -> tuple[int, str, str]:
        monkeypatch.setattr(sys, "argv", ["command", *arguments])
        code = 0
        try:
            module.main()
        except SystemExit as error:
            code = int(error.code or 0)
        finally:
            GlobalHydra.instance().clear()
        captured = capsys.readouterr()
        return code, captured.out, captured.err

    return run
