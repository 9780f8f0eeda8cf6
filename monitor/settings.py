"""conf/monitor.yaml -> objects that check themselves."""

from __future__ import annotations

import ipaddress
import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from pathlib import Path
from typing import Any

from indexer_cli.job_paths import path_given
from indexer_env.checks import check_integer, check_number
from indexer_env.errors import refuse
from indexer_records.conditions import Pulse
from indexer_records.measured import Reading
from monitor.alarms import Rules, limits_of_key
from monitor.given import check_ignored, check_texts, forget_of, load_torque_of, motor_speeds_of, owner_of, unsigned
from monitor.plan import Plan
from monitor.sources.mqtt import Tls
from monitor.sources.opcua import Nodes
from monitor.store.archive import FOLDER

ADDRESSES = ("mqtt://", "mqtts://", "opc.tcp://", "folder:", "replay:")
"""How a source begins that is neither the demonstration nor the built-in broker."""

_LEAST_SECRET = 16

DEMO_MODEL = "demo-model"
"""Folder of the demonstration's model, below the monitor's own."""

_OWN = ("monitor.sqlite*", FOLDER, DEMO_MODEL)
"""What a monitor leaves in its folder."""

_WIDEST = 20.0
"""Radius beyond that of any table [m]: it was given in mm."""

_OF_VOLUMES = "lost+found"
"""What a file system has in the folder that it is mounted on."""


@dataclass(frozen=True)
class Access:
    """Who may use the page.

    Attributes
    ----------
    operator_token, viewer_token, proxy_secret : str or None
        Secrets of at least 16 characters.
    operators : tuple of str
        Names from the proxy that may act.
    """

    operator_token: str | None = field(default=None, repr=False)
    viewer_token: str | None = field(default=None, repr=False)
    proxy_secret: str | None = field(default=None, repr=False)
    operators: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        for name in ("operator_token", "viewer_token", "proxy_secret"):
            value = getattr(self, name)
            if value is not None and (not isinstance(value, str) or len(value) < _LEAST_SECRET):
                raise refuse("auth", name, f"a text of {_LEAST_SECRET} signs at least, or null", "another")
        names = self.operators
        if not isinstance(names, list | tuple) or not all(isinstance(name, str) for name in names):
            raise refuse("auth", "operators", "a list of names", names)
        object.__setattr__(self, "operators", tuple(self.operators))

    @property
    def needed(self) -> bool:
        """Whether anybody must show who he is."""
        return any((self.operator_token, self.viewer_token, self.proxy_secret))


@dataclass(frozen=True)
class Webhook:
    """Where alarms are posted."""

    url: str | None = None
    secret: str | None = field(default=None, repr=False)

    def __post_init__(self) -> None:
        if self.url is not None and not str(self.url).startswith(("http://", "https://")):
            raise refuse("webhook", "url", "http://… or https://…, or null", self.url)
        if self.url is not None and (not isinstance(self.secret, str) or len(self.secret) < _LEAST_SECRET):
            raise refuse(
                "webhook", "secret", f"a text of {_LEAST_SECRET} signs at least where there is a url", "another"
            )


@dataclass(frozen=True)
class Settings:
    """All of conf/monitor.yaml."""

    source: str
    models: tuple[Path, ...]
    twin: Path | None
    twin_limits: Mapping[str, Any]
    deadband: float
    load_torque: float | None
    motor_speeds: tuple[float, ...] | None
    physics_h: float
    out: Path
    store: str
    plan: Plan
    host: str
    port: int
    broker_port: int
    mqtt_version: int
    client_id: str
    tls: Tls
    opcua: Nodes
    reading: Reading
    pulse_column: str | None
    settle: float
    speed: float
    reorder: float
    stale: float
    raw_days: float
    turn_days: float
    access: Access
    webhook: Webhook
    publish: str | None
    owner: str | None
    lease_s: float
    forget: tuple[str, ...] = ()

    @property
    def local(self) -> bool:
        """Whether the page is for this host alone, known by no other name: nobody signs in, himself or by a proxy."""
        return is_local(self.host) and not self.access.needed


_SECTIONS = (
    "clock",
    "physics",
    "keep",
    "mqtt",
    "opcua",
    "read",
    "pulse",
    "webhook",
    "auth",
    "alarms",
    "limits",
    "lease",
)
"""Keys below which further settings stand."""


_LONGEST_D, _LONGEST_H, _LONGEST_S = 36500.0, 876000.0, 3.15e9
"""A hundred years in days, hours and seconds: longer ones are no times that the store can hold."""


def is_local(host: str) -> bool:
    """Whether an address is of this host alone."""
    if host == "localhost":
        return True
    try:
        return ipaddress.ip_address(host).is_loopback
    except ValueError:
        return False


