"""Messages go from a broker to the store: the built-in one, and Mosquitto, with certificates as well."""

import gc
import json
import shutil
import socket
import struct
import subprocess
import time
import warnings
from types import SimpleNamespace

import pytest

from benchmarks.monitor.programs import MOSQUITTO, free_port
from indexer_env.errors import ParameterError
from monitor.outputs.publish import MqttDelivery
from monitor.settings import settings_of
from monitor.sources.broker import BuiltInBroker
from monitor.sources.mqtt import Broker, MqttSource, Tls
from tests.monitor.conftest import WAIT_S
from tests.monitor.fakes import RATE, START_NS, samples
from tests.monitor.test_service import config

needs_mosquitto = pytest.mark.skipif(MOSQUITTO is None, reason="needs Mosquitto: apt-get install mosquitto")
needs_openssl = pytest.mark.skipif(shutil.which("openssl") is None, reason="needs OpenSSL: apt-get install openssl")


def message(place: int) -> str:
    values = samples(1.0, 50 * place, 50).round(5).tolist()
    return json.dumps(
        {"time": START_NS / 1e9 + place / 2, "rate": RATE, "unit": "m/s^2", "values": values, "sequence": place}
    )


def publish(broker: Broker, payloads) -> None:
    client = broker.client("logger", keep_session=False)
    broker.connect(client, keep_session=False)
    wait_for(client.is_connected)
    for payload in payloads:
        client.publish("plant/press 1/acceleration", payload, 1).wait_for_publish(WAIT_S)
    client.disconnect()
    client.loop_stop()


def wait_for(condition):
    until = time.monotonic() + WAIT_S
    while not condition():
        assert time.monotonic() < until
        time.sleep(0.02)


def turns(monitor):
    return (monitor.store.summary("press 1") or {}).get("turns", 0)


def passes(monitor, broker):
    """Ten blocks, an unreadable one among them, become five turns, once."""
    source = MqttSource(broker, "plant/+/acceleration", "monitor-test")
    source.start(monitor.engine)
    assert source.subscribed.wait(WAIT_S)
    blocks = [message(place) for place in range(10)]
    publish(broker, [*blocks[:4], "{broken", *blocks[4:], blocks[9]])
    wait_for(lambda: turns(monitor) == 5 and "double" in monitor.store.summary("press 1")["active_states"])
    source.stop()
    assert monitor.engine.refused == 1 and source.failure is None


def test_the_built_in_broker_brings_what_is_sent(monitor):
    broker = BuiltInBroker(free_port())
    broker.start()
    passes(monitor, Broker("127.0.0.1", broker.port, version=3))
    broker.stop()


@pytest.mark.parametrize("manner", ["silent", "subscribed", "reset"])
def test_the_built_in_broker_leaves_no_connection_open(manner):
    broker = BuiltInBroker(free_port())
    broker.start()
    one = socket.create_connection(("127.0.0.1", broker.port), WAIT_S)
    if manner != "silent":
        one.sendall(b"\x10\x0d\x00\x04MQTT\x04\x02\x00\x3c\x00\x01x")  # CONNECT, as client x
        assert one.recv(4) == b"\x20\x02\x00\x00"  # CONNACK
    if manner == "subscribed":
        one.sendall(b"\x82\x06\x00\x01\x00\x01#\x01")  # SUBSCRIBE to all
        assert one.recv(5)[0] == 0x90  # SUBACK
    if manner == "reset":
        one.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
        one.close()
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        broker.stop()
        gc.collect()
    one.close()
    assert not [str(warning.message) for warning in caught]


def test_alarms_go_out_by_the_broker_until_it_has_taken_them(monkeypatch):
    monkeypatch.setattr("monitor.outputs.publish._TIMEOUT_S", 5.0)
    port, got = free_port(), []
    delivery = MqttDelivery(Broker("127.0.0.1", port, version=3), "plant/alarms/", "monitor")
    message = {"machine": "press+1", "quantity": "crack", "level": "alarm", "value": float("nan")}
    for _ in range(3):
        with pytest.raises(OSError, match="not connected"):
            delivery({"delivery": 1, **message})
    broker = BuiltInBroker(port)
    broker.start()
    client = Broker("127.0.0.1", port, version=3).client("listener", keep_session=False)
    client.on_message = lambda client, _, told: (
        got.append((told.topic, json.loads(told.payload))),
        client.ack(told.mid, told.qos),
    )
    client.on_connect = lambda client, *_: client.subscribe("plant/alarms/#", 1)
    subscribed = []
    client.on_subscribe = lambda *_: subscribed.append(True)
    Broker("127.0.0.1", port, version=3).connect(client, keep_session=False)
    wait_for(lambda: subscribed)

    def taken() -> bool:
        try:
            delivery({"delivery": 2, **message})
        except OSError:
            return False
        return True

    wait_for(taken)
    wait_for(lambda: 2 in {told["delivery"] for _, told in got})
    topic, told = next(one for one in got if one[1]["delivery"] == 2)
    assert topic == "plant/alarms/press_1/crack" and told["level"] == "alarm" and told["value"] is None
    assert 1 not in {told["delivery"] for _, told in got}, "what was refused is not sent as well"
    delivery.close()
    client.disconnect()
    client.loop_stop()
    broker.stop()


