"""Messages of an MQTT broker, of version 5 or 3.1.1.

The topic is a pattern such as plant/+/acceleration: what stands in the place of its wildcards is the machine's name.
Quality of service 1 with a session that outlives a restart, and a message is acknowledged once its samples are in the
store: what the monitor had not stored when it was killed is sent again.
"""

from __future__ import annotations

import re
import ssl
import sys
import threading
from collections.abc import Iterable
from dataclasses import dataclass, field
from urllib.parse import unquote

import paho.mqtt.client as paho
from paho.mqtt.enums import CallbackAPIVersion
from paho.mqtt.packettypes import PacketTypes
from paho.mqtt.properties import Properties

from indexer_env.errors import SignalError, refuse
from monitor.engine import Arrival, Engine
from monitor.intake.payload import block_of
from monitor.sources.base import Source

SESSION_S = 7 * 24 * 3600
"""How long the broker keeps messages for a monitor that is away."""

_IN_FLIGHT = 1000
_RECONNECT_S = 5

_URL = re.compile(
    r"(?P<scheme>mqtts?)://(?:(?P<user>[^:@/]*)(?::(?P<password>[^@/]*))?@)?"
    r"(?P<host>\[[^\]]+\]|[^:/]+)(?::(?P<port>\d+))?/(?P<topic>.+)"
)


@dataclass(frozen=True)
class Tls:
    """PEM files: of the authority that signed the broker's certificate (None: the system's), and of one's own
    certificate and key where the broker asks for them."""

    authority: str | None = None
    certificate: str | None = None
    key: str | None = None

    def context(self) -> ssl.SSLContext:
        """Checks the broker's certificate and name; raises ParameterError for files that cannot be used."""
        key, rule = "authority", "a PEM file of authorities that can be read"
        try:
            context = ssl.create_default_context(cafile=self.authority)
            if self.certificate is not None:
                key, rule = "certificate", "a PEM file that can be read, with that of its key in mqtt.key"
                context.load_cert_chain(self.certificate, self.key)
        except (OSError, ssl.SSLError) as error:
            raise refuse("mqtt", key, f"{rule} ({error.strerror or error})", getattr(self, key)) from None
        return context


@dataclass(frozen=True)
class Broker:
    """Where a broker is and who asks."""

    host: str
    port: int
    secure: bool = False
    user: str | None = None
    password: str | None = field(default=None, repr=False)
    version: int = 5
    tls: Tls = Tls()

    def client(self, client_id: str, keep_session: bool) -> paho.Client:
        """A client that is not connected yet."""
        protocol = paho.MQTTv5 if self.version == 5 else paho.MQTTv311
        session = None if self.version == 5 else not keep_session
        client = paho.Client(
            CallbackAPIVersion.VERSION2, client_id, clean_session=session, protocol=protocol, manual_ack=True
        )
        client.reconnect_delay_set(1, _RECONNECT_S)
        client.max_inflight_messages_set(_IN_FLIGHT)
        if self.user is not None:
            client.username_pw_set(self.user, self.password)
        if self.secure:
            client.tls_set_context(self.tls.context())
        return client

    def connect(self, client: paho.Client, keep_session: bool) -> None:
        """Connect in the background, again and again."""
        if self.version == 5:
            properties = Properties(PacketTypes.CONNECT)
            properties.SessionExpiryInterval = SESSION_S if keep_session else 0
            properties.ReceiveMaximum = _IN_FLIGHT
            client.connect_async(
                self.host, self.port, keepalive=30, clean_start=not keep_session, properties=properties
            )
        else:
            client.connect_async(self.host, self.port, keepalive=30)
        client.loop_start()


def read_url(url: str, tls: Tls = Tls(), version: int = 5, password: str | None = None) -> tuple[Broker, str]:
    """Broker and topic of mqtt://USER:PASSWORD@HOST:PORT/TOPIC; raises ParameterError. The password is not repeated."""
    found = _URL.fullmatch(url)
    if found is None:
        rule = "demo, broker, mqtt[s]://HOST:PORT/TOPIC, opc.tcp://HOST:PORT, folder:PATH or replay:PATH"
        # What may hold a password is not repeated.
        raise refuse("monitor", "source", rule, "another" if "@" in url else url)
    secure = found["scheme"] == "mqtts"
    user = None if found["user"] is None else unquote(found["user"])
    given = password if found["password"] is None else unquote(found["password"])
    port = int(found["port"] or (8883 if secure else 1883))
    return Broker(found["host"].strip("[]"), port, secure, user, given, version, tls), found["topic"]


