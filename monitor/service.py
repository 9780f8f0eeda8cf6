"""All of a monitor, started and stopped together."""

from __future__ import annotations

import contextlib
import logging
import socket
import threading
import time
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path

import torch
import uvicorn

from indexer_cli.places.local import LocalPlace
from indexer_env.errors import IndexerError, refuse
from monitor.analysis.finding import Diagnoser
from monitor.analysis.twin import TwinDiagnoser
from monitor.diagnoser import diagnoser_of
from monitor.engine import Engine
from monitor.given import check_at_hand
from monitor.leases import Leases
from monitor.outputs.metrics import Metrics
from monitor.outputs.outbox import Sender, forget_others
from monitor.outputs.publish import CHANNEL as MQTT_CHANNEL
from monitor.outputs.publish import MqttDelivery
from monitor.outputs.webhook import CHANNEL as WEB_CHANNEL
from monitor.outputs.webhook import WebhookDelivery
from monitor.physics import Physics
from monitor.plan import Change
from monitor.settings import DEMO_MODEL, Settings
from monitor.sources import demo
from monitor.sources.base import Source
from monitor.sources.broker import HOST, BuiltInBroker
from monitor.sources.folder import FolderSource
from monitor.sources.mqtt import Broker, MqttSource, read_url
from monitor.sources.opcua import SCHEME, OpcUaSource
from monitor.sources.replay import ReplaySource
from monitor.store import Store, StoreDown
from monitor.store.archive import DAY_NS, forgotten, keep
from monitor.web.access import Gate
from monitor.web.api import Api
from monitor.web.app import listener, make_app
from monitor.web.hub import Hub

_log = logging.getLogger(__name__)

BUILT_IN_TOPIC = demo.TOPIC.format("+")

_KEEPING_S = 30.0
_DEMO_RECORDS = 1200
_DEMO_RADIUS_M = 0.4
_DEMO_DAYS = demo.TURNS * demo.HOURS / 24.0


class _Server(uvicorn.Server):
    """Ends the streams of open pages before it waits for all connections to end."""

    def __init__(self, config: uvicorn.Config, hub: Hub) -> None:
        super().__init__(config)
        self._hub = hub

    async def shutdown(self, sockets: list[socket.socket] | None = None) -> None:
        """Let go of all pages, then as the server does."""
        self._hub.close()
        await super().shutdown(sockets)


class ServiceError(IndexerError, RuntimeError):
    """The monitor cannot start or has stopped by itself."""


