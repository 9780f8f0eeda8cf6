"""Whatever comes over HTTP gets an answer: never a crash, a traceback or an alarm that nobody acknowledged."""

import json
import string

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from starlette.testclient import TestClient

pytestmark = [
    pytest.mark.slow,
    # Python's own cookie and header code complains of what no browser sends.
    pytest.mark.filterwarnings("ignore::DeprecationWarning"),
]

_ODD = ("press-1", "backlash_deg", "..", ".", "%2e%2e", "%00", "%ff", "1", "0", "-1", "9" * 30, "é", "'", '"', ";--")
_SIGNS = string.printable + "äß€\x00"
SEGMENT = st.one_of(
    st.sampled_from(_ODD),
    st.text(_SIGNS, min_size=1, max_size=12).map(lambda text: "".join(f"%{b:02x}" for b in text.encode())),
)
PATH = st.one_of(
    st.builds(lambda a: f"/api/machines/{a}/trends", SEGMENT),
    st.builds(lambda a, b: f"/api/machines/{a}/turns/{b}", SEGMENT, SEGMENT),
    st.builds(lambda a, b, c: f"/api/machines/{a}/turns?before={b}&count={c}", SEGMENT, SEGMENT, SEGMENT),
    st.builds(lambda a: f"/api/machines/{a}/physics", SEGMENT),
    st.builds(lambda a, b: f"/api/events?machine={a}&count={b}", SEGMENT, SEGMENT),
    st.builds(lambda a: f"/static/{a}", SEGMENT),
    st.lists(SEGMENT, max_size=4).map(lambda parts: "/" + "/".join(parts)),
    st.sampled_from(["/api/fleet", "/metrics", "/health", "/"]),
)
PLAIN = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=20)
    | st.sampled_from(["acknowledge", "repaired", "shelve", "unshelve", "note"]),
    lambda below: st.lists(below, max_size=3) | st.dictionaries(st.text(max_size=8), below, max_size=3),
    max_leaves=8,
)  # fmt: skip
BODY = st.one_of(
    st.binary(max_size=300),
    PLAIN.map(lambda value: json.dumps(value).encode()),
    st.fixed_dictionaries(
        {}, optional={"action": PLAIN, "note": PLAIN, "hours": PLAIN, "token": PLAIN, "more": PLAIN}
    ).map(lambda value: json.dumps(value).encode()),
)
KIND = st.sampled_from(["application/json", "application/json; charset=utf-8", "text/plain", "", "application/x"])
FUZZ = settings(max_examples=500, deadline=None, derandomize=True, suppress_health_check=list(HealthCheck))


def sane(response):
    assert response.status_code in (200, 304, 307, 400, 403, 404, 405, 413, 415), response.text
    assert "Traceback" not in response.text and "sqlite" not in response.text.lower()
    assert "content-security-policy" in response.headers


@pytest.fixture(scope="module")
def client(tmp_path_factory):
    from tests.monitor.conftest import running

    one = running(tmp_path_factory.mktemp("fuzz"))
    one.send(6, 5.0)
    with TestClient(
        one.app, base_url="http://localhost", raise_server_exceptions=True, follow_redirects=False
    ) as client:
        yield client, one
    one.engine.stop()
    one.store.close()


@FUZZ
@given(path=PATH, method=st.sampled_from(["GET", "GET", "HEAD", "PUT", "DELETE", "OPTIONS", "PATCH"]))
def test_any_address(client, path, method):
    sane(client[0].request(method, path))


@FUZZ
@given(machine=SEGMENT, quantity=SEGMENT, body=BODY, kind=KIND, known=st.booleans())
def test_any_command(client, machine, quantity, body, kind, known):
    path = "/api/machines/press-1/alarms/backlash_deg" if known else f"/api/machines/{machine}/alarms/{quantity}"
    web, one = client
    before = len(one.store.events("press-1", 1000))
    response = web.post(path, content=body, headers={"content-type": kind})
    sane(response)
    after = len(one.store.events("press-1", 1000))
    assert after == before + (response.status_code == 200) or before == 1000, "what was refused has done nothing"
    assert one.engine.failure is None


@FUZZ
@given(body=BODY, kind=KIND)
def test_no_body_signs_in_where_there_is_no_token(client, body, kind):
    response = client[0].post("/api/sign-in", content=body, headers={"content-type": kind})
    assert response.status_code in (400, 401, 413, 415) and "set-cookie" not in response.headers
