"""The command: what it refuses, its sources, and where alarms go."""

import hashlib
import hmac
import json
import socket
import threading
import time
from http.server import BaseHTTPRequestHandler, HTTPServer
from types import SimpleNamespace

import numpy as np
import pytest
from hydra import compose, initialize_config_dir
from omegaconf import OmegaConf

import monitor.__main__ as command
from benchmarks.monitor.programs import free_port
from indexer_env.errors import ParameterError
from indexer_env.presets import config_dir
from indexer_records.measured import Reading
from monitor.alarms import Limits
from monitor.diagnoser import diagnoser_of
from monitor.outputs.outbox import Sender
from monitor.outputs.webhook import WebhookDelivery
from monitor.service import Service
from monitor.settings import settings_of
from monitor.sources.folder import FolderSource, machine_of, time_of
from monitor.sources.mqtt import Broker, MqttSource, Tls, read_url
from monitor.sources.replay import blocks_of
from tests.monitor.conftest import WAIT_S


def config(*overrides):
    with initialize_config_dir(str(config_dir()), version_base="1.3"):
        composed = OmegaConf.to_container(compose("monitor", list(overrides)))
    assert isinstance(composed, dict)
    return composed


def wait_for(condition):
    until = time.monotonic() + WAIT_S
    while not condition():
        assert time.monotonic() < until
        time.sleep(0.02)


def test_the_configuration_as_it_stands_is_the_demonstration_on_this_host_alone():
    settings = settings_of(config())
    assert settings.source == "demo" and settings.local and settings.store.startswith("sqlite:///")
    assert settings.plan.limits["backlash_deg"].danger == 12.0


@pytest.mark.parametrize(
    "overrides",
    [
        ["source=mqtt://broker/plant/+/acceleration", "model=models/line1", "sensor_radius=0.4"],
        ["source=folder:/data/logger", "model=[a,b]", "read.unit=g", "limits.backlash_deg=[2,4,8]"],
        ["source=mqtt://broker/+", "twin=twin", "load_torque=2", "twin_limits={reducer_play: [2,4,8], friction: null}"],
        ["source=mqtt://broker/+", "twin=twin", "limits.change=[2,4,8]"],
        ["source=opc.tcp://h:4840", "model=m", "opcua.nodes={press-1: 'ns=2;s=Press1'}", "opcua.rate=1000"],
        ["source=mqtt://broker/+", "model=m", "lease.owner=north", "lease.seconds=5"],
        ["store=postgresql://me@host/monitor", "limits.crack=null", "keep.raw_days=7"],
    ],
)
def test_settings_come_from_the_command_line(overrides):
    settings_of(config(*overrides))


