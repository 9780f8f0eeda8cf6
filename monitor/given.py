"""What of conf/monitor.yaml is refused before anything is made of it, and keys that are read one by one."""

from __future__ import annotations

import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from indexer_env.checks import check_number
from indexer_env.errors import refuse
from indexer_env.presets import config_dir, load_yaml
from indexer_env.units import RPM
from monitor.plan import CHANGE

_OF_TWINS = {"monitor": ("twin_limits", "load_torque", "motor_speeds_rpm", "physics"), "pulse": ("angle_deg",)}

_TEXTS = {
    "monitor": ("store", "publish"),
    "mqtt": ("authority", "certificate", "key"),
    "opcua": ("certificate", "key", "server", "user"),
}


def check_ignored(config: Mapping[str, Any]) -> None:
    """What counts for nothing beside a twin, or without one, is refused where it was set."""
    usual = load_yaml("monitor", config_dir() / "monitor.yaml")
    if config["twin"] is None:
        for section, keys in _OF_TWINS.items():
            given, default = (one if section == "monitor" else one[section] for one in (config, usual))
            for key in keys:
                if given[key] != default[key]:
                    rule = "left out where no twin is given"
                    raise refuse(section, key, rule, given[key], "it is for a twin alone")
        return
    for name, steps in config["limits"].items():
        if name != CHANGE and steps != usual["limits"].get(name):
            rule = "left out where a twin is given, which has limits of its own"
            remedy = "set those of its faults in their units, twin_limits={reducer_play: [2, 4, 8]}"
            raise refuse("limits", name, rule, steps, remedy)


def check_texts(config: Mapping[str, Any]) -> None:
    """Keys that hold a text or nothing, the name for the broker, and a topic to which can be published."""
    for section, keys in _TEXTS.items():
        values = config if section == "monitor" else config[section]
        for key in keys:
            if values[key] is not None and (not isinstance(values[key], str) or not values[key]):
                raise refuse(section, key, "a text, or null", values[key])
    client_id = config["mqtt"]["client_id"]
    if not isinstance(client_id, str) or not client_id:
        raise refuse("mqtt", "client_id", "a text, another for each monitor", client_id)
    publish = config["publish"]
    if publish is not None and re.search("[+#]", publish):
        raise refuse("monitor", "publish", "a topic without + and #, or null", publish)


def check_at_hand(source: str, publish: str | None) -> None:
    """What the monitor is to read is there, and what it publishes has a broker."""
    if source.startswith("folder:") and not Path(source.removeprefix("folder:")).is_dir():
        raise refuse("monitor", "source", "a folder that is there", source)
    if publish is not None and source not in ("demo", "broker") and not source.startswith("mqtt"):
        raise refuse("monitor", "publish", "null where the source is no broker", publish)


def owner_of(config: Mapping[str, Any]) -> str | None:
    """Name of this monitor among those that share a store; None: it has the store alone."""
    owner = config["lease"]["owner"]
    check_number("lease", "seconds", config["lease"]["seconds"], low=1.0, high=86400.0, unit="s")
    if owner is None:
        return None
    if not isinstance(owner, str) or not re.fullmatch(r"[\w.-]{1,40}", owner):
        raise refuse("lease", "owner", "a name of at most 40 letters, digits and '.-', or null", owner)
    if not str(config["source"]).startswith(("mqtt://", "mqtts://", "opc.tcp://")):
        rule = "given with a source that every process can subscribe to, mqtt:// or opc.tcp://"
        raise refuse("lease", "owner", rule, unsigned(str(config["source"])))
    return owner


def forget_of(config: Mapping[str, Any]) -> tuple[str, ...]:
    """Names of machines that are to be forgotten."""
    given = config["forget"]
    names = [given] if isinstance(given, str) else given
    if not isinstance(names, list) or not all(isinstance(name, str) and name for name in names):
        raise refuse("monitor", "forget", "the name of a machine, or a list of names", given)
    if names and config["lease"]["owner"] is not None:
        remedy = "stop the others, and start one without lease.owner"
        raise refuse("monitor", "forget", "left out where several monitors share a store", given, remedy)
    return tuple(names)


def unsigned(source: str) -> str:
    """A source without the user and password that its address may hold, for a sentence."""
    scheme, colon, rest = source.partition(":")
    return f"{scheme}:…@{rest.rpartition('@')[2]}" if colon and "@" in rest else source


def load_torque_of(given: Any) -> float | None:
    """Load under which the machines run [N m]."""
    if given is None:
        return None
    check_number("monitor", "load_torque", given, unit="N m")
    return float(given)


def motor_speeds_of(given: Any) -> tuple[float, ...] | None:
    """Speeds at which the machines run [rad/s]."""
    if given is None:
        return None
    if not isinstance(given, list) or not given:
        raise refuse("monitor", "motor_speeds_rpm", "a list of one speed or more, or null", given)
    for speed in given:
        check_number("monitor", "motor_speeds_rpm", speed, low=0.0, low_open=True, unit="rpm")
    return tuple(float(speed) * RPM for speed in given)
