"""The interface: who may what, what is told, and that nothing a caller sends breaks it."""

import asyncio
import json
import math
import time
from dataclasses import replace

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from starlette.testclient import TestClient

from indexer_env.errors import ParameterError
from indexer_env.signal import Signal
from indexer_records.conditions import RecordConditions
from monitor.alarms.condition import HOUR_NS
from monitor.analysis.finding import Size
from monitor.outputs.metrics import Metrics
from monitor.settings import Access
from tests.monitor.conftest import WAIT_S, running
from tests.monitor.fakes import RATE, FakeDiagnoser, samples

OPERATOR, VIEWER, SECRET = "operator-token-0123", "viewer-token-012345", "proxy-secret-012345"
ACK = {"action": "acknowledge", "note": "seen"}


@pytest.fixture
def client(monitor):
    with TestClient(monitor.app, base_url="http://localhost") as client:
        yield client


@pytest.fixture
def guarded(tmp_path):
    one = running(tmp_path, Access(OPERATOR, VIEWER, SECRET, ("eve",)), local=False)
    with TestClient(one.app, base_url="http://localhost") as client:
        one.send(5, 5.0)
        yield client
    one.engine.stop()


def bearer(token):
    return {"authorization": f"Bearer {token}"}


def test_the_fleet_tells_what_is_wrong_and_the_turn_is_one_call_away(client, monitor):
    monitor.send(6, 1.0)
    monitor.send(6, 5.0)
    (machine,) = client.get("/api/fleet").json()["machines"]
    assert (machine["machine"], machine["level"], machine["worst"]) == ("press-1", "alert", "backlash_deg")
    trend = client.get("/api/machines/press-1/trends").json()["modes"]["60 rpm"]["backlash_deg"]
    assert len(trend["time"]) == 12 and trend["value"][-1] == pytest.approx(5.0, rel=1e-3)
    turns = client.get("/api/machines/press-1/turns?count=3").json()["turns"]
    assert [turn["number"] for turn in turns] == [12, 11, 10]
    turn = client.get("/api/machines/press-1/turns/12").json()
    assert turn["reference"]["number"] == 1 and len(turn["record"]["values"]) == 100
    peak = max(range(len(turn["spectrum"]["order"])), key=lambda k: turn["spectrum"]["amplitude"][k])
    assert turn["spectrum"]["order"][peak] == 20.0
    assert client.get("/api/events").json()["events"][0]["kind"] == "raised"


def test_after_a_repair_turns_are_compared_with_a_healthy_one_of_the_new_part(client, monitor):
    monitor.send(6, 1.0)
    monitor.send(6, 5.0)
    done = client.post("/api/machines/press-1/alarms/backlash_deg", json={"action": "repaired", "note": "new reducer"})
    assert done.status_code == 200
    monitor.send(12, 1.0)
    number = {
        turn: client.get(f"/api/machines/press-1/turns/{turn}").json()["reference"]["number"] for turn in (12, 24)
    }
    assert number[12] == 1 and number[24] > 12


def test_an_interval_without_end_is_null_on_the_page_and_survives_a_restart(client, monitor, tmp_path, monkeypatch):
    sizes = {"backlash_deg": Size(5.0, 0.5, math.inf)}
    finding = replace(
        FakeDiagnoser().diagnose_turn(Signal(samples(5.0, 0, 100), RATE), RecordConditions()), sizes=sizes
    )
    monkeypatch.setattr(FakeDiagnoser, "diagnose_turn", lambda *_: finding)
    monitor.send(5)
    monitor.engine.stop()
    again = running(tmp_path)
    again.sent = monitor.sent
    again.send(5)
    again.engine.stop()
    again.store.close()

    def strict(path):
        return json.loads(client.get(path).text, parse_constant=pytest.fail)

    trend = strict("/api/machines/press-1/trends")["modes"]["60 rpm"]["backlash_deg"]
    assert trend["high"] == [None] * 10 and trend["low"] == [0.5] * 10
    assert strict("/api/machines/press-1/turns/10")["sizes"]["backlash_deg"] == [5.0, 0.5, None]
    assert strict("/api/fleet")["machines"][0]["last"]["sizes"]["backlash_deg"] == [5.0, 0.5, None]
    assert strict("/api/events")["events"][0]["high"] is None


