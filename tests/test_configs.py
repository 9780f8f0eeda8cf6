"""Every YAML of conf/ loads, becomes the object it stands for and refuses an unknown key; every root composes."""

from __future__ import annotations

import copy
import functools
import re
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import pytest
import yaml
from hydra import compose, initialize_config_dir
from hydra.errors import ConfigCompositionException, MissingConfigException
from omegaconf import OmegaConf

from classifier.feature_choice import make_choice
from classifier.network import Mlp
from classifier.trainers import make_trainer
from datagen.campaigns import make_campaign
from datagen.order import order_from
from indexer_env.build import from_mapping
from indexer_env.diagnosis_task import task_from_mapping
from indexer_env.errors import ParameterError
from indexer_env.fault_law import fault_law
from indexer_env.machine import machine_from_mapping
from indexer_env.operating_point import OperatingPoint
from indexer_env.presets import config_dir
from indexer_env.sensors import Sensor
from indexer_experiments.study.lab import Size

CONF = config_dir()
FILES = sorted(CONF.rglob("*.yaml"))
GROUPS: dict[str, Callable[[Mapping[str, Any]], object]] = {
    "machine": machine_from_mapping,
    "operating_point": lambda mapping: from_mapping(OperatingPoint, mapping),
    "sensor": lambda mapping: from_mapping(Sensor, mapping),
    "faults_law": fault_law,
    "diagnosis": task_from_mapping,
    "campaign": make_campaign,
    "features": make_choice,
    "net": lambda mapping: from_mapping(Mlp, {"inputs": 101, "outputs": 5, **mapping}, owner="net"),
    "trainer": make_trainer,
    "size": lambda mapping: from_mapping(Size, mapping, owner="size"),
}
"""What the YAML files of each folder become."""

CHOICES = [path for path in FILES if path.parent != CONF]
SHARED = "@package"
ROOTS = [path for path in FILES if path.parent == CONF and SHARED not in path.read_text().splitlines()[0]]


@functools.cache
def loaded(path: Path) -> object:
    return yaml.safe_load(path.read_text(encoding="utf-8"))


def plain(path: Path) -> dict[str, Any]:
    """What a file holds, free to change."""
    mapping = copy.deepcopy(loaded(path))
    assert isinstance(mapping, dict), path
    return mapping


def choice(path: Path) -> dict[str, Any]:
    """What a choice of a group holds, without the choices of other groups that come with it."""
    return {key: value for key, value in plain(path).items() if key != "defaults"}


def identity(path: Path) -> str:
    return str(path.relative_to(CONF))


def composed(root: Path, *overrides: str) -> dict[str, Any]:
    """A root as its command sees it, with the first choice of every group that must be chosen."""
    given = {override.partition("=")[0] for override in overrides}
    needed = []
    for entry in plain(root).get("defaults", []):
        if isinstance(entry, dict):
            for group, choice in entry.items():
                if choice == "???" and group not in given:
                    needed.append(f"{group}={sorted((CONF / group).glob('*.yaml'))[0].stem}")
    with initialize_config_dir(str(CONF), version_base="1.3"):
        config = compose(root.stem, [*needed, *overrides])
    values = OmegaConf.to_container(config)
    assert isinstance(values, dict)
    return {str(key): value for key, value in values.items()}


# -------------------------------------------------------------------------------- files


def test_configs_are_found():
    assert {path.parent.name for path in CHOICES} == set(GROUPS)
    assert {path.stem for path in ROOTS} >= {"generate", "train", "diagnose"}


@pytest.mark.parametrize("path", FILES, ids=identity)
def test_a_file_is_a_mapping_without_doubled_keys(path):
    """YAML itself lets the second of two equal keys win in silence."""

    class Strict(yaml.SafeLoader):
        pass

    def mapping(loader: Strict, node: yaml.MappingNode) -> dict[Any, Any]:
        keys = [loader.construct_object(key) for key, _ in node.value]
        assert len(keys) == len(set(keys)), f"{path}: {keys}"
        return yaml.SafeLoader.construct_mapping(loader, node, deep=True)

    Strict.add_constructor(yaml.resolver.BaseResolver.DEFAULT_MAPPING_TAG, mapping)
    found = yaml.load(path.read_text(encoding="utf-8"), Strict)
    assert isinstance(found, dict) and found
    assert OmegaConf.load(path) is not None


def numbers_in(text: str) -> list[str]:
    """Lines that give a number to a key."""
    number = r"^\s*(- )?[\w]+:\s*[-+]?(\d[\d_]*\.?\d*|\.\d+)([eE][-+]?\d+)?\s*(#.*)?$"
    return [line for line in text.splitlines() if re.match(number, line)]


@pytest.mark.parametrize(
    "path", [p for p in FILES if p.parent.name in ("machine", "operating_point", "sensor", "diagnosis")], ids=identity
)
def test_every_number_of_a_preset_has_its_unit_and_reason_beside_it(path):
    lines = numbers_in(path.read_text(encoding="utf-8"))
    assert lines
    for line in lines:
        assert len(line.partition("#")[2].strip()) > 2, f"{path}: {line}"


