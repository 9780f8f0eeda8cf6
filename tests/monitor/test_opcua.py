"""Nodes of an OPC UA server: an asyncua server, plain and with certificates of one's own."""

import asyncio
import datetime
import gc
import socket
import threading
import time
from types import SimpleNamespace

import numpy as np
import pytest
from asyncua import Server, ua
from asyncua.crypto.cert_gen import (
    dump_private_key_as_pem,
    generate_private_key,
    generate_self_signed_app_certificate,
)
from cryptography import x509
from cryptography.hazmat.primitives.serialization import Encoding
from cryptography.x509.oid import ExtendedKeyUsageOID

from indexer_env.errors import ParameterError, SignalError
from monitor.intake.blocks import NANO
from monitor.sources.opcua import Nodes, OpcUaSource, _Handler, block_of
from tests.monitor.conftest import WAIT_S
from tests.monitor.fakes import RATE, START_NS, samples

# asyncua leaves sockets to the garbage collector where a server ends under its client.
pytestmark = [
    pytest.mark.filterwarnings("ignore::ResourceWarning"),
    pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning"),
    pytest.mark.filterwarnings("ignore::DeprecationWarning"),
]
START = datetime.datetime.fromtimestamp(START_NS / NANO, datetime.UTC)


@pytest.fixture(autouse=True)
def impatient(monkeypatch):
    """A server that is away is soon asked again."""
    monkeypatch.setattr("monitor.sources.opcua._RETRY_S", 0.2)
    monkeypatch.setattr("monitor.sources.opcua._WATCH_S", 0.2)


@pytest.fixture(scope="module", autouse=True)
def sockets_are_collected():
    """Here, where the warning is ignored, and not in a later test."""
    yield
    gc.collect()


def wait_for(condition):
    until = time.monotonic() + WAIT_S
    while not condition():
        assert time.monotonic() < until
        time.sleep(0.02)


def free_port():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return probe.getsockname()[1]


class Machine:
    """A server with one node, in a thread of its own."""

    def __init__(self, port, certificate=None, key=None):
        self.url = f"opc.tcp://127.0.0.1:{port}/plant"
        self._certificate, self._key = certificate, key
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self._loop.run_forever, daemon=True)
        self._thread.start()
        self.do(self._start())

    def do(self, work):
        return asyncio.run_coroutine_threadsafe(work, self._loop).result(WAIT_S)

    async def _start(self):
        self.server = Server()
        await self.server.init()
        self.server.set_endpoint(self.url)
        if self._certificate is not None:
            self.server.set_security_policy([ua.SecurityPolicyType.Basic256Sha256_SignAndEncrypt])
            await self.server.load_certificate(self._certificate, "PEM")
            await self.server.load_private_key(self._key, format="PEM")
        space = await self.server.register_namespace("plant")
        node = ua.NodeId("Press1.Acceleration", space)
        self.node = await self.server.nodes.objects.add_variable(
            node, "Acceleration", ua.Variant([], ua.VariantType.Double)
        )
        await self.server.start()

    def write(self, place, status=0):
        """Block number `place` of half a second, stamped with the time of its last sample."""

        async def one():
            stamp = START + datetime.timedelta(seconds=(50 * place + 49) / RATE)
            value = ua.Variant(samples(1.0, 50 * place, 50).tolist(), ua.VariantType.Double)
            told = ua.DataValue(value, SourceTimestamp=stamp.replace(tzinfo=None), StatusCode=ua.StatusCode(status))
            await self.node.write_value(told)

        self.do(one())

    def stop(self):
        async def end():
            await self.server.stop()
            rest = asyncio.all_tasks() - {asyncio.current_task()}
            for task in rest:
                task.cancel()
            await asyncio.gather(*rest, return_exceptions=True)

        self.do(end())
        self._loop.call_soon_threadsafe(self._loop.stop)
        self._thread.join(WAIT_S)
        self._loop.close()


def nodes(**more):
    return Nodes({"press 1": "ns=2;s=Press1.Acceleration"}, RATE, "m/s^2", **more)


def turns(monitor):
    return (monitor.store.summary("press 1") or {}).get("turns", 0)


def passes(monitor, machine, told):
    source = OpcUaSource(machine.url, told)
    source.start(monitor.engine)
    wait_for(lambda: source.subscribed)
    for place in range(10):
        machine.write(place)
    wait_for(lambda: turns(monitor) == 5)
    summary = monitor.store.summary("press 1")
    assert summary["last"]["time_ns"] == START_NS + 5 * NANO and "gap" not in summary["active_states"]
    return source


def test_every_block_that_a_server_writes_becomes_part_of_a_turn_also_after_it_was_away(monitor):
    port = free_port()
    machine = Machine(port)
    source = passes(monitor, machine, nodes())
    machine.write(10, status=ua.StatusCodes.BadSensorFailure)
    wait_for(lambda: monitor.engine.refused >= 2)  # and the empty array of the beginning
    machine.stop()
    wait_for(lambda: not source.subscribed)
    machine = Machine(port)
    wait_for(lambda: source.subscribed)
    for place in range(10, 16):
        machine.write(place)
    wait_for(lambda: turns(monitor) >= 7)
    source.stop()
    machine.stop()
    assert source.failure is None