@pytest.mark.parametrize(
    ("overrides", "word"),
    [
        (["host=0.0.0.0"], "host"),
        (["host=0.0.0.0", "auth.viewer_token=short"], "viewer_token"),
        (["source=broker"], "model"),
        (["source=mqtt//broker"], "source must be demo, broker or"),
        (["port=99999"], "port"),
        (
            ["limits.crack=[0.3,0.2,0.1]"],
            r"^limits\.crack must be three numbers > 0 that rise.*got \[0\.3, 0\.2, 0\.1\]",
        ),
        (["limits.crack=[0,0.2,0.3]"], r"^limits\.crack"),
        (["limits.crack=[a,0.2,0.3]"], r"^limits\.crack"),
        (["limits.crack=5"], "limits.crack"),
        (["alarms.on_delay=0"], "on_delay"),
        (["alarms.deadband=2"], "deadband"),
        (["pulse.low=3"], "pulse.high"),
        (["clock.stale=0"], "stale"),
        (["speed=0"], "speed"),
        (["mqtt.version=4"], "version"),
        (["webhook.url=ftp://x"], "webhook.url"),
        (["webhook.url=http://x"], "webhook.secret"),
        (["sensor_radius=-1"], "sensor_radius"),
        (
            ["source=broker", "model=m", "pulse.angle_deg=20"],
            r"pulse\.angle_deg must be left out where no twin is given",
        ),
        (["source=broker", "twin=t", "pulse.angle_deg=a"], r"pulse\.angle_deg must be a finite number"),
        (["sensor_radius=400"], r"sensor_radius must be .*20 m, got 400"),
        (["twin=t", "model=m", "source=broker"], "monitor.twin"),
        (["twin=t"], "source"),
        (["twin=t", "source=broker", "limits.crack=[0.1,0.2,0.3]"], r"^limits\.crack must be left out.*twin_limits="),
        (["twin=t", "source=broker", "limits.crack=null"], r"^limits\.crack must be left out.*got None"),
        (["twin_limits=5"], "twin_limits"),
        (["twin=t", "source=broker", "load_torque=x"], "load_torque must be a finite number"),
        (["twin=t", "source=broker", "motor_speeds_rpm=1500"], "motor_speeds_rpm must be a list"),
        (["physics.every=0"], "physics.every"),
        (["opcua.stamp=middle"], "opcua.stamp"),
        (["lease.owner=north"], "lease.owner"),
        (["lease.owner='a b'"], "lease.owner"),
        (["lease.seconds=0"], "lease.seconds"),
        (["lease.seconds=1e10"], "lease.seconds"),
        (["keep.raw_days=1e6"], r"keep\.raw_days must be .*<= 36500 d, got .*; 36500 days are a hundred years"),
        (["keep.turn_days=1e6"], "keep.turn_days"),
        (["clock.jitter=1e300"], "clock.jitter"),
        (["physics.every=1e300"], "physics.every"),
        (["stations=100000"], "monitor.stations"),
        (["alarms.re_alarm=0"], r"alarms\.re_alarm must be"),
        (["alarms.deadband=2", "limits.crack=[0.1,0.2,0.3]"], r"alarms\.deadband must be"),
        (["limits=null"], "monitor.limits must be a mapping"),
        (["webhook=null"], "monitor.webhook must be a mapping"),
        (["auth.operators=null"], "auth.operators must be a list of names"),
        (["model=m"], "source must be that of your machine where a model"),
        (["source=broker", "model=m", "load_torque=2"], "load_torque must be left out"),
        (["source=broker", "model=m", "twin_limits={friction: null}"], "twin_limits must be left out"),
        (["source=broker", "model=m", "motor_speeds_rpm=[1500]"], "motor_speeds_rpm must be left out"),
        (["source=broker", "model=m", "physics.every=2"], "physics must be left out"),
        (["lease.owner=1"], "lease.owner must be a name"),
        (["mqtt.client_id=7"], "mqtt.client_id must be a text"),
        (["mqtt.version=3", "mqtt.client_id=''"], "mqtt.client_id must be a text"),
        (["store=5"], "store must be a text"),
        (["publish=true"], "publish must be a text"),
        (["publish=plant/+"], "publish must be a topic without"),
        (["mqtt.authority=5"], "mqtt.authority must be a text"),
    ],
)
def test_a_wrong_setting_gets_one_sentence(overrides, word):
    with pytest.raises(ParameterError, match=word) as caught:
        settings_of(config(*overrides))
    assert "\n" not in str(caught.value)


def test_a_model_of_a_known_radius_needs_that_of_the_sensor_and_a_folder_is_no_file(monkeypatch, tmp_path):
    models = SimpleNamespace(needs_radius=True, quantities=("crack",), stations=8)
    monkeypatch.setattr("monitor.diagnoser.ClassifierDiagnoser", lambda _: models)
    monkeypatch.setattr("monitor.diagnoser.load_model", lambda path: path)
    given = ["source=broker", "model=m", f"out={tmp_path}/kept"]
    with pytest.raises(ParameterError, match="sensor_radius=NUMBER"):
        Service(settings_of(config(*given)))
    assert not (tmp_path / "kept").exists()
    (tmp_path / "file").touch()
    with pytest.raises(ParameterError, match=r"monitor\.out must be a folder"):
        Service(settings_of(config(*given, "sensor_radius=0.3", f"out={tmp_path}/file")))


@pytest.mark.parametrize(
    ("source", "more", "word"),
    [
        ("folder:nowhere", [], r"monitor\.source must be a folder that is there"),
        ("replay:nowhere", ["publish=plant/alarms"], r"monitor\.publish must be null where the source is no broker"),
        ("mqtt://broker/plant/one", [], "machine"),
        ("broker", ["port={taken}"], r"monitor\.port must be one that is free"),
        (
            "broker",
            ["host=192.0.2.1", "auth.operator_token=0123456789abcdef"],
            r"monitor\.host must be an address of this host",
        ),
        ("broker", ["broker_port={taken}"], r"monitor\.broker_port must be a free port"),
    ],
)
def test_what_cannot_be_used_leaves_no_folder(source, more, word, monkeypatch, tmp_path):
    models = SimpleNamespace(
        needs_radius=False, stations=8, quantities=("crack",), modes=[SimpleNamespace(duration=1.0)]
    )
    monkeypatch.setattr("monitor.diagnoser.ClassifierDiagnoser", lambda _: models)
    monkeypatch.setattr("monitor.diagnoser.load_model", lambda path: path)
    with socket.create_server(("127.0.0.1", 0)) as taken:
        given = [one.format(taken=taken.getsockname()[1]) for one in ("port=0", *more)]
        with pytest.raises(ParameterError, match=word):
            Service(settings_of(config(f"source={source}", "model=m", f"out={tmp_path}/kept", *given)))
    assert not (tmp_path / "kept").exists()


