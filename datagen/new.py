"""A machine as a commented YAML file to be filled in; a command."""

from __future__ import annotations

import shlex
import sys
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import yaml

from datagen.quantities import JOINTS
from datagen.schema import COLUMNS
from indexer_cli.command import check_flag, hydra_command
from indexer_cli.job_paths import path_given
from indexer_cli.places.local import whole_file
from indexer_cli.verbs import VERBS
from indexer_env.checks import check_choice
from indexer_env.errors import IndexerError, refuse
from indexer_env.machine import CONTACT_LAWS, MODELS, machine_from_mapping
from indexer_env.motion_law import MOTION_LAWS

_CHOICES = {
    "model": tuple(MODELS),
    "contact_law": tuple(CONTACT_LAWS),
    "motion_law": tuple(name for name in MOTION_LAWS if name != "table"),
}
_REMARKS = {
    "name": "used in messages",
    "effects": "what the machine is extended by, e.g. {friction.coulomb: {torque: 5}}; see docs/reference/effects.md",
}


def machine_yaml(machine: Mapping[str, Any]) -> str:
    """A machine as YAML, each key with its unit and what it means beside it."""
    title = f"# {machine['name']}: check every number against the drawing of your machine; lengths of angles in rad.\n"
    return title + "".join(_lines(machine, "", ""))


def _lines(mapping: Mapping[str, Any], prefix: str, indent: str) -> Iterator[str]:
    for key, value in mapping.items():
        if prefix == "" and key in JOINTS:
            yield f"{key}:\n"
            yield from _lines(value, f"{key}_", "  ")
        else:
            text = yaml.safe_dump(value, default_flow_style=True, allow_unicode=True, width=1000).removesuffix("...\n")
            yield f"{indent}{key}: {text.strip()}  # {meaning(prefix + key)}\n"


def meaning(key: str) -> str:
    """Unit and meaning of a key of a machine, "input_joint_stiffness" for input_joint.stiffness."""
    if key in _REMARKS:
        return _REMARKS[key]
    column = COLUMNS[key]
    unit = f"{column.unit.replace('^2', '²')}; " if column.unit else ""
    choices = f" ({', '.join(_CHOICES[key])})" if key in _CHOICES else ""
    return f"{unit}{column.description}{choices}"


def asked(machine: Mapping[str, Any]) -> dict[str, Any]:
    """The machine with what is answered on the terminal; an empty answer keeps the value, a refused one is asked for
    again with the reason."""
    answers: dict[str, Any] = {**machine, **{joint: dict(machine[joint]) for joint in JOINTS}}
    for owner, prefix in ((answers, ""), *((answers[joint], f"{joint}_") for joint in JOINTS)):
        for key in [key for key in owner if key not in JOINTS and key != "effects"]:
            _ask(answers, owner, key, prefix)
    return answers


def _ask(machine: dict[str, Any], owner: dict[str, Any], key: str, prefix: str) -> None:
    kept = owner[key]
    while True:
        try:
            answer = input(f"{prefix}{key} [{kept}]  {meaning(prefix + key)}: ").strip()
        except EOFError:
            raise refuse("new", "ask", "false where nobody answers", True, "leave it out") from None
        if not answer:
            owner[key] = kept
            return
        try:
            owner[key] = number_or_text(answer)
            machine_from_mapping(machine)
            return
        except (IndexerError, yaml.YAMLError) as error:
            print(f"  {str(error).splitlines()[0]}", file=sys.stderr)


def number_or_text(answer: str) -> Any:
    """An answer as YAML reads it, and 8e3 as a number, which YAML takes for a text."""
    read = yaml.safe_load(answer)
    try:
        return float(read) if isinstance(read, str) else read
    except ValueError:
        return read


@hydra_command("new", positional="what")
def main(config: dict[str, Any]) -> None:
    """Write the file that was asked for."""
    check_choice("new", "what", config["what"], VERBS["new"].words)
    check_flag("new", "overwrite", config["overwrite"])
    check_flag("new", "ask", config["ask"])
    out = path_given("new", "out", config["out"])
    if out.suffix not in (".yaml", ".yml"):
        raise refuse("new", "out", "a file that ends in .yaml", str(out))
    if out.is_dir():
        raise refuse("new", "out", "a file", str(out), "a folder stands there, choose another name")
    if out.exists() and not config["overwrite"]:
        raise refuse("new", "out", "a new file", str(out), "set overwrite=true to replace it, or name another")
    machine = {**config["machine"], "name": out.stem if config["name"] is None else config["name"]}
    machine_from_mapping(machine)
    if config["ask"]:
        machine = asked(machine)
    with whole_file(out) as temporary:
        Path(temporary).write_text(machine_yaml(machine), encoding="utf-8")
    print(f"written {out}; simulate it with: indexer simulate {shlex.quote(f'machine={out}')}")


if __name__ == "__main__":
    main()