def test_an_alarm_is_acknowledged_with_a_note_once(client, monitor):
    monitor.send(5, 5.0)
    path = "/api/machines/press-1/alarms/backlash_deg"
    assert client.post(path, json=ACK).json()["note"] == "seen"
    again = client.post(path, json=ACK)
    assert again.status_code == 400 and "acknowledge" in again.json()["error"]
    assert client.post(path, json={"action": "shelve", "hours": 2}).status_code == 200
    assert client.post(path, json={"action": "unshelve"}).status_code == 200
    kinds = [event["kind"] for event in client.get("/api/events").json()["events"]]
    assert kinds == ["unshelved", "shelved", "acknowledged", "raised"]


def test_after_a_repair_the_trend_begins_anew(client, monitor):
    monitor.send(12, 5.0)
    where = "/api/machines/press-1/alarms/backlash_deg"
    done = client.post(where, json={"action": "repaired", "note": "new reducer"})
    assert done.status_code == 200 and (done.json()["kind"], done.json()["note"]) == ("repaired", "new reducer")
    (machine,) = client.get("/api/fleet").json()["machines"]
    assert machine["alarms"]["backlash_deg"]["acknowledged"] and "backlash_deg" not in machine["last"]["sizes"]
    trends = client.get("/api/machines/press-1/trends").json()["modes"]["60 rpm"]
    assert "backlash_deg" not in trends and "crack" in trends
    assert client.get("/api/events").json()["events"][0]["kind"] == "repaired"
    monitor.send(12, 1.0)
    (machine,) = client.get("/api/fleet").json()["machines"]
    assert machine["level"] == "normal" and machine["last"]["sizes"]["backlash_deg"][0] == pytest.approx(1.0, rel=1e-3)


def test_a_token_that_is_no_text_is_not_known(guarded):
    body = b'{"token": "\\ud800"}'
    answer = guarded.post("/api/sign-in", content=body, headers={"content-type": "application/json"})
    assert answer.status_code == 401


@pytest.mark.parametrize("off_h", [2, -24 * 365])
def test_states_are_told_in_the_time_of_the_samples(monitor, off_h):
    """Of a logger whose clock is ahead, and of files of last year; else one clock ends what the other has noted."""
    start_ns = time.time_ns() + off_h * HOUR_NS
    monitor.engine._stale_s = 0.1
    monitor.send(1, start_ns=start_ns)
    monitor.engine.broken("press-1", "it is no JSON")
    until = time.monotonic() + WAIT_S
    while not {"stale", "broken_payload"} <= set(monitor.store.summary("press-1")["active_states"]):
        assert time.monotonic() < until
        time.sleep(0.01)
    states = monitor.store.summary("press-1")["states"]
    for name in ("stale", "broken_payload"):
        assert abs(states[name]["last_ns"] - start_ns) < HOUR_NS / 60
    monitor.send(1, start_ns=start_ns + 2 * 10**9)
    assert "broken_payload" in monitor.store.summary("press-1")["active_states"]


def test_hours_count_from_now_also_where_the_machine_has_stood_still(client, monitor, tmp_path):
    """Since Friday, and the monitor was started anew on Monday: an alarm is shelved for 8 hours from then on."""
    monitor.send(5, 5.0)
    pipeline = monitor.engine._fleet.pipelines["press-1"]
    ended, stood = pipeline.until_ns, 60 * HOUR_NS
    pipeline.heard_ns -= stood
    path = "/api/machines/press-1/alarms/backlash_deg"
    assert client.post(path, json={"action": "shelve", "hours": 8}).status_code == 200
    monitor.engine.stop()
    again = running(tmp_path)
    summary = again.store.summary("press-1")["alarms"]["backlash_deg"]
    found = again.engine._fleet.pipelines["press-1"].time_at(time.time_ns())
    again.engine.stop()
    again.store.close()
    assert summary["shelved_until_ns"] - ended == pytest.approx(stood + 8 * HOUR_NS, abs=HOUR_NS / 60)
    assert found - ended == pytest.approx(stood, abs=HOUR_NS / 60)