@pytest.mark.parametrize(
    ("given", "local"),
    [([], True), (["auth.proxy_secret=0123456789abcdef"], False), (["auth.operator_token=0123456789abcdef"], False)],
)
def test_only_without_secrets_names_of_other_hosts_are_refused(given, local):
    """A proxy on this host that signs people in hands on the name by which they call it."""
    assert settings_of(config("source=broker", "model=m", "host=127.0.0.1", *given)).local == local


def test_a_folder_of_other_files_is_no_monitors_folder(tmp_path):
    for name in (".demo-model-begun", "lost+found"):
        (tmp_path / name).mkdir()
    given = ["source=broker", "model=m", f"out={tmp_path}"]
    assert settings_of(config(*given)).out == tmp_path
    (tmp_path / "letter.txt").touch()
    with pytest.raises(ParameterError, match=r"monitor\.out must be a new folder, an empty one .* \(letter\.txt\)"):
        settings_of(config(*given))
    (tmp_path / "monitor.sqlite").touch()
    assert settings_of(config(*given)).out == tmp_path


def test_the_demonstration_s_machines_stand_among_no_others(tmp_path):
    (tmp_path / "demo-model").mkdir()
    with pytest.raises(
        ParameterError, match=r"monitor\.out must be another folder than the demonstration's.*as out=line1"
    ):
        Service(settings_of(config("source=broker", "model=m", "port=0", f"out={tmp_path}")))


def test_monitors_that_share_a_store_ask_the_broker_under_names_of_their_own():
    settings = settings_of(config("source=mqtt://broker/+", "model=m", "lease.owner=north"))
    assert settings.owner == "north" and settings.client_id == "indexer-monitor-north"
    assert settings_of(config()).owner is None


def test_the_command_says_a_mistake_in_one_line(run_command, tmp_path):
    code, _, err = run_command(command, "source=mqtt://nowhere", "model=x", f"out={tmp_path}/m", "port=0")
    assert code == 2 and err.startswith("error: model must be a folder") and err.count("\n") == 1


def test_the_address_of_a_broker_is_read_and_its_password_not_repeated():
    broker, topic = read_url("mqtts://me:se%40cret@broker:1234/plant/+/acceleration", Tls())
    assert (broker.host, broker.port, broker.secure, broker.user, broker.password) == (
        "broker", 1234, True, "me", "se@cret",
    )  # fmt: skip
    assert "se@cret" not in repr(broker) and MqttSource(broker, topic, "x").name.count("secret") == 0
    for url in ("mqtt://", "mqtt://broker", "http://broker/+", "mqtt://me:geheim@broker"):
        with pytest.raises(ParameterError) as caught:
            read_url(url)
        assert "geheim" not in str(caught.value)
    with pytest.raises(ParameterError, match="'brokr'"):
        read_url("brokr")
    with pytest.raises(ParameterError, match="machine"):
        MqttSource(broker, "plant/one", "x")
    with pytest.raises(ParameterError, match=r"mqtt\.authority must be a PEM file"):
        MqttSource(read_url("mqtts://b/+", Tls(authority="no.pem"))[0], "+", "x")
    with pytest.raises(ParameterError, match=r"mqtt\.certificate must be a PEM file"):
        MqttSource(read_url("mqtts://b/+", Tls(certificate="no.pem"))[0], "+", "x")