@pytest.fixture
def mosquitto(tmp_path):
    """A function that starts Mosquitto with these lines of configuration."""
    started = []

    def start(*lines: str) -> None:
        config = tmp_path / "mosquitto.conf"
        config.write_text("\n".join(["user root", *lines]))
        started.append(
            subprocess.Popen([MOSQUITTO, "-c", str(config)], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
        )

    yield start
    for process in started:
        process.terminate()
        process.wait(WAIT_S)


def listens(port):
    try:
        socket.create_connection(("127.0.0.1", port), 1).close()
    except OSError:
        return False
    return True


@needs_mosquitto
@pytest.mark.parametrize("version", [5, 3])
def test_mosquitto_brings_what_is_sent(monitor, mosquitto, version):
    port = free_port()
    mosquitto(f"listener {port} 127.0.0.1", "allow_anonymous true")
    wait_for(lambda: listens(port))
    passes(monitor, Broker("127.0.0.1", port, version=version))


@needs_mosquitto
def test_what_was_sent_while_the_monitor_was_away_is_fetched(monitor, mosquitto):
    port = free_port()
    mosquitto(f"listener {port} 127.0.0.1", "allow_anonymous true")
    wait_for(lambda: listens(port))
    broker = Broker("127.0.0.1", port)
    first = MqttSource(broker, "plant/+/acceleration", "monitor-test")
    first.start(monitor.engine)
    assert first.subscribed.wait(WAIT_S)
    first.stop()
    publish(broker, [message(place) for place in range(10)])
    again = MqttSource(broker, "plant/+/acceleration", "monitor-test")
    again.start(monitor.engine)
    wait_for(lambda: turns(monitor) == 5)
    again.stop()


# paho leaves the socket of a handshake that was refused to the garbage collector, which must find it here.
@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")
@needs_mosquitto
@needs_openssl
def test_tls_checks_the_broker_and_shows_one_s_own_certificate(monitor, mosquitto, tmp_path):
    def run(*command: str) -> None:
        subprocess.run(command, check=True, cwd=tmp_path, capture_output=True)

    for name in ("ca", "other"):
        run("openssl", "req", "-x509", "-newkey", "rsa:2048", "-nodes", "-keyout", f"{name}.key", "-out", f"{name}.pem",
            "-days", "2", "-subj", f"/CN={name}", "-addext", "basicConstraints=critical,CA:TRUE",
            "-addext", "keyUsage=critical,keyCertSign")  # fmt: skip
    for name in ("server", "client"):
        run(
            "openssl",
            "req",
            "-newkey",
            "rsa:2048",
            "-nodes",
            "-keyout",
            f"{name}.key",
            "-out",
            f"{name}.csr",
            "-subj",
            f"/CN={name}",
        )
        (tmp_path / "ext").write_text("subjectAltName=IP:127.0.0.1\nauthorityKeyIdentifier=keyid\n")
        run("openssl", "x509", "-req", "-in", f"{name}.csr", "-CA", "ca.pem", "-CAkey", "ca.key", "-CAcreateserial",
            "-out", f"{name}.pem", "-days", "2", "-extfile", "ext")  # fmt: skip
    port = free_port()
    mosquitto(
        f"listener {port} 127.0.0.1", f"cafile {tmp_path}/ca.pem", f"certfile {tmp_path}/server.pem",
        f"keyfile {tmp_path}/server.key", "require_certificate true", "use_identity_as_username true",
    )  # fmt: skip
    wait_for(lambda: listens(port))
    own = (str(tmp_path / "client.pem"), str(tmp_path / "client.key"))
    wrong = MqttSource(
        Broker("127.0.0.1", port, True, tls=Tls(str(tmp_path / "other.pem"), *own)), "plant/+/acceleration", "w"
    )
    wrong.start(monitor.engine)
    wait_for(lambda: wrong.trouble is not None)
    assert not wrong.connected.is_set()
    wrong.stop()
    passes(monitor, Broker("127.0.0.1", port, True, tls=Tls(str(tmp_path / "ca.pem"), *own)))
    gc.collect()


def test_a_subscription_that_is_refused_is_told():
    source = MqttSource(Broker("plant", 1883), "plant/+/acceleration", "one")
    told = []
    source.told = lambda: told.append(source.trouble)
    source._on_subscribe(None, None, 1, [SimpleNamespace(is_failure=True)])
    assert "refuses to send plant/+/acceleration" in told[-1] and not source.subscribed.is_set()
    source._on_subscribe(None, None, 1, [SimpleNamespace(is_failure=False)])
    assert source.subscribed.is_set()


@pytest.mark.parametrize("source", ["MQTTS://ulf:geh@eim@broker/plant/+/a", "mqtt:ulf:geheim@broker/plant/+/a"])
@pytest.mark.parametrize("more", [[], ["lease.owner=north"]])
def test_a_source_of_a_wrong_kind_is_told_without_its_password(source, more):
    with pytest.raises(ParameterError, match="…@broker/plant") as caught:
        settings_of(config(f"source='{source}'", *more))
    assert "eim" not in str(caught.value) and "ulf" not in str(caught.value)