def settings_of(config: Mapping[str, Any]) -> Settings:
    """The settings of a composed configuration.

    Raises
    ------
    ParameterError
        A value breaks its rule.
    """
    for key in _SECTIONS:
        if not isinstance(config[key], Mapping):
            raise refuse(
                "monitor", key, "a mapping of its settings", config[key], f"leave {key} out, or set {key}.NAME"
            )
    for key, low, high in (("port", 0, 65535), ("broker_port", 0, 65535)):
        check_integer("monitor", key, config[key], low=low, high=high)
    for key in ("settle", "speed"):
        check_number("monitor", key, config[key], low=0.0, low_open=key == "speed")
    for key in ("jitter", "reorder", "stale"):
        check_number("clock", key, config["clock"][key], low=0.0, low_open=key == "stale", high=_LONGEST_S, unit="s")
    check_number("physics", "every", config["physics"]["every"], low=0.0, low_open=True, high=_LONGEST_H, unit="h")
    if not isinstance(config["twin_limits"], Mapping | None):
        raise refuse("monitor", "twin_limits", "limits by fault, {reducer_play: [2, 4, 8]}", config["twin_limits"])
    check_ignored(config)
    check_texts(config)
    for key in ("raw_days", "turn_days"):
        remedy = "36500 days are a hundred years"
        check_number("keep", key, config["keep"][key], low=0.0, low_open=True, high=_LONGEST_D, unit="d", remedy=remedy)
    if config["mqtt"]["version"] not in (3, 5):
        raise refuse("mqtt", "version", "5 or 3", config["mqtt"]["version"])
    for key in ("source", "host"):
        if not isinstance(config[key], str) or not config[key]:
            raise refuse("monitor", key, "a text", config[key])
    out, owner = _out_of(config), owner_of(config)
    access, webhook = Access(**config["auth"]), Webhook(**config["webhook"])
    if not is_local(config["host"]) and not access.needed:
        remedy = "set auth.operator_token, or listen on 127.0.0.1"
        raise refuse("monitor", "host", "localhost where no token and no proxy is set", config["host"], remedy)
    given = config["model"]
    models = () if given is None else tuple(given) if isinstance(given, list) else (given,)
    source = config["source"]
    twin = None if config["twin"] is None else path_given("monitor", "twin", config["twin"])
    if source not in ("demo", "broker") and not source.startswith(ADDRESSES):
        rule = f"demo, broker or an address that begins with {', '.join(ADDRESSES)}"
        raise refuse("monitor", "source", rule, unsigned(source))
    if twin is not None and models:
        raise refuse("monitor", "twin", "given instead of model, not beside it", str(twin), "leave one of them out")
    if (models or twin is not None) and source == "demo":
        rule = "that of your machine where a model or a twin is given"
        raise refuse("monitor", "source", rule, source, "name it, as in --help")
    if source != "demo" and not models and twin is None:
        remedy = "train one with indexer train, or name a twin"
        raise refuse("monitor", "model", "the folder of a trained model", None, remedy)
    return Settings(
        source=source,
        models=tuple(path_given("monitor", "model", model) for model in models),
        twin=twin,
        twin_limits=config["twin_limits"] or {},
        deadband=config["alarms"]["deadband"],
        load_torque=load_torque_of(config["load_torque"]),
        motor_speeds=motor_speeds_of(config["motor_speeds_rpm"]),
        physics_h=float(config["physics"]["every"]),
        out=out,
        store=config["store"] or f"sqlite:///{out.resolve() / 'monitor.sqlite'}",
        plan=_plan(config),
        host=config["host"],
        port=config["port"],
        broker_port=config["broker_port"],
        mqtt_version=config["mqtt"]["version"],
        client_id="-".join(filter(None, (config["mqtt"]["client_id"], owner))),
        tls=Tls(**{key: config["mqtt"][key] for key in ("authority", "certificate", "key")}),
        opcua=Nodes(**config["opcua"]),
        reading=Reading(**config["read"]),
        pulse_column=config["pulse"]["column"],
        settle=float(config["settle"]),
        speed=float(config["speed"]),
        reorder=float(config["clock"]["reorder"]),
        stale=float(config["clock"]["stale"]),
        raw_days=float(config["keep"]["raw_days"]),
        turn_days=float(config["keep"]["turn_days"]),
        access=access,
        webhook=webhook,
        publish=config["publish"],
        owner=owner,
        lease_s=float(config["lease"]["seconds"]),
        forget=forget_of(config),
    )


def _out_of(config: Mapping[str, Any]) -> Path:
    """The monitor's folder: a new one, an empty one, or one that a monitor has left."""
    out = path_given("monitor", "out", config["out"])
    try:
        held = sorted(path.name for path in out.iterdir()) if out.is_dir() else []
    except OSError as error:
        raise refuse("monitor", "out", f"a folder that can be read ({error.strerror})", str(out)) from None
    held = [name for name in held if not name.startswith(".") and name != _OF_VOLUMES]
    if held and not any(fnmatchcase(name, own) for name in held for own in _OWN):
        rule = "a new folder, an empty one or one of an earlier monitor"
        raise refuse("monitor", "out", rule, str(out), f"it holds other files ({held[0]}); name another")
    return out


def _plan(config: Mapping[str, Any]) -> Plan:
    alarms, pulse = config["alarms"], config["pulse"]
    check_integer("alarms", "window", alarms["window"], low=1, unit="turns")
    if config["stations"] is not None:
        check_integer("monitor", "stations", config["stations"], low=2, high=1000)
    radius = config["sensor_radius"]
    if radius is not None:
        check_number("monitor", "sensor_radius", radius, low=0.0, low_open=True, high=_WIDEST, unit="m")
    for key in ("low", "high"):
        check_number("pulse", key, pulse[key])
    if pulse["angle_deg"] is not None:
        check_number("pulse", "angle_deg", pulse["angle_deg"], unit="degrees")
    if not pulse["low"] < pulse["high"]:
        raise refuse("pulse", "high", "greater than pulse.low", pulse["high"])
    limits = {}
    for name, steps in config["limits"].items():
        if steps is None:
            continue
        limits[name] = limits_of_key("limits", name, steps, alarms["deadband"])
    return Plan(
        limits=limits,
        rules=Rules(alarms["on_delay"], alarms["off_delay"], alarms["re_alarm"]),
        window=alarms["window"],
        jitter=float(config["clock"]["jitter"]),
        pulse_range=(float(pulse["low"]), float(pulse["high"])),
        pulse=Pulse(None, None, pulse["edge"], pulse["tolerance"]),
        pulse_angle=None if pulse["angle_deg"] is None else math.radians(pulse["angle_deg"]),
        sensor_radius=radius,
        stations=config["stations"],
    )