def test_a_broker_that_cannot_be_reached_is_told_once_until_it_can(monitor):
    source, told = MqttSource(Broker("127.0.0.1", free_port()), "plant/+/acceleration", "x"), []
    source.told = lambda: told.append(source.trouble)
    source.start(monitor.engine)
    wait_for(lambda: source.trouble is not None)
    assert "127.0.0.1" in source.trouble and "refused" in source.trouble and "trying again" in source.trouble
    time.sleep(1.5)  # it is tried again after a second
    assert len(told) == 1
    source._on_connect(source._broker.client("y", keep_session=False), None, None, 0, None)
    source.stop()
    assert told[1:] == [None]


@pytest.mark.parametrize(
    ("pattern", "topic", "machine"),
    [
        ("plant/+/acceleration", "plant/press 1/acceleration", "press 1"),
        ("+/+/acc", "hall/press/acc", "hall.press"),
        ("plant/#", "plant/a/b", "a.b"),
        ("plant/+/acceleration", "plant/a/b/acceleration", ""),
    ],
)
def test_the_machine_is_what_stands_for_the_wildcard(pattern, topic, machine):
    broker, _ = read_url("mqtt://b/+")
    assert MqttSource(broker, pattern, "x").machine_of(topic) == machine


def test_files_are_read_once_when_they_are_complete(monitor, tmp_path, monkeypatch):
    monkeypatch.setattr("monitor.sources.folder._LOOK_S", 0.1)
    folder = tmp_path / "logger"
    (folder / "press-7").mkdir(parents=True)

    def write(name, seconds):
        time_s = np.arange(100 * seconds) / 100.0
        rows = "\n".join(f"{t:.2f},{np.sin(2 * np.pi * 20 * t):.6f}" for t in time_s)
        (folder / name).write_text(f"time [s],acceleration [m/s^2]\n{rows}\n")

    write("press-7/20270115T080000Z.csv", 5)
    (folder / "press-7" / "broken.parquet").write_bytes(b"PAR1 no more")
    source = FolderSource(folder, Reading(), None, settle=0.1, jitter=0.02, turn=1.0)
    source.start(monitor.engine)
    wait_for(lambda: (monitor.store.summary("press-7") or {}).get("turns") == 5)
    write("press-7/20270115T080005Z.csv", 3)
    wait_for(lambda: monitor.store.summary("press-7")["turns"] == 8)
    assert "gap" not in monitor.store.summary("press-7")["active_states"]
    source.stop()
    again = FolderSource(folder, Reading(), None, settle=0.1, jitter=0.02, turn=1.0)
    again.start(monitor.engine)
    time.sleep(0.6)  # six looks
    again.stop()
    assert monitor.store.summary("press-7")["turns"] == 8 and source.failure is None and again.failure is None
    assert monitor.engine.refused >= 1


def test_a_file_tells_its_machine_and_its_time(tmp_path):
    from pathlib import Path

    assert [machine_of(Path(name)) for name in ("a/b.csv", "press_0001.csv", "17.csv")] == ["a", "press", "machine"]
    file = tmp_path / "press_20270115T080000.25Z.csv"
    file.write_text("x")
    assert time_of(file, 5.0) == 1_800_000_000_250_000_000
    other = tmp_path / "press.csv"
    other.write_text("x")
    assert time_of(other, 5.0) == other.stat().st_mtime_ns - 5_000_000_000


def test_a_data_set_is_replayed_in_its_order(tmp_path, run_command):
    import datagen.__main__ as datagen

    arguments = ["campaign=wear", "campaign.lives=2", "campaign.records_per_life=3", f"out={tmp_path}/w"]
    assert run_command(datagen, *arguments)[0] == 0
    blocks = blocks_of(tmp_path / "w")
    assert len(blocks) == 6 and {block.machine for block in blocks} == {"machine 0", "machine 1"}
    assert [block.end_ns for block in blocks] == sorted(block.end_ns for block in blocks)
    assert all(block.begins for block in blocks) and min(block.start_ns for block in blocks) == 0


