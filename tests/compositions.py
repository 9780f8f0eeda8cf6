"""Hydra reads and merges the files of conf/ once a test process, instead of at each command: two thirds of the time of
a command that is refused."""

from __future__ import annotations

import copy
from typing import Any

import pytest
from hydra._internal.config_loader_impl import ConfigLoaderImpl
from hydra._internal.config_repository import ConfigRepository, IConfigRepository
from hydra._internal.hydra import Hydra

from indexer_env.presets import config_dir

files: dict[tuple, Any] = {}
"""What was read, by the places searched and the file."""

merged: dict[tuple, Any] = {}
"""What files that were chosen together gave."""


def keep(patch: pytest.MonkeyPatch) -> None:
    """Files that were read, and what files that were chosen together gave, are copied when they are needed again. What
    is typed is parsed, chosen and put in every time. Nothing is kept where files of a test's own take part."""
    conf, load = str(config_dir()), ConfigRepository.load_config
    merge = ConfigLoaderImpl._compose_config_from_defaults_list

    def sources(repository: IConfigRepository) -> tuple | None:
        found = tuple((source.scheme(), source.path) for source in repository.get_sources())
        return found if all(path == conf for scheme, path in found if scheme == "file") else None

    def load_once(self: ConfigRepository, config_path: str) -> Any:
        if (known := sources(self)) is None:
            return load(self, config_path)
        if (known, config_path) not in files:
            files[known, config_path] = load(self, config_path)
        return files[known, config_path]

    def merge_once(self: ConfigLoaderImpl, defaults: list, repo: IConfigRepository) -> Any:
        known = sources(repo)
        key = known, *map(repr, defaults)
        if known is not None and key in merged:
            return copy.deepcopy(merged[key])
        # of a copy, as a merge takes the nodes of what was loaded for its own
        found = merge(self, defaults, copy.deepcopy(repo))
        if known is not None:
            merged[key] = copy.deepcopy(found)
        return found

    # Hydra composes twice, at first only to read hydra.mode, which nothing sets: None.
    patch.setattr(Hydra, "get_mode", lambda *_, **__: None)
    patch.setattr(ConfigRepository, "load_config", load_once)
    patch.setattr(ConfigLoaderImpl, "_compose_config_from_defaults_list", merge_once)
