"""Where the YAML presets live, and how to load one by name or path."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any, TypeVar

from indexer_env.build import from_mapping
from indexer_env.checks import did_you_mean
from indexer_env.errors import ParameterError, refuse
from indexer_env.machine import Machine, machine_from_mapping
from indexer_env.operating_point import OperatingPoint
from indexer_env.sensors import Sensor

_ENDINGS = (".yaml", ".yml")

_T = TypeVar("_T")


def config_dir() -> Path:
    """The folder of YAML files: `indexer_env/conf` inside an installed wheel, `conf` beside it in a checkout."""
    inside = Path(__file__).parent / "conf"
    return inside if inside.is_dir() else Path(__file__).parent.parent / "conf"


def load_yaml(group: str, name_or_path: str | Path) -> dict[str, Any]:
    """Read a preset of a group (`machine`, `operating_point`, `sensor`) by name, or a YAML file by path.

    Raises
    ------
    ParameterError
        No such preset or file, not a YAML mapping, or a key that stands twice.
    """
    import yaml

    if not isinstance(name_or_path, str | Path):
        raise refuse("presets", group, "the name of a preset or the path of a YAML file", name_or_path)
    folder = config_dir() / group
    text = str(name_or_path)
    path = Path(text) if text.endswith(_ENDINGS) else folder / f"{text}.yaml"
    if not path.is_file():
        names = sorted(preset.stem for preset in folder.glob("*.yaml"))
        hint = did_you_mean(text, names) or "the presets are " + ", ".join(names)
        raise ParameterError(f"There is no {group} preset or YAML file {text!r}; {hint}.")
    try:
        written = path.read_text(encoding="utf-8")
        _refuse_doubled(yaml.compose(written, yaml.SafeLoader), path)
        content = yaml.safe_load(written)
    except (yaml.YAMLError, UnicodeDecodeError) as error:
        where = str(error).replace("\n", " ")
        raise ParameterError(f"{path} is not readable YAML: {where}.") from error
    if not isinstance(content, dict):
        raise ParameterError(f"{path} must hold a mapping of parameters to values, got {type(content).__name__}.")
    return content


def _refuse_doubled(node: Any, path: Path) -> None:
    """Refuse a key that stands twice in a mapping of a composed file, of which YAML keeps the last without a word."""
    if not isinstance(getattr(node, "value", None), list):
        return
    keys = [key.value for key, _ in node.value if isinstance(key.value, str)] if node.id == "mapping" else []
    for key in keys:
        if keys.count(key) > 1:
            raise ParameterError(f"{path} gives {key!r} {keys.count(key)} times in one mapping; keep one of them.")
    for entry in node.value:
        for part in entry if isinstance(entry, tuple) else (entry,):
            _refuse_doubled(part, path)


def with_own_table(content: dict[str, Any], name_or_path: str | Path) -> dict[str, Any]:
    """What a machine's file holds, with the path of the table of its motion law where that lies beside the file."""
    law = content.get("motion_law")
    if not isinstance(law, dict) or not isinstance(law.get("file"), str):
        return content
    beside = Path(name_or_path).parent / law["file"]
    return {**content, "motion_law": law | {"file": str(beside)}} if beside.is_file() else content


def _built(build: Callable[[dict[str, Any]], _T], group: str, name_or_path: str | Path) -> _T:
    """What a preset or file describes; a refusal begins with the file that it is about."""
    content = with_own_table(load_yaml(group, name_or_path), name_or_path)
    try:
        return build(content)
    except ParameterError as error:
        if not str(name_or_path).endswith(_ENDINGS):
            raise
        raise ParameterError(f"{name_or_path}: {error}") from None


def load_machine(name_or_path: str | Path = "reference") -> Machine:
    """A machine preset by name (`conf/machine`) or a YAML file by path.

    A table of its motion law, ``motion_law: {name: table, file: cam.csv}``, lies beside that file, else in the working
    directory.
    """
    return _built(machine_from_mapping, "machine", name_or_path)


def load_operating_point(name_or_path: str | Path = "reference") -> OperatingPoint:
    """An operating point preset by name (`conf/operating_point`) or a YAML file by path."""
    return _built(partial(from_mapping, OperatingPoint), "operating_point", name_or_path)


def load_sensor(name_or_path: str | Path = "ideal") -> Sensor:
    """A sensor preset by name (`conf/sensor`) or a YAML file by path."""
    return _built(partial(from_mapping, Sensor), "sensor", name_or_path)
