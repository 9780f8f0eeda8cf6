"""`indexer generate [campaign=NAME] out=FOLDER`: generate a data set."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any

from hydra import compose
from hydra.core.hydra_config import HydraConfig
from hydra.core.override_parser.overrides_parser import OverridesParser
from omegaconf import OmegaConf
from rich.table import Table

from datagen.base import base_value
from datagen.draws import effect_of
from datagen.executors import make_executor
from datagen.generate import generate
from datagen.laws_in_place import laws_moved
from datagen.order import Order, base_from, order_from
from datagen.quantities import path_of
from datagen.store import REJECTED
from indexer_cli.command import check_flag, hydra_command
from indexer_cli.job_paths import job_place
from indexer_cli.words import counted, plain_console
from indexer_env.errors import refuse

_PRESETS = ("machine", "operating_point", "sensor")


@hydra_command("generate")
def main(config: dict[str, Any]) -> dict[str, Any]:
    """Generate the data set of a composed configuration and say what it holds."""
    overwrite = config["overwrite"]
    check_flag("datagen", "overwrite", overwrite)
    folder = job_place("datagen", config["out"])
    order = order_from(config)
    _refuse_idle(order, config)
    executor = make_executor(config["executor"], config["workers"], config["address"])
    manifest = generate(order, folder, overwrite=overwrite, executor=executor)
    _say(manifest, folder)
    return {name: manifest[name] for name in ("records", "rejected", "not_settled")}


def _refuse_idle(order: Order, config: Mapping[str, Any]) -> None:
    """A value given for what the campaign decides or draws anyhow would be lost without a word."""
    campaign = order.campaign
    for override, key, value in (*_values_given(), *_values_of_presets(order, config)):
        path = path_of(key)
        if path in campaign.decides:
            remedy = f"see conf/campaign/{campaign.name}.yaml for what can be changed"
            raise refuse("datagen", key, f"left to the campaign {campaign.name}", override, remedy)
        for setting, stage in (("draws", campaign.machine_laws), ("drift", campaign.item_laws)):
            law = stage.laws.get(path) if path else None
            if path and law is not None and not law.needs_nominal and not isinstance(value, Mapping):
                effect = effect_of(path)
                remedy = f"add ~campaign.{setting}.{f'effects.{effect}' if effect else key} to fix it"
                raise refuse("datagen", key, f"left to campaign.{setting}, which draws it", override, remedy)


def _values_given() -> Iterator[tuple[str, str, Any]]:
    """Overrides of the command's line with the key and value of each quantity in them: `machine.effects.X={torque: 5}`
    gives the key machine.effects.X.torque."""
    for override in OverridesParser.create().parse_overrides(HydraConfig.get().overrides.task):
        for key, value in _quantities(override.key_or_group, override.value()):
            yield str(override.input_line), key, value


def _values_of_presets(order: Order, config: Mapping[str, Any]) -> Iterator[tuple[Any, str, Any]]:
    """The same of each machine, operating point and sensor that was chosen by a preset or file: what it has unlike the
    default one, but for what the campaign draws about it; a value stands in the place of the override."""
    given = HydraConfig.get().overrides
    parsed = OverridesParser.create().parse_overrides([*given.task, *given.hydra])
    chosen = [one.key_or_group for one in parsed if one.key_or_group in _PRESETS and isinstance(one.value(), str)]
    if not chosen:
        return
    # A file for the campaign lies where `hydra.searchpath` leads to.
    kept = [str(one.input_line) for one in parsed if one.key_or_group in ("campaign", "hydra.searchpath")]
    default = OmegaConf.to_container(compose("generate", [*kept, "out=."]), resolve=True)
    assert isinstance(default, dict)
    usual = base_from(laws_moved({str(key): value for key, value in default.items()}))
    for group in chosen:
        for key, value in _quantities(group, config[group]):
            path = path_of(key)
            differs = path is not None and base_value(order.base, path) != base_value(usual, path)
            if differs and path not in order.campaign.refines:
                yield value, key, value


def _quantities(key: str, value: Any) -> Iterator[tuple[str, Any]]:
    if not isinstance(value, Mapping) or path_of(key):  # the mapping of a quantity is its law
        yield key, value
        return
    for name, inner in value.items():
        yield from _quantities(f"{key}.{name}", inner)


def _say(manifest: dict[str, Any], folder: str) -> None:
    console = plain_console()
    table = Table(title=f"{manifest['campaign']}, seed {manifest['seed']}", title_justify="left")
    table.add_column("class")
    table.add_column("records", justify="right")
    for name, records in manifest["classes"].items():
        if records:
            table.add_row(name, str(records))
    console.print(table)
    subsets = ", ".join(f"{records} {name}" for name, records in manifest["subsets"].items())
    console.print(f"{counted(manifest['records'], 'record')} ({subsets}) in {folder}")
    if manifest["not_settled"]:
        console.print(f"{manifest['not_settled']} of them not settled after the warm-up (column warmup_settled)")
    if manifest["rejected"]:
        console.print(f"{counted(manifest['rejected'], 'item')} rejected, with reasons in {folder}/{REJECTED}")


if __name__ == "__main__":
    main()
