"""A block checks itself, and a message becomes a block or one sentence."""

import json
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from indexer_cli.json_values import finite
from indexer_env.errors import SignalError
from monitor.intake.blocks import LARGEST_BLOCK, NANO, Block
from monitor.intake.payload import LARGEST_PAYLOAD, block_of, nanoseconds
from monitor.store.codec import block_bytes, block_from, pack, unpack

GOOD = {"time": 1_800_000_000, "rate": 1000, "unit": "g", "values": [1, 2.5, None]}


def message(**changes: object) -> bytes:
    return json.dumps({**GOOD, **changes}).encode()


def test_a_message_becomes_a_block_in_si_units():
    block = block_of("press 1", message(sequence=3, speed_rpm=60, pulse=[0, 1, 0], sensor="a", begins=True))
    assert block.unit == "m/s^2" and block.rate == 1000.0 and block.sequence == 3 and block.begins
    np.testing.assert_allclose(block.values[:2], [9.80665, 24.516625], rtol=1e-6)
    assert math.isnan(block.values[2])
    assert block.motor_speed == pytest.approx(2 * math.pi)
    assert block.end_ns == 1_800_000_000 * NANO + 3_000_000


def test_float32_with_user_properties_is_the_same_block():
    samples = np.array([[1.0, 0.0], [2.0, 1.0]], "<f4")
    properties = {"time": "2027-01-15T08:00:00Z", "rate": "1000", "unit": "m/s^2", "columns": "2", "sequence": "7"}
    block = block_of("m", samples.tobytes(), properties)
    assert block.values.tolist() == [1.0, 2.0] and block.sequence == 7
    assert block.pulse is not None and block.pulse.tolist() == [0.0, 1.0]


def test_times_are_taken_to_the_microsecond_in_their_zone():
    assert nanoseconds("2026-11-22T06:00:00.000001+01:00") == nanoseconds("2026-11-22T05:00:00Z") + 1000
    assert nanoseconds(1.5) == 1_500_000_000


@pytest.mark.parametrize(
    ("changes", "word"),
    [
        ({"time": "2026-11-22T06:00:00"}, "zone"),
        ({"time": True}, "time"),
        ({"time": 1e300}, "time"),
        ({"time": 10**400}, "time"),
        ({"rate": 10**400}, "rate"),
        ({"speed_rpm": 10**400}, "speed_rpm"),
        ({"time": None}, "lacks time"),
        ({"rate": 0}, "rate"),
        ({"rate": "1000"}, "rate"),
        ({"rate": 1e9}, "rate"),
        ({"rate": 1e-9}, r"rate must be such that 3 samples end before 2100, in Hz, got 1e-09"),
        ({"rate": 1e-306}, "rate"),
        ({"unit": "furlong"}, "unit"),
        ({"unit": 3}, "unit"),
        ({"values": []}, "values"),
        ({"values": ["1"]}, "values"),
        ({"values": [[1], [2]]}, "values"),
        ({"values": [10**400]}, "values"),
        ({"values": 7}, "values"),
        ({"pulse": [1, 0]}, "pulse"),
        ({"pulse": [1, None, 0]}, "pulse"),
        ({"sequence": -1}, "sequence"),
        ({"sequence": 1.5}, "sequence"),
        ({"sensor": 5}, "sensor"),
        ({"sensor": "SN\ud800"}, "sensor must be .* UTF-8"),
        ({"speed_rpm": "fast"}, "speed_rpm"),
        ({"speed_rpm": -1}, "speed_rpm"),
        ({"begins": 1}, "begins"),
        ({"surprise": 1}, "surprise"),
    ],
)
def test_a_wrong_field_gets_one_sentence(changes, word):
    with pytest.raises(SignalError, match=word) as caught:
        block_of("m", message(**changes))
    assert "\n" not in str(caught.value) and len(str(caught.value)) < 300


def test_user_properties_tell_time_and_begins_as_json_does_or_get_one_sentence():
    properties = {"time": "1800000000", "rate": "1000", "unit": "m/s^2", "begins": "true"}
    samples = np.zeros(3, "<f4").tobytes()
    block = block_of("m", samples, properties)
    assert (block.start_ns, block.begins) == (1_800_000_000 * NANO, True)
    for word, begins in (("True", True), ("false", False)):
        assert block_of("m", samples, {**properties, "begins": word}).begins is begins
    wrong = (({"begins": "1"}, "begins must be true or false, got '1'"), ({"time": "99999999999"}, "time"))
    for changes, word in wrong:
        with pytest.raises(SignalError, match=word):
            block_of("m", samples, {**properties, **changes})
    quarter = block_of("m", samples, {**properties, "time": "1800000000.25"})
    assert quarter.start_ns - block.start_ns == pytest.approx(NANO / 4, abs=1000)


@pytest.mark.parametrize("machine", ["", "../../etc", "a/b", "a\nb", "x" * 65, "$(reboot)"])
def test_a_machine_s_name_is_no_path_and_no_code(machine):
    with pytest.raises(SignalError, match="machine"):
        block_of(machine, message())


def test_a_message_is_bounded():
    with pytest.raises(SignalError, match="at most"):
        block_of("m", b" " * (LARGEST_PAYLOAD + 1))
    with pytest.raises(SignalError, match="values"):
        Block("m", 0, 1.0, "m/s^2", np.zeros(LARGEST_BLOCK + 1))


PLAIN = st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=10)
KEYS = st.sampled_from([*GOOD, "pulse", "x"])
BODIES = st.recursive(
    PLAIN, lambda inner: st.lists(inner, max_size=4) | st.dictionaries(KEYS, inner, max_size=5), max_leaves=12
)


@given(st.binary(max_size=200) | BODIES.map(lambda body: json.dumps(body).encode()))
def test_whatever_comes_is_a_block_or_a_sentence(payload):
    try:
        block_of("m", payload)
    except SignalError as error:
        assert "\n" not in str(error)


def test_what_is_stored_comes_back():
    for pulse in (None, np.array([0.0, 1.0, 0.0])):
        block = Block("m", 5, 10.0, "m/s^2", np.array([1.0, math.nan, 3.0]), pulse, 3, "s", 2.0, True)
        again = block_from(block_bytes(block))
        assert (again.start_ns, again.rate, again.sequence, again.sensor, again.begins) == (5, 10.0, 3, "s", True)
        np.testing.assert_array_equal(again.values, block.values)
        assert (again.pulse is None) == (pulse is None)
    assert unpack(pack({"a": [1, math.inf]})) == {"a": [1, math.inf]}
    assert finite({"a": (math.nan, 1.0)}) == {"a": [None, 1.0]}
