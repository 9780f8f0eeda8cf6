"""Nodes of an OPC UA server, each of which holds the newest block of samples of one machine as an array.

The monitor subscribes to their values. The source timestamp of a value is the time of its last sample, as a server
stamps an array when it is complete, or of its first. OPC UA keeps no samples for a client that is away: what came
meanwhile is a gap, beyond what the server's queue of the subscription holds.
"""

from __future__ import annotations

import asyncio
import contextlib
import logging
from collections.abc import Mapping
from dataclasses import dataclass, field
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from indexer_env.checks import check_choice, check_number
from indexer_env.errors import SignalError, refuse
from monitor.engine import Arrival, Engine
from monitor.intake.blocks import NANO, Block
from monitor.sources.base import Source

SCHEME = "opc.tcp://"

_PUBLISH_MS = 100.0
"""Period at which the server sends what is new: below what anybody notices."""

_WAITING = 2000
"""Values that wait for the monitor, also over a break of the connection."""

_QUEUE = 600
"""Values of a node that the server keeps between two of these, and over a short break: ten minutes of 1 s blocks."""

_RETRY_S = 2.0
_WATCH_S = 1.0


@dataclass(frozen=True)
class Nodes:
    """What the nodes of a server hold.

    Attributes
    ----------
    nodes : mapping of str to str or None
        Node of each machine, as ns=2;s=Press1.Acceleration.
    rate : float or None
        Of the samples [Hz], > 0.
    unit : str or None
        Of the samples, as a block has it.
    stamp : str
        last or first: whose time the source timestamp is.
    certificate, key, server : str or None
        PEM files of one's own certificate and key, and of the server's certificate. With them messages are signed and
        encrypted (Basic256Sha256), and no other server is talked to.
    user, password : str or None

    Raises
    ------
    ParameterError
        A value breaks its rule.
    """

    nodes: Mapping[str, str] | None
    rate: float | None = None
    unit: str | None = None
    stamp: str = "last"
    certificate: str | None = None
    key: str | None = None
    server: str | None = None
    user: str | None = None
    password: str | None = field(default=None, repr=False)

    def __post_init__(self) -> None:
        if self.nodes is None:
            object.__setattr__(self, "nodes", {})
        elif not isinstance(self.nodes, Mapping) or not all(isinstance(node, str) for node in self.nodes.values()):
            raise refuse("opcua", "nodes", "a node for each machine, {press-1: 'ns=2;s=Press1'}", self.nodes)
        check_choice("opcua", "stamp", self.stamp, ("last", "first"))
        if self.rate is not None:
            check_number("opcua", "rate", self.rate, low=0.0, low_open=True, unit="Hz")
        files = (self.certificate, self.key, self.server)
        if any(files) and not all(files):
            raise refuse("opcua", "certificate", "given together with key and server, or none of the three", files)
        for name, file in zip(("certificate", "key", "server"), files, strict=True):
            if file is not None and not Path(file).is_file():
                raise refuse("opcua", name, "a PEM file that is there", file)

    def check(self) -> None:
        """That the nodes can be subscribed to: raises ParameterError where none is named, or what they hold is not."""
        from asyncua import ua

        if not self.nodes:
            raise refuse("opcua", "nodes", "a node for each machine, {press-1: 'ns=2;s=Press1'}", {})
        for name, value in (("rate", self.rate), ("unit", self.unit)):
            if value is None:
                raise refuse("opcua", name, "given, as nodes hold the samples alone", None)
        machines: dict[ua.NodeId, str] = {}
        for machine, node in self.nodes.items():
            try:
                other = machines.setdefault(ua.NodeId.from_string(node), machine)
            except Exception:
                raise refuse("opcua", "nodes", "nodes such as ns=2;s=Press1.Acceleration", node) from None
            if other != machine:
                raise refuse("opcua", "nodes", "another node for each machine", f"{node} for {other} and {machine}")


