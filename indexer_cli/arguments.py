"""What stands on the command line of a command, before and after Hydra has tried to read it, and what may."""

from __future__ import annotations

import re
from collections.abc import Iterable
from pathlib import Path

import yaml
from hydra.core.hydra_config import HydraConfig
from hydra.core.override_parser.overrides_parser import OverridesParser
from hydra.errors import HydraException
from omegaconf import DictConfig, OmegaConf

from indexer_cli.verbs import can_sweep
from indexer_env.errors import ParameterError, refuse
from indexer_env.presets import config_dir, load_yaml, with_own_table

_FILE_ENDINGS = (".yaml", ".yml")
_FROM = "# copied from "


_FLAGS = ("-m", "--multirun", "-h", "--help", "--version")
"""Flags that may stand anywhere on the line; Hydra takes them only in front of all overrides."""


def flags_first(arguments: list[str]) -> list[str]:
    """The arguments with the flags that take no value in front."""
    flags = [argument for argument in arguments if argument in _FLAGS]
    return [*flags, *(argument for argument in arguments if argument not in _FLAGS)]


def with_key(key: str | None, arguments: list[str]) -> list[str]:
    """The arguments, the first that stands alone given its key; quoted, as a path may hold any sign."""
    alone = (place for place, word in enumerate(arguments) if not word.startswith("-") and "=" not in word)
    if key is None or (place := next(alone, None)) is None:
        return arguments
    quoted = arguments[place].replace("\\", "\\\\").replace("'", "\\'")
    return [*arguments[:place], f"{key}='{quoted}'", *arguments[place + 1 :]]


def with_files(arguments: list[str], folder: Path) -> list[str]:
    """The arguments, each choice of a group that is a YAML file, `machine=DIR/machine.yaml`, copied into `folder`,
    which Hydra then searches as it does conf/.

    Raises
    ------
    ParameterError
        No such file, or it holds no mapping.
    """
    sweep = any(flag in arguments for flag in ("-m", "--multirun"))
    replaced, found = [], False
    for number, argument in enumerate(arguments):
        group, _, value = argument.partition("=")
        choices = value.split(",") if sweep else [value]
        if group and (config_dir() / group).is_dir() and any(_is_file(choice) for choice in choices):
            copied = [
                _copied(group, choice.strip("'\""), folder, f"{number}_{place}") if _is_file(choice) else choice
                for place, choice in enumerate(choices)
            ]
            argument, found = f"{group}={','.join(copied)}", True
        replaced.append(argument)
    return [*replaced, f"hydra.searchpath=[file://{folder}]"] if found else replaced


def _is_file(choice: str) -> bool:
    return choice.strip("'\"").endswith(_FILE_ENDINGS)


def _copied(group: str, path: str, folder: Path, mark: str) -> str:
    """Copy a file to where Hydra looks for choices of the group; gives the name that it has there."""
    content = with_own_table(load_yaml(group, path), path)
    # Hydra reads few other signs as they stand, and a name of digits as a number
    name = re.sub(r"[^A-Za-z0-9]+", "_", Path(path).stem)
    place = folder / group / f"file_{name}_{mark}.yaml"
    place.parent.mkdir(parents=True, exist_ok=True)
    text = yaml.safe_dump(content, sort_keys=False, allow_unicode=True)
    place.write_text(f"{_FROM}{path}\n{text}", encoding="utf-8")
    return place.stem


def file_behind(sentence: str) -> str:
    """The YAML file that the sentence of a job is about, as it was typed: the sentence begins with a key of a group
    that a file was given for, and the line does not give the key itself. Empty where there is none."""
    if not HydraConfig.initialized():
        return ""
    hydra = HydraConfig.get()
    key = sentence.partition(" ")[0]
    if unknown := re.match(r"(\w+) has no parameter '(\w+)'", sentence):
        key = f"{unknown[1].lower()}.{unknown[2]}"
    group = key.partition(".")[0]
    given = [override.lstrip("+~").partition("=")[0] for override in hydra.overrides.task]
    if key == group or any(key == name or key.startswith(f"{name}.") for name in given if "." in name):
        return ""
    return copied_from(group, str(hydra.runtime.choices.get(group)), hydra.searchpath)


def copied_from(group: str, choice: str, searchpath: Iterable[str]) -> str:
    """The YAML file, as it was typed, whose copy in one of these folders is this choice of a group; empty where it is
    no copy."""
    for folder in searchpath:
        copy = Path(folder.removeprefix("file://")) / group / f"{choice}.yaml"
        if copy.is_file() and (first := copy.read_text(encoding="utf-8").partition("\n")[0]).startswith(_FROM):
            return first.removeprefix(_FROM)
    return ""


def check_sweep(arguments: list[str], config_name: str) -> None:
    """Refuse a sweep over `out`, whose jobs have folders of their own in one folder, beside their table, and a sweep of
    a command that writes no folder.

    Raises
    ------
    ParameterError
        More than one folder, or none.
    """
    flag = next((argument for argument in arguments if argument in ("-m", "--multirun")), None)
    if flag is None:
        return
    if not can_sweep(config_name, root_keys(config_name)):
        rule = f"{config_name} must be run without {flag}, as it writes no folder that could hold the jobs"
        raise ParameterError(f"{rule}, got {flag!r}; run it once for each value.")
    for argument in (argument for argument in arguments if argument.partition("=")[0].lstrip("+") == "out"):
        try:
            swept = OverridesParser.create().parse_override(argument).is_sweep_override()
        except HydraException:
            continue  # told by Hydra
        if swept:
            rule = "one folder in a sweep, for OUT/<job number> and OUT/sweep.csv"
            raise refuse("command", "out", rule, argument.partition("=")[2], "leave the others out")


def malformed(error: ValueError | TypeError, arguments: list[str]) -> str:
    """A sentence for what Hydra refuses without naming it: a group whose value is no name."""
    for argument in arguments:
        group, _, value = argument.lstrip("+~").partition("=")
        folder = config_dir() / group
        if group and folder.is_dir() and not _are_names(yaml.safe_load(value)):
            names = sorted(path.stem for path in folder.glob("*.yaml"))
            return f"{group} must be one of {', '.join(names)}, got {value or None!r}."
    return str(error)


def _are_names(value: object) -> bool:
    return all(isinstance(name, str) for name in (value if isinstance(value, list) else [value]))


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