def test_an_alarm_is_posted_signed_until_it_is_taken(tmp_path, monkeypatch):
    from tests.monitor.conftest import running

    monkeypatch.setattr("monitor.outputs.outbox._LOOK_S", 0.02)
    got, answers = [], [500, 302, None, 200]

    class Receiver(BaseHTTPRequestHandler):
        def do_POST(self):
            body = self.rfile.read(int(self.headers["Content-Length"]))
            got.append((self.headers, body))
            answer = answers.pop(0) if answers else 200
            if answer is None:
                self.wfile.write(b"no HTTP\r\n\r\n")
                return
            self.send_response(answer)
            self.send_header("Location", "http://127.0.0.1:1/")
            self.send_header("Content-Length", "0")
            self.end_headers()

        def log_message(self, *_):
            pass

    server = HTTPServer(("127.0.0.1", 0), Receiver)
    threading.Thread(target=server.serve_forever, daemon=True).start()
    one = running(tmp_path, channels=("webhook",))
    sender = Sender(one.store, "webhook", WebhookDelivery(f"http://127.0.0.1:{server.server_port}/", "s" * 16))
    sender.start()
    one.send(5, 5.0)
    wait_for(lambda: sender.delivered == 1)
    assert len(got) == 4 and one.store.outbox("webhook") == []
    assert len({headers["X-Delivery"] for headers, _ in got}) == 1
    headers, body = got[-1]
    expected = hmac.new(b"s" * 16, headers["X-Timestamp"].encode() + b"." + body, hashlib.sha256).hexdigest()
    assert headers["X-Signature"] == expected
    told = json.loads(body)
    assert (told["machine"], told["quantity"], told["level"]) == ("press-1", "backlash_deg", "alert")
    sender.stop()
    one.engine.stop()
    server.shutdown()
    server.server_close()


def test_a_monitor_that_would_watch_nothing_is_refused(monkeypatch, tmp_path):
    """A twin that surely sees no fault, and models without limits; both broke at their first block."""
    told = SimpleNamespace(quantities=("crack",), needs_radius=False, twin=None)
    for name in ("TwinDiagnoser", "ClassifierDiagnoser"):
        monkeypatch.setattr(f"monitor.diagnoser.{name}", lambda *_: told)
    monkeypatch.setattr("monitor.diagnoser.load_model", lambda path: path)
    monkeypatch.setattr("monitor.diagnoser.Twin", SimpleNamespace(load=lambda path: path))
    monkeypatch.setattr("monitor.diagnoser.limits_of", lambda *_: {})
    for given, key in (("twin=t", "twin_limits"), ("model=m", "limits")):
        more = ["limits.crack=null"] if key == "limits" else []
        with pytest.raises(ParameterError, match=rf"monitor\.{key} must be limits of what .*\(crack\)"):
            Service(settings_of(config("source=broker", "port=0", "broker_port=0", given, f"out={tmp_path}/x", *more)))


def test_stations_are_those_of_the_twin_or_the_model_unless_stated(monkeypatch):
    """The level of each is followed; by the eight of the reference machine others would be cut anywhere."""

    def stations_of(*given):
        return diagnoser_of(settings_of(config("source=broker", *given)))[1].plan.stations

    told = SimpleNamespace(quantities=("crack",), needs_radius=False, stations=6)
    told.twin = SimpleNamespace(machine=SimpleNamespace(stations=6))
    for name in ("TwinDiagnoser", "ClassifierDiagnoser"):
        monkeypatch.setattr(f"monitor.diagnoser.{name}", lambda *_: told)
    monkeypatch.setattr("monitor.diagnoser.load_model", lambda path: path)
    monkeypatch.setattr("monitor.diagnoser.Twin", SimpleNamespace(load=lambda path: path))
    monkeypatch.setattr("monitor.diagnoser.limits_of", lambda *_: {"crack": Limits(0.1, 0.2, 0.3)})
    assert stations_of("twin=t") == stations_of("twin=t", "stations=6") == stations_of("model=m") == 6
    assert stations_of("model=m", "stations=4") == 4
    with pytest.raises(
        ParameterError, match=r"monitor\.stations must be 6, as the twin's machine has it, or left out, got 4"
    ):
        stations_of("twin=t", "stations=4")
    told.stations = None
    assert stations_of("model=m") is None


@pytest.mark.parametrize(
    ("overrides", "said"),
    [
        (["forget=3"], r"monitor\.forget must be the name of a machine, or a list of names, got 3"),
        (["forget=['']"], r"monitor\.forget must be the name of a machine"),
        (
            ["source=mqtt://broker/+", "model=m", "lease.owner=north", "forget=press-1"],
            r"monitor\.forget must be left out where several monitors share a store, got 'press-1'; stop the others",
        ),
    ],
)
def test_machines_to_be_forgotten_are_named_and_by_one_monitor_alone(overrides, said):
    with pytest.raises(ParameterError, match=said):
        settings_of(config(*overrides))
    assert settings_of(config("forget=press-1")).forget == ("press-1",)
    assert settings_of(config("forget=[a,b]")).forget == ("a", "b")