def test_in_a_replay_hours_count_in_the_time_of_its_samples(client, monitor):
    monitor.send(5, 5.0)
    pipeline = monitor.engine._fleet.pipelines["press-1"]
    assert abs(pipeline.time_at(time.time_ns()) - pipeline.until_ns) < HOUR_NS / 60
    pipeline.heard_ns = None
    assert pipeline.time_at(time.time_ns()) == pipeline.newest_ns, "as of an earlier version"


@pytest.mark.parametrize(
    ("path", "status"),
    [
        ("/api/machines/nobody/trends", 404),
        ("/api/machines/press-1/turns/99999", 404),
        ("/api/machines/press-1/turns/99999999999999999999999", 404),
        ("/api/machines/press-1/turns?count=0", 400),
        ("/api/machines/press-1/turns?count=1e9", 400),
        ("/api/machines/press-1/turns?before=-1", 400),
        ("/api/events?count=100000", 400),
        ("/static/../app.py", 404),
        ("/static/%2e%2e/app.py", 404),
        ("/nothing", 404),
    ],
)
def test_what_is_not_there_is_told_so(client, path, status):
    assert client.get(path).status_code == status


def test_every_answer_carries_the_headers_of_a_careful_server(client):
    for path in ("/", "/static/main.js", "/api/fleet", "/nothing"):
        headers = client.get(path).headers
        assert "default-src 'none'" in headers["content-security-policy"]
        assert "unsafe" not in headers["content-security-policy"]
        assert headers["x-content-type-options"] == "nosniff"
    page = client.get("/").text
    assert "<script>" not in page and "style=" not in page and "http://" not in page and "https://" not in page


def test_another_name_for_this_host_is_refused(client):
    assert client.get("/api/fleet", headers={"host": "evil.example"}).status_code == 400
    assert client.get("/api/fleet", headers={"host": "127.0.0.2:8321"}).status_code == 200, "the one that it serves"


def test_another_site_may_not_act(client, monitor):
    monitor.send(5, 5.0)
    path = "/api/machines/press-1/alarms/backlash_deg"
    assert client.post(path, json=ACK, headers={"origin": "http://evil.example"}).status_code == 403
    assert client.post(path, content=json.dumps(ACK), headers={"content-type": "text/plain"}).status_code == 415
    assert client.post(path, json={**ACK, "note": "x" * 9000}).status_code == 413
    half = b'{"action": "note", "note": "\\ud83d"}'
    refused = client.post(path, content=half, headers={"content-type": "application/json"})
    assert refused.status_code == 400 and "UTF-8" in refused.json()["error"]
    assert client.get("/api/events").status_code == 200


def test_without_a_token_nothing_is_told(guarded):
    for path in ("/api/fleet", "/events", "/metrics", "/api/machines/press-1/trends", "/api/events"):
        assert guarded.get(path).status_code == 401
        assert guarded.get(path, headers=bearer("wrong")).status_code == 401
    assert guarded.get("/").status_code == 200 and guarded.get("/health").status_code == 200


def test_a_viewer_looks_and_an_operator_acts(guarded):
    path = "/api/machines/press-1/alarms/backlash_deg"
    assert guarded.get("/api/fleet", headers=bearer(VIEWER)).json()["person"] == {"name": "viewer", "operator": False}
    assert guarded.post(path, json=ACK, headers=bearer(VIEWER)).status_code == 403
    assert guarded.post(path, json=ACK, headers=bearer(OPERATOR)).json()["user"] == "operator"


