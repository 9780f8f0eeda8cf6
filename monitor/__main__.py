"""`indexer monitor`: watch machines while they run."""

from __future__ import annotations

from typing import Any

from indexer_cli.command import hydra_command
from indexer_env.errors import IndexerError


class MissingPackage(IndexerError, ImportError):
    """A package of the extra [monitor] is not installed."""


def run(config: dict[str, Any]) -> None:
    """The command, given its configuration as in conf/monitor.yaml."""
    try:
        from monitor.service import Service
        from monitor.settings import settings_of
    except ModuleNotFoundError as error:
        raise MissingPackage(
            f"the monitor needs the package {error.name}; install it with "
            "pip install -e '.[monitor]' -c constraints.txt."
        ) from None
    Service(settings_of(config), say=lambda text: print(text, flush=True)).run()


main = hydra_command("monitor")(run)

if __name__ == "__main__":
    main()