class Service:
    """Everything that runs; `say` is told of the steps.

    Raises
    ------
    IndexerError
        What cannot be used, in one sentence.
    """

    def __init__(self, settings: Settings, say: Callable[[str], None] = print) -> None:
        self._settings, self._say = settings, say
        # A turn's network is far too small to be shared out among cores.
        torch.set_num_threads(1)
        with contextlib.ExitStack() as opened:
            diagnoser, settings = self._opened(opened)
            self._assemble(diagnoser, settings, opened)
            self._closing = opened.pop_all()

    def _opened(self, opened: contextlib.ExitStack) -> tuple[Diagnoser, Settings]:
        """Ports, models, sources, folder and store, in this order: a port or source in vain leaves no folder."""
        settings = self._settings
        check_at_hand(settings.source, settings.publish)
        if settings.source != "demo" and (settings.out / DEMO_MODEL).is_dir():
            rule = "another folder than the demonstration's, whose machines would stand among yours"
            raise refuse("monitor", "out", rule, str(settings.out), "give one, as out=line1")
        self._listener = opened.enter_context(listener(settings.host, settings.port))
        if settings.source == "demo":
            settings = self._settings = self._with_demo(settings)
        diagnoser, settings = diagnoser_of(settings)
        self.broker = self._built_in_broker(opened)
        self._sources = self._make_sources(diagnoser)
        try:
            settings.out.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise refuse("monitor", "out", f"a folder ({error.strerror})", str(settings.out)) from None
        if settings.owner is None:
            opened.enter_context(LocalPlace(settings.out).exclusive())
        try:
            self._store = Store(settings.store, settings.out)
        except StoreDown as error:
            raise ServiceError(f"store must be a database that can be reached ({error}).") from None
        opened.callback(self._store.close)
        for name in settings.forget:
            self._say(forgotten(self._store, name))
        return diagnoser, settings

    def _assemble(self, diagnoser: Diagnoser, settings: Settings, opened: contextlib.ExitStack) -> None:
        self._leases = None if settings.owner is None else Leases(self._store, settings.owner, settings.lease_s)
        self._hub = Hub()
        self._senders: list[Sender] = []
        channels = (*([WEB_CHANNEL] if settings.webhook.url else []), *([MQTT_CHANNEL] if settings.publish else []))
        self.physics, self._cautions = None, []
        if isinstance(diagnoser, TwinDiagnoser):
            self._cautions = [diagnoser.caution] if diagnoser.caution else []
            for sentence in self._cautions:
                self._say(f"Caution: {sentence}")
            self.physics = Physics(
                self._store, diagnoser.twin.folder, diagnoser.load_torque, diagnoser.modes, settings.physics_h,
                settings.plan.sensor_radius, settings.plan.pulse_angle, self._hub.tell,
            )  # fmt: skip
        self.engine = Engine(
            self._store, diagnoser, settings.plan, channels, self._changed,
            stale_s=settings.stale, reorder_s=settings.reorder, leases=self._leases,
        )  # fmt: skip
        if self.broker is not None:
            self._sources += self._fed(self.broker)
        if self._leases is None:
            forget_others(self._store, channels)
        self._make_senders(opened)
        gate = Gate(settings.access)
        for source in self._sources:
            source.told = self._hub.again
        self.engine.told = self.engine.unread.told = self._hub.again
        api = Api(
            self._store, self.engine, diagnoser, settings.plan, self._hub, gate, physical=self.physics is not None,
            troubles=self._troubles,
        )  # fmt: skip
        app = make_app(api, Metrics(self.engine, self._store), settings.local, settings.host)
        config = uvicorn.Config(
            app, log_level="warning", access_log=False, timeout_graceful_shutdown=2, server_header=False, ws="none",
            limit_concurrency=500, h11_max_incomplete_event_size=16384, proxy_headers=False,
        )  # fmt: skip
        self._server = _Server(config, self._hub)
        self._stopping = threading.Event()

    def _changed(self, change: Change) -> None:
        self._hub.tell(change)
        if self.physics is not None:
            self.physics.consider(change)

    def _troubles(self) -> list[str]:
        """What keeps samples from coming or from being stored, and alarms from being delivered, as sentences."""
        told = [one.trouble for one in (self.engine, *self._sources, *self._senders) if one.trouble is not None]
        return [*self._cautions, *told, *self.engine.unread.sentences]

    @property
    def url(self) -> str:
        """Where the page is."""
        host, port = self._listener.getsockname()[:2]
        return f"http://{f'[{host}]' if ':' in host else host}:{port}/"

    def run(self) -> None:
        """Run until a signal comes or the engine fails."""
        with self._running():
            self._say(f"the page is at {self.url} (Ctrl-C ends)")
            self._server.run(sockets=[self._listener])
        if self.engine.failure is not None:
            raise ServiceError(f"the monitor has stopped: {self.engine.failure}.")

    def stop(self) -> None:
        """End `run` from another thread."""
        self._server.should_exit = True

    @contextlib.contextmanager
    def _running(self) -> Iterator[None]:
        self.engine.start()
        if self.physics is not None:
            self.physics.start()
        for sender in self._senders:
            sender.start()
        for source in self._sources:
            source.start(self.engine)
        keeper = threading.Thread(target=self._keep, name="keeper", daemon=True)
        keeper.start()
        try:
            yield
        finally:
            self._stopping.set()
            for source in self._sources:
                source.stop()
            self.engine.stop()
            if self.physics is not None:
                self.physics.stop()
            for sender in self._senders:
                sender.stop()
            keeper.join(timeout=30.0)
            if self._leases is not None:
                with contextlib.suppress(StoreDown):
                    self._leases.end()
            self._closing.close()

    def _leads(self) -> bool:
        """Whether this process does what one does for all that share a store."""
        return self._leases is None or self._leases.leads

    def _keep(self) -> None:
        """Move turns to files and forget old ones; end the server where the engine has failed."""
        passed = _KEEPING_S
        while not self._stopping.wait(1.0):
            if self.engine.failure is not None:
                self.stop()
                return
            passed += 1.0
            if passed < _KEEPING_S or not self._leads():
                continue
            passed, settings = 0.0, self._settings
            try:
                keep(self._store, settings.raw_days, settings.turn_days)
            except StoreDown:
                continue
            except Exception:
                _log.exception("turns could not be moved to files or forgotten; trying again")

    # ------------------------------------------------------------------------------------------------ parts

    def _with_demo(self, settings: Settings) -> Settings:
        model = settings.out / DEMO_MODEL
        if not (model / "model.yaml").is_file():
            said = f"{_DEMO_RECORDS} simulated turns, one network (once, some 40 s) …"
            self._say(f"making the demonstration's model: {said}")
            demo.make_model(model, _DEMO_RECORDS)
        return replace(settings, models=(model,), plan=replace(settings.plan, sensor_radius=_DEMO_RADIUS_M))

    def _built_in_broker(self, opened: contextlib.ExitStack) -> BuiltInBroker | None:
        if self._settings.source not in ("demo", "broker"):
            return None
        broker = BuiltInBroker(self._settings.broker_port)
        broker.start()
        opened.callback(broker.stop)
        return broker

    def _fed(self, built_in: BuiltInBroker) -> list[Source]:
        """The demonstration, where nothing is stored yet; else it is said where the broker listens."""
        if self._settings.source == "demo":
            if not self._store.machines():
                start = time.time_ns() - round(_DEMO_DAYS * DAY_NS)
                return [demo.DemoSource(Broker(HOST, built_in.port, version=3), start)]
            self._say(
                f"the demonstration is over: what came of it is shown; remove {self._settings.out} to see it again"
            )
        self._say(f"the built-in broker listens at {HOST}:{built_in.port}, topic {BUILT_IN_TOPIC}")
        return []

    def _make_sources(self, diagnoser: Diagnoser) -> list[Source]:
        settings, source = self._settings, self._settings.source
        if self.broker is not None:
            return [MqttSource(Broker(HOST, self.broker.port, version=3), BUILT_IN_TOPIC, settings.client_id)]
        if source.startswith("folder:"):
            folder = Path(source.removeprefix("folder:"))
            turn = min(mode.duration for mode in diagnoser.modes)
            told = settings.reading, settings.pulse_column, settings.settle, settings.plan.jitter
            return [FolderSource(folder, *told, turn)]
        if source.startswith("replay:"):
            return [ReplaySource(Path(source.removeprefix("replay:")), settings.speed)]
        if source.startswith(SCHEME):
            return [OpcUaSource(source, settings.opcua)]
        broker, topic = self._broker_of_url()
        return [MqttSource(broker, topic, settings.client_id)]

    def _broker_of_url(self) -> tuple[Broker, str]:
        return read_url(self._settings.source, self._settings.tls, self._settings.mqtt_version)

    def _make_senders(self, opened: contextlib.ExitStack) -> None:
        settings = self._settings
        if settings.webhook.url is not None and settings.webhook.secret is not None:
            delivery = WebhookDelivery(settings.webhook.url, settings.webhook.secret)
            self._senders.append(Sender(self._store, WEB_CHANNEL, delivery, self._leads))
        if settings.publish is not None:
            broker = self._broker_of_url()[0] if self.broker is None else Broker(HOST, self.broker.port, version=3)
            publishing = MqttDelivery(broker, settings.publish, settings.client_id)
            opened.callback(publishing.close)
            self._senders.append(Sender(self._store, MQTT_CHANNEL, publishing, self._leads))