class MqttSource(Source):
    """Subscribes to a topic.

    Parameters
    ----------
    broker : Broker
    topic : str
        With at least one wildcard, + or #.
    client_id : str
        Under which the broker keeps the session; another one for each monitor.

    Raises
    ------
    ParameterError
        A topic without wildcard, or certificates that cannot be read.
    """

    def __init__(self, broker: Broker, topic: str, client_id: str) -> None:
        super().__init__()
        if "+" not in topic and "#" not in topic:
            raise refuse("monitor", "source", "a topic with + in the place of the machine's name", topic)
        self.name = f"mqtt://{broker.host}:{broker.port}/{topic}"
        if broker.secure:
            broker.tls.context()
        self._broker, self._topic, self._client_id = broker, topic, client_id
        self._pattern = re.compile(
            re.escape(topic).replace(r"\+", "([^/]+)").replace("/\\#", "/(.+)").replace("\\#", "(.+)")
        )
        self.connected = threading.Event()
        self.subscribed = threading.Event()

    def run(self, engine: Engine) -> None:
        """As `Source.run`."""
        client = self._broker.client(self._client_id, keep_session=True)
        client.on_connect = self._on_connect
        client.on_connect_fail = self._on_connect_fail
        client.on_disconnect = self._on_disconnect
        client.on_subscribe = self._on_subscribe
        client.on_message = lambda client, _, message: self._on_message(engine, client, message)
        self._broker.connect(client, keep_session=True)
        self.stopping.wait()
        client.disconnect()
        client.loop_stop()

    def machine_of(self, topic: str) -> str:
        """The name in the place of the wildcards, several joined by a dot."""
        found = self._pattern.fullmatch(topic)
        return "" if found is None else ".".join(found.groups()).replace("/", ".")

    def _on_connect(self, client: paho.Client, _user: object, _flags: object, reason: object, _more: object) -> None:
        if getattr(reason, "is_failure", False):
            self.tell(f"the broker {self._at} refuses the connection ({reason}); trying again")
            return
        self.connected.set()
        self.tell(None)
        client.subscribe(self._topic, qos=1)

    def _on_subscribe(
        self, _client: object, _user: object, _mid: object, reasons: Iterable[object], *_: object
    ) -> None:
        refused = [reason for reason in reasons if getattr(reason, "is_failure", False)]
        if refused:
            self.tell(
                f"the broker {self._at} refuses to send {self._topic} ({refused[0]}); let this user read it there"
            )
        else:
            self.subscribed.set()

    def _on_connect_fail(self, *_: object) -> None:
        # Paho calls this while it handles the exception, and hands over no reason.
        reason = sys.exc_info()[1]
        said = getattr(reason, "strerror", None) or str(reason)
        self.tell(f"the broker {self._at} cannot be reached ({said}); trying again")

    def _on_disconnect(self, *_: object) -> None:
        if self.connected.is_set():
            self.tell(f"the connection to the broker {self._at} has ended; trying again")
        self.connected.clear()

    @property
    def _at(self) -> str:
        return f"{self._broker.host}:{self._broker.port}"

    def _on_message(self, engine: Engine, client: paho.Client, message: paho.MQTTMessage) -> None:
        machine = self.machine_of(message.topic)
        given = getattr(message.properties, "UserProperty", None) if message.properties else None
        done = _acknowledging(client, message)
        try:
            block = block_of(machine, bytes(message.payload), dict(given) if given else None)
        except SignalError as error:
            engine.broken(machine, str(error))
            done()
            return
        # The broker stops at ReceiveMaximum, so waiting here bounds what is held on both sides.
        while not self.stopping.is_set() and not engine.offer(Arrival(block, kept=done), timeout=0.5):
            pass


def _acknowledging(client: paho.Client, message: paho.MQTTMessage):
    def done() -> None:
        client.ack(message.mid, message.qos)

    return done
