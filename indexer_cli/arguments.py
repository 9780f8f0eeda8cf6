"""What stands on the command line of a command, before and after Hydra has tried to read it, and what may."""

from __future__ import annotations

from pathlib import Path

import yaml
from omegaconf import DictConfig, OmegaConf

from indexer_env.presets import config_dir, load_yaml

_FILE_ENDINGS = (".yaml", ".yml")


def with_key(key: str | None, arguments: list[str]) -> list[str]:
    """The arguments, the first of them given its key where it stands alone; quoted, as a path may hold any sign."""
    if key is None or not arguments or arguments[0].startswith("-") or "=" in arguments[0]:
        return arguments
    quoted = arguments[0].replace("\\", "\\\\").replace("'", "\\'")
    return [f"{key}='{quoted}'", *arguments[1:]]


def with_files(arguments: list[str], folder: Path) -> list[str]:
    """The arguments, each choice of a group that is a YAML file, `machine=DIR/machine.yaml`, copied into `folder`,
    which Hydra then searches as it does conf/.

    Raises
    ------
    ParameterError
        No such file, or it holds no mapping.
    """
    replaced, found = [], False
    for number, argument in enumerate(arguments):
        group, _, value = argument.partition("=")
        value = value.strip("'\"")
        if value.endswith(_FILE_ENDINGS) and group and (config_dir() / group).is_dir():
            content = load_yaml(group, value)
            place = folder / group / f"{Path(value).stem}_{number}.yaml"
            place.parent.mkdir(parents=True, exist_ok=True)
            place.write_text(yaml.safe_dump(content, sort_keys=False, allow_unicode=True), encoding="utf-8")
            argument, found = f"{group}={place.stem}", True
        replaced.append(argument)
    return [*replaced, f"hydra.searchpath=[file://{folder}]"] if found else replaced


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
    """Keys that a root configuration has, its groups and those of the files that it takes over among them."""
    root = OmegaConf.load(config_dir() / f"{config_name}.yaml")
    assert isinstance(root, DictConfig)
    names = [str(key) for key in root if key != "defaults"]
    for entry in root.get("defaults", []):
        if isinstance(entry, DictConfig):
            groups = [str(key).removeprefix("override ").removeprefix("/") for key in entry]
            names += [group for group in groups if "hydra/" not in group]
        elif entry not in ("_self_", "command"):
            names += root_keys(entry)
    return names