def test_a_proxy_names_the_person_if_it_knows_the_secret(guarded):
    path = "/api/machines/press-1/alarms/backlash_deg"
    assert guarded.get("/api/fleet", headers={"x-forwarded-user": "eve"}).status_code == 401
    wrong = {"x-forwarded-user": "eve", "x-proxy-secret": "another-secret-1234"}
    assert guarded.get("/api/fleet", headers=wrong).status_code == 401
    adam = {"x-forwarded-user": "adam", "x-proxy-secret": SECRET}
    assert guarded.post(path, json=ACK, headers=adam).status_code == 403
    assert guarded.post(path, json=ACK, headers={**adam, "x-forwarded-user": "eve"}).json()["user"] == "eve"


def test_a_sign_in_gives_a_cookie_that_scripts_cannot_read(guarded):
    assert guarded.post("/api/sign-in", json={"token": "wrong"}).status_code == 401
    assert guarded.post("/api/sign-in", json={"token": 5}).status_code == 401
    answer = guarded.post("/api/sign-in", json={"token": OPERATOR})
    cookie = answer.headers["set-cookie"].lower()
    assert "httponly" in cookie and "samesite=strict" in cookie and OPERATOR not in cookie
    assert guarded.get("/api/fleet").json()["person"]["operator"]
    assert "secure" not in cookie
    over_tls = guarded.post("/api/sign-in", json={"token": OPERATOR}, headers={"origin": "https://localhost"})
    assert "secure" in over_tls.headers["set-cookie"].lower()


def test_secrets_are_long_and_not_shown():
    with pytest.raises(ParameterError, match="operator_token") as caught:
        Access(operator_token="short-1")
    assert "short-1" not in str(caught.value) and OPERATOR not in repr(Access(OPERATOR))


def test_metrics_tell_levels_and_states(client, monitor):
    monitor.send(5, 5.0)
    monitor.send(1, 0.0)
    text = client.get("/metrics").text
    assert 'machine_alarm_level{machine="press-1"} 1.0' in text
    assert 'machine_state{machine="press-1",state="dead"} 1.0' in text
    assert 'machine_turns_total{machine="press-1"} 6.0' in text
    assert 'machine_size{machine="press-1",mode="60 rpm",quantity="backlash_deg"} 5.0' in text


def test_metrics_are_read_beside_the_loop_that_serves_the_page(client, monkeypatch):
    """A database that does not answer would hold up every page."""

    def text(_):
        with pytest.raises(RuntimeError, match="no running event loop"):
            asyncio.get_running_loop()
        return "read"

    monkeypatch.setattr(Metrics, "text", text)
    assert client.get("/metrics").text == "read"


_JSON = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=20),
    lambda inner: st.lists(inner, max_size=3) | st.dictionaries(st.text(max_size=8), inner, max_size=3),
)


@pytest.mark.slow
@settings(max_examples=2000, suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow])
@given(
    method=st.sampled_from(["GET", "POST", "PUT", "DELETE"]),
    parts=st.lists(
        st.sampled_from(["api", "machines", "press-1", "turns", "alarms", "crack", "events", "sign-in", "1"])
        | st.text(max_size=12),
        max_size=6,
    ),
    query=st.dictionaries(st.sampled_from(["count", "before", "machine"]), st.text(max_size=12), max_size=2),
    body=st.dictionaries(st.sampled_from(["action", "note", "hours", "token"]), _JSON, max_size=4) | _JSON,
)
def test_no_request_breaks_the_interface(client, method, parts, query, body):
    path = "/" + "/".join(part.encode("utf-8", "replace").hex() if "/" in part else part for part in parts)
    if path.startswith("/events") or path.startswith("//"):
        return
    try:
        content = json.dumps(body).encode()
        answer = client.request(
            method, path, params=query, content=content, headers={"content-type": "application/json"}
        )
    except Exception as error:
        if type(error).__module__.startswith("httpx"):
            return  # no URL at all
        raise
    assert answer.status_code < 500, (method, path, query, body)
