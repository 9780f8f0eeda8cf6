"""What stands on the command line of a command, before and after Hydra has tried to read it, and what may."""

from __future__ import annotations

import yaml
from omegaconf import DictConfig, OmegaConf

from indexer_env.presets import config_dir


def with_key(key: str | None, arguments: list[str]) -> list[str]:
    """The arguments, the first of them given its key where it stands alone; quoted, as a path may hold any sign."""
    if key is None or not arguments or arguments[0].startswith("-") or "=" in arguments[0]:
        return arguments
    quoted = arguments[0].replace("\\", "\\\\").replace("'", "\\'")
    return [f"{key}='{quoted}'", *arguments[1:]]


def malformed(error: ValueError, arguments: list[str]) -> str:
    """A sentence for what Hydra refuses without naming it: a group whose value is no name."""
    for argument in arguments:
        group, _, value = argument.lstrip("+~").partition("=")
        folder = config_dir() / group
        if group and folder.is_dir() and not isinstance(yaml.safe_load(value), str | list):
            names = sorted(path.stem for path in folder.glob("*.yaml"))
            return f"{group} must be one of {', '.join(names)}, got {value or None!r}."
    return str(error)


def root_keys(config_name: str) -> list[str]:
    """Keys that a root configuration has, its groups among them."""
    root = OmegaConf.load(config_dir() / f"{config_name}.yaml")
    assert isinstance(root, DictConfig)
    groups = [
        str(key).removeprefix("override ").removeprefix("/")
        for entry in root.get("defaults", [])
        if isinstance(entry, DictConfig)
        for key in entry
    ]
    names = [str(key) for key in root if key != "defaults"] + [group for group in groups if "hydra/" not in group]
    return [name for name in names if name != "hydra"]