class OpcUaSource(Source):
    """Subscribes to nodes of a server, again and again where the connection breaks.

    Parameters
    ----------
    url : str
        opc.tcp://HOST:PORT/PATH.
    nodes : Nodes
    """

    def __init__(self, url: str, nodes: Nodes) -> None:
        super().__init__()
        nodes.check()
        self.name = url.rpartition("@")[2]
        self._url, self._nodes = url, nodes
        self.subscribed = False

    def run(self, engine: Engine) -> None:
        """As `Source.run`."""
        # Its own words for a server that is away are pages of tracebacks.
        logging.getLogger("asyncua").setLevel(logging.CRITICAL)
        asyncio.run(self._run(engine))

    async def _run(self, engine: Engine) -> None:
        came: asyncio.Queue[Block] = asyncio.Queue(_WAITING)
        handing = asyncio.create_task(self._hand_over(engine, came))
        try:
            await self._insist(engine, came)
        finally:
            handing.cancel()

    async def _insist(self, engine: Engine, came: asyncio.Queue[Block]) -> None:
        while not self.stopping.is_set():
            try:
                await self._listen(engine, came)
            except Exception as reason:
                # Whatever a server answers: it is tried again, and told.
                self.tell(f"the OPC UA server {self.name} cannot be used ({_said(reason)}); trying again")
            self.subscribed = False
            await self._wait(_RETRY_S)

    async def _listen(self, engine: Engine, came: asyncio.Queue[Block]) -> None:
        client = await self._client()
        async with client:
            subscription = await client.create_subscription(_PUBLISH_MS, _Handler(self, engine, came))
            by_machine = {client.get_node(node): machine for machine, node in (self._nodes.nodes or {}).items()}
            self._machines = {node.nodeid: machine for node, machine in by_machine.items()}
            # A sampling interval of 0 asks for every value that is written.
            results = await subscription.subscribe_data_change(list(by_machine), queuesize=_QUEUE, sampling_interval=0)
            handles = results if isinstance(results, list) else [results]
            for machine, handle in zip(by_machine.values(), handles, strict=True):
                if not isinstance(handle, int):
                    raise ConnectionError(f"it has no such node for {machine}: {handle.name}")
            self.subscribed = True
            self.tell(None)
            while not self.stopping.is_set():
                await self._wait(_WATCH_S)
                await client.check_connection()

    async def _client(self) -> Any:
        from asyncua.client.client import Client
        from asyncua.crypto.security_policies import SecurityPolicyBasic256Sha256
        from asyncua.crypto.uacrypto import CertProperties

        told, client = self._nodes, Client(self._url)
        if told.user is not None:
            client.set_user(told.user)
            client.set_password(told.password or "")
        if told.certificate is not None and told.key is not None and told.server is not None:
            client.application_uri = _application_uri(Path(told.certificate))
            certificate, key, server = (
                CertProperties(Path(f), "PEM") for f in (told.certificate, told.key, told.server)
            )
            await client.set_security(SecurityPolicyBasic256Sha256, certificate, key, server_certificate=server)
        return client

    def taken(self, engine: Engine, node: Any, value: Any, data: Any) -> Block | None:
        """The block that a value is; None, and told, where it is none."""
        machine = self._machines[node.nodeid]
        try:
            return block_of(machine, value, data.monitored_item.Value, self._nodes)
        except SignalError as error:
            engine.broken(machine, str(error))
            return None

    async def _hand_over(self, engine: Engine, came: asyncio.Queue[Block]) -> None:
        """Hand over what comes in its order, waiting where the monitor is behind."""
        while not self.stopping.is_set():
            arrival = Arrival(await came.get())
            while not self.stopping.is_set():
                if await asyncio.to_thread(engine.offer, arrival, 0.5):
                    break

    async def _wait(self, seconds: float) -> None:
        await asyncio.to_thread(self.stopping.wait, seconds)


class _Handler:
    """What asyncua calls for each value, in tasks of their own: only what does not wait stays in its order."""

    def __init__(self, source: OpcUaSource, engine: Engine, came: asyncio.Queue[Block]) -> None:
        self._source, self._engine, self._came = source, engine, came

    def datachange_notification(self, node: Any, val: Any, data: Any) -> None:
        """As asyncua has it. What a full queue cannot take is lost, and will be told as a gap."""
        block = self._source.taken(self._engine, node, val, data)
        if block is not None:
            with contextlib.suppress(asyncio.QueueFull):
                self._came.put_nowait(block)


def block_of(machine: str, value: Any, data: Any, told: Nodes) -> Block:
    """The block that a value of a node is.

    Parameters
    ----------
    machine : str
    value : list of float
    data : asyncua.ua.DataValue
    told : Nodes

    Raises
    ------
    SignalError
        One sentence: what is wrong with it.
    """
    if not data.StatusCode.is_good():
        raise SignalError(f"the node of {machine} must have a good value, got {data.StatusCode.name}.")
    if not isinstance(value, list) or not value:
        raise SignalError(f"the node of {machine} must hold an array of samples, got {type(value).__name__}.")
    if not isinstance(data.SourceTimestamp, datetime):
        raise SignalError(f"the node of {machine} must have a source timestamp, which is the time of its samples.")
    assert told.rate is not None and told.unit is not None
    stamp = data.SourceTimestamp.replace(tzinfo=UTC)
    time_ns = int(stamp.replace(microsecond=0).timestamp()) * NANO + stamp.microsecond * 1000
    back = 0 if told.stamp == "first" else round((len(value) - 1) / told.rate * NANO)
    return Block(machine, time_ns - back, told.rate, told.unit, value)  # type: ignore[arg-type]


def _application_uri(certificate: Path) -> str:
    """The name of the application in its certificate, which the server compares with what the client says."""
    from cryptography import x509

    try:
        found = x509.load_pem_x509_certificate(certificate.read_bytes())
        names = found.extensions.get_extension_for_class(x509.SubjectAlternativeName).value
        return names.get_values_for_type(x509.UniformResourceIdentifier)[0]
    except (ValueError, IndexError, x509.ExtensionNotFound):
        rule = "a PEM certificate with the application's URI as alternative name"
        raise refuse("opcua", "certificate", rule, str(certificate)) from None


def _said(reason: Exception) -> str:
    return " ".join(str(reason).split()) or type(reason).__name__