@pytest.fixture
def certificates(tmp_path):
    """Files of certificates and keys, by name."""

    def make(name):
        key = generate_private_key()
        uri = f"urn:test:{name}"
        made = generate_self_signed_app_certificate(
            key, name, {"organizationName": "test"},
            [x509.UniformResourceIdentifier(uri), x509.DNSName("localhost")],
            [ExtendedKeyUsageOID.CLIENT_AUTH, ExtendedKeyUsageOID.SERVER_AUTH], days=2,
        )  # fmt: skip
        (tmp_path / f"{name}.key").write_bytes(dump_private_key_as_pem(key))
        (tmp_path / f"{name}.pem").write_bytes(made.public_bytes(Encoding.PEM))
        return str(tmp_path / f"{name}.pem"), str(tmp_path / f"{name}.key")

    return {name: make(name) for name in ("server", "monitor", "other")}


def test_with_certificates_messages_are_encrypted_and_no_other_server_is_talked_to(monitor, certificates, monkeypatch):
    machine = Machine(free_port(), *certificates["server"])
    own = dict(zip(("certificate", "key"), certificates["monitor"], strict=True))
    for wrong in (nodes(), nodes(**own, server=certificates["other"][0])):
        source, said = OpcUaSource(machine.url, wrong), []
        monkeypatch.setattr(source, "tell", said.append)
        source.start(monitor.engine)
        wait_for(lambda said=said: said)
        assert not source.subscribed and all("cannot be used" in sentence for sentence in said)
        source.stop()
    passes(monitor, machine, nodes(**own, server=certificates["server"][0])).stop()
    machine.stop()


def test_a_value_that_is_no_block_gets_a_sentence():
    def value(**more):
        return ua.DataValue(ua.Variant([1.0, 2.0]), **{"SourceTimestamp": START.replace(tzinfo=None), **more})

    block = block_of("m", [1.0, 2.0], value(), nodes(stamp="first"))
    assert block.start_ns == START_NS and block.values.tolist() == [1.0, 2.0] and block.rate == RATE
    assert block_of("m", [1.0, 2.0], value(), nodes()).start_ns == START_NS - round(NANO / RATE)
    for given, data, said in (
        (7.0, value(), "array of samples"),
        ([1.0], value(SourceTimestamp=None), "source timestamp"),
        ([1.0], value(StatusCode=ua.StatusCode(ua.StatusCodes.BadSensorFailure)), "BadSensorFailure"),
        (["x"], value(), "list of"),
        ([np.nan], value(SourceTimestamp=datetime.datetime(1601, 1, 1)), "1970"),
    ):
        with pytest.raises(SignalError, match=said):
            block_of("m", given, data, nodes())


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"nodes": {}}, "a node for each machine"),
        ({"nodes": {"m": "press"}}, "ns=2"),
        ({"nodes": {"m": "ns=2;s=x", "n": "ns=2;s=x"}}, "another node for each machine, got 'ns=2;s=x for m and n'"),
        ({"rate": None}, "opcua.rate"),
        ({"unit": None}, "opcua.unit"),
        ({"rate": -1.0}, "opcua.rate"),
        ({"stamp": "middle"}, "opcua.stamp"),
        ({"key": "x.pem"}, "opcua.certificate"),
        ({"certificate": "x", "key": "y", "server": "z"}, "PEM file that is there"),
    ],
)
def test_a_wrong_setting_gets_one_sentence(given, said):
    with pytest.raises(ParameterError, match=said) as error:
        OpcUaSource("opc.tcp://h:1", Nodes(**{"nodes": {"m": "ns=2;s=x"}, "rate": 1000.0, "unit": "m/s^2", **given}))
    assert "\n" not in str(error.value)


def test_values_keep_their_order_where_the_monitor_is_behind():
    """asyncua gives each one a task of its own; what a full queue cannot take is left out and no other."""
    offered, refusals = [], iter([True, True, False] * 40)

    def offer(arrival, timeout):
        taken = next(refusals)
        if taken:
            offered.append(arrival.block.values[0])
            source.stopping.set() if len(offered) == 30 else None
        return taken

    source = OpcUaSource("opc.tcp://host:4840", nodes())
    node = SimpleNamespace(nodeid="a")
    source._machines = {"a": "press-1"}

    def value(number):
        stamp = START + datetime.timedelta(seconds=number)
        data = ua.DataValue(ua.Variant([float(number)] * 3), SourceTimestamp=stamp, ServerTimestamp=stamp)
        return SimpleNamespace(monitored_item=SimpleNamespace(Value=data))

    async def run():
        came = asyncio.Queue(30)
        engine = SimpleNamespace(offer=offer, broken=lambda *said: pytest.fail(str(said)))
        handler = _Handler(source, engine, came)
        for number in range(35):
            handler.datachange_notification(node, [float(number)] * 3, value(number))
        await source._hand_over(engine, came)

    asyncio.run(run())
    assert offered == list(range(30))