# -------------------------------------------------------------------------------- choices


@pytest.mark.parametrize("path", CHOICES, ids=identity)
def test_a_choice_becomes_its_object(path):
    make, mapping = GROUPS[path.parent.name], choice(path)
    assert make(mapping) == make(choice(path))


def places(mapping: Mapping[str, Any], *keys: str) -> list[tuple[str, ...]]:
    """The mapping itself and every mapping inside it, as paths of keys."""
    inner = [place for key, value in mapping.items() if isinstance(value, dict) for place in places(value, *keys, key)]
    return [keys, *inner]


@pytest.mark.parametrize("path", CHOICES, ids=identity)
def test_a_choice_refuses_an_unknown_key_at_every_level(path):
    make = GROUPS[path.parent.name]
    for place in places(choice(path)):
        mapping = choice(path)
        inner = mapping
        for key in place:
            inner = inner[key]
        inner["unheard_of"] = 1.0
        with pytest.raises(ParameterError, match="unheard_of") as caught:
            make(mapping)
        assert "\n" not in str(caught.value) and str(caught.value).endswith("."), place


@pytest.mark.parametrize("path", CHOICES, ids=identity)
def test_a_choice_refuses_every_number_made_text(path):
    make = GROUPS[path.parent.name]
    for place in places(choice(path)):
        inner = choice(path)
        for key in place:
            inner = inner[key]
        for name in [key for key, value in inner.items() if type(value) in (int, float)]:
            mapping = choice(path)
            here = mapping
            for key in place:
                here = here[key]
            here[name] = str(here[name])
            with pytest.raises(ParameterError) as caught:
                make(mapping)
            assert re.search(rf"must be .*, got '{re.escape(str(inner[name]))}'", str(caught.value)), (place, name)


# -------------------------------------------------------------------------------- roots


@pytest.mark.parametrize("root", ROOTS, ids=identity)
def test_a_root_composes(root):
    config = composed(root)
    own = set(plain(root)) - {"defaults"}
    assert own <= set(config)
    for name in set(config) & set(GROUPS):
        GROUPS[name](config[name])


@functools.cache
def groups_of(root: Path) -> list[str]:
    return sorted(set(composed(root)) & set(GROUPS))


@pytest.mark.parametrize("root", ROOTS, ids=identity)
def test_a_root_composes_with_every_choice_of_its_groups(root):
    """All groups at once: the n-th composition has the n-th choice of each, from the first again after the last."""
    options = {group: sorted((CONF / group).glob("*.yaml")) for group in groups_of(root)}
    for n in range(max(map(len, options.values()), default=0)):
        chosen = {group: files[n % len(files)] for group, files in options.items()}
        config = composed(root, *(f"{group}={option.stem}" for group, option in chosen.items()))
        assert {group: config[group] for group in chosen} == {group: choice(path) for group, path in chosen.items()}


@pytest.mark.parametrize("root", ROOTS, ids=identity)
def test_a_root_refuses_an_unknown_key_and_an_unknown_choice(root):
    with pytest.raises(ConfigCompositionException, match="unheard_of"):
        composed(root, "unheard_of=1")
    for group in groups_of(root):
        with pytest.raises(MissingConfigException):
            composed(root, f"{group}=unheard_of")
        with pytest.raises(ConfigCompositionException, match="unheard_of"):
            composed(root, f"{group}.unheard_of=1")


@pytest.mark.parametrize("root", ROOTS, ids=identity)
def test_hydra_leaves_nothing_in_the_working_folder(root):
    with initialize_config_dir(str(CONF), version_base="1.3"):
        config = compose(root.stem, return_hydra_config=True, overrides=["campaign=table2"] * (root.stem == "generate"))
    assert config.hydra.output_subdir is None
    assert OmegaConf.to_container(config.hydra.run, resolve=False) == {"dir": "."}


def test_the_bench_campaign_brings_its_sensor_and_the_command_line_another():
    root = CONF / "generate.yaml"
    assert composed(root, "campaign=bench")["sensor"] == plain(CONF / "sensor" / "bench.yaml")
    assert composed(root, "campaign=bench", "sensor=ideal")["sensor"] == plain(CONF / "sensor" / "ideal.yaml")


@pytest.mark.parametrize(
    ("campaign", "size"), [("table2", 126), ("bench", 200), ("random", 1000), ("wear", 1000), ("grid", 1)]
)
def test_count_null_is_the_campaign_s_own_size(campaign, size):
    config = composed(CONF / "generate.yaml", f"campaign={campaign}")
    assert config["count"] is None and order_from(config).count == size


def test_the_data_set_s_root_is_an_order_of_the_reference_machine():
    root = CONF / "generate.yaml"
    order = order_from({**composed(root), "out": "x"})
    assert order.count == 1 and order.base.machine == machine_from_mapping(plain(CONF / "machine" / "reference.yaml"))
