"""A twin as the one who diagnoses: sizes, limits, speeds, and what keeps a turn from being compared."""

import dataclasses
import math

import numpy as np
import pytest

from discrepancy.records.conditions import Conditions
from indexer_env.errors import ParameterError, SignalError
from indexer_env.signal import Signal
from indexer_env.units import RPM
from indexer_records.conditions import RecordConditions
from indexer_records.resample import resampled
from indexer_records.stream import StreamedTurn
from monitor.alarms import Limits
from monitor.analysis.twin import DANGER, SHARE_UNIT, TwinDiagnoser, limits_of
from tests.monitor.twins import LOAD, NAMES, RATE, saying, turns, twin_folder
from tests.twin.builders import NOISE
from twin.faults import FAULTS
from twin.twin import Twin


@pytest.fixture(scope="module")
def twin(tmp_path_factory):
    return Twin.load(twin_folder(tmp_path_factory.mktemp("twin") / "twin"))


def diagnoser(twin, any_fault=-3.0, faults=(-4.0, -4.0, -4.0, -4.0), unlike=False):
    return TwinDiagnoser(saying(twin, any_fault, faults, unlike), LOAD)


def look(one, signal=None, rpm=1500.0):
    return one.diagnose_turn(turns(1) if signal is None else signal, RecordConditions(motor_speed=rpm * RPM))


@pytest.mark.parametrize("angle", [None, 0.3])
def test_a_turn_begins_at_the_angle_that_is_stated_of_the_pulse(twin, angle, monkeypatch):
    """Without one the twin compares, and names no station."""
    one, asked = diagnoser(twin), []
    seen = Twin.diagnose_turn

    def asking(self, signal, conditions):
        asked.append(conditions.start_angle)
        return seen(self, signal, dataclasses.replace(conditions, start_angle=None))

    monkeypatch.setattr(Twin, "diagnose_turn", asking)
    one.diagnose_turn(turns(1), RecordConditions(motor_speed=1500.0 * RPM), angle)
    assert asked == [angle]


def test_modes_are_the_speeds_of_the_healthy_records_or_those_that_are_given(twin):
    assert [mode.name for mode in diagnoser(twin).modes] == ["1200 rpm", "1500 rpm"]
    one = TwinDiagnoser(twin, LOAD, [1400 * RPM, 1401 * RPM])
    assert [mode.name for mode in one.modes] == ["1400 rpm"], "turns of both cannot be told apart"
    assert one.modes[0].rate == RATE and one.modes[0].unit == "rad/s^2"


@pytest.mark.parametrize(
    ("load", "speeds", "said"),
    [(None, None, "load_torque"), (50.0, None, "50 N m"), (LOAD, [900 * RPM], "900 rpm")],
)
def test_what_the_twin_does_not_know_is_refused_in_a_sentence(twin, load, speeds, said):
    with pytest.raises(ParameterError) as error:
        TwinDiagnoser(twin, load, speeds)
    assert said in str(error.value) and "\n" not in str(error.value)


def test_a_twin_that_is_not_to_be_trusted_says_so(twin):
    one = diagnoser(twin)
    assert one.caution is None
    check = {"trusted": False, "reason": "Not to be trusted: 3 of 10 healthy turns look faulty."}
    one.twin.about["check"], before = check, one.twin.about["check"]
    assert one.caution == "the twin: Not to be trusted: 3 of 10 healthy turns look faulty."
    one.twin.about["check"] = before


def test_the_load_of_healthy_records_that_have_but_one_is_known(tmp_path):
    assert TwinDiagnoser(Twin.load(twin_folder(tmp_path / "twin", loads=(LOAD, LOAD)))).load_torque == LOAD


def test_a_healthy_turn_has_sizes_that_reach_down_to_nothing(twin):
    found = look(diagnoser(twin))
    assert found.healthy and found.verdict == "as the healthy machine" and found.probability is None
    assert set(found.sizes) == set(NAMES)
    assert all(size.low == 0.0 and size.value < 0.02 * 60.0 and size.high == 0.0 for size in found.sizes.values())


def test_a_named_fault_is_told_with_its_size_and_the_others_by_their_chance(twin):
    found = look(diagnoser(twin, 5.0, (4.0, -1.0, -4.0, -4.0)))
    assert not found.healthy and found.verdict == "cracked rollers" and found.probability > 0.9
    crack, play = found.sizes["crack"], found.sizes["reducer_play"]
    assert crack.value == pytest.approx(30.0, rel=1e-4) and 0.0 < crack.low < 30.0 < crack.high
    assert play.low == 0.0 and play.value == pytest.approx(10.0 / (1 + math.e), rel=1e-4) and play.high > 10.0


def test_sizes_of_an_unknown_turn_are_no_findings_of_faults(twin):
    found = look(diagnoser(twin, 5.0, (4.0, -4.0, -4.0, -4.0), unlike=True))
    assert not found.healthy and "unlike" in found.verdict and found.novelty > 1.0
    assert found.sizes["crack"].low == 0.0


def test_an_alarm_without_a_likely_fault_is_a_change_that_no_fault_explains(twin):
    found = look(diagnoser(twin, 5.0, (-1.0, -1.0, -4.0, -4.0)))
    assert not found.healthy and found.verdict == "not as the healthy machine, and no fault of the table is likely"
    assert found.novelty == 2.0 and all(size.low == 0.0 for size in found.sizes.values())


def test_what_does_not_grow_from_nothing_is_told_as_share_and_of_either_sign_by_its_size(twin):
    one = diagnoser(twin, 5.0, (-4.0, -4.0, 4.0, 4.0))
    assert one.units["sensor_loose"] == SHARE_UNIT and one.units["crack"] == FAULTS["crack"].unit
    sizes = look(one).sizes
    assert sizes["sensor_loose"].value == pytest.approx(50.0, rel=1e-3)
    assert 0.0 < sizes["sensor_loose"].low < 50.0 < sizes["sensor_loose"].high
    assert sizes["sensor_gain"].value == pytest.approx(15.0, rel=1e-3)


def test_limits_come_from_what_the_twin_can_see(twin):
    found = limits_of(twin, {}, 0.2)
    crack = found["crack"]
    assert (crack.alert, crack.danger) == pytest.approx((0.04 * 60.0, DANGER * 60.0))
    assert crack.alarm == pytest.approx(math.sqrt(crack.alert * crack.danger)) and crack.deadband == 0.2
    loose = found["sensor_loose"]
    assert loose.alert == pytest.approx(50.0) and loose.danger == pytest.approx(100.0 * math.sqrt(0.5)), "above DANGER"
    assert "sensor_gain" not in found, "not even its largest size is surely seen"


def test_limits_that_are_given_count(twin):
    found = limits_of(twin, {"reducer_play": [2, 4, 8], "crack": None, "sensor_gain": [1, 2, 3]}, 0.1)
    assert found["reducer_play"] == Limits(2, 4, 8, 0.1) and "crack" not in found and "sensor_gain" in found
    for given, said in (
        ({"rust": [1, 2, 3]}, "rust"),
        ({"crack": 5}, "three numbers"),
        ({"crack": [3, 2, 1]}, "twin_limits.crack"),
    ):
        with pytest.raises(ParameterError, match=said):
            limits_of(twin, given, 0.2)


def test_a_turn_that_was_stretched_is_compared_at_its_own_speed(twin):
    slow = turns(1, slip=0.015)
    mode = diagnoser(twin).modes[1]
    count = round(mode.duration * RATE)
    step = np.array([slow.values.size / count / RATE])
    record = resampled(np.tile(slow.values, 2), RATE, RATE, np.array([0.0]), step, count)[0]
    stretched = Signal(record, RATE, unit="rad/s^2", source="press")

    def residual(rpm):
        one = diagnoser(twin)
        x, _ = one.twin.gate.looked(*one.comparable(stretched, RecordConditions(motor_speed=rpm * RPM)))
        return float(np.sqrt(np.mean(x**2)))

    assert residual(1500.0 * (1 - 0.015)) < 0.4 * residual(1500.0)


def test_what_cannot_be_compared_is_a_state(twin):
    one = diagnoser(twin)
    mode, record = one.modes[1], turns(1).values
    assert one.flaw(mode, StreamedTurn(0.0, 8.2, "", record)) is None
    assert one.flaw(mode, StreamedTurn(0.0, 8.2, "", record, constant_share=0.5))[0] == "dead"
    assert one.flaw(mode, StreamedTurn(0.0, 8.2, "", record, clipped_share=0.01))[0] == "clipped"
    shares = {"clipped_share": 0.39, "constant_share": 0.03}
    state, said = one.flaw(mode, StreamedTurn(0.0, 8.2, "", record, **shares))
    assert state == "clipped" and "39.0%" in said
    assert one.flaw(mode, StreamedTurn(0.0, 8.2, "", record, clipped_share=1.0, constant_share=1.0))[0] == "dead"
    assert one.flaw(mode, StreamedTurn(0.0, 9.9, "must last 8.2 s"))[0] == "other_speed"
    with pytest.raises(SignalError, match="times as strong as this machine's"):
        look(one, Signal(5.0 * record, RATE, unit="rad/s^2"))


@pytest.mark.parametrize("known", [True, False])
def test_physics_takes_out_what_healthy_records_leave(twin, known):
    """A reading that bends with the cam's tenth order by three times the noise, as no effect of the library does."""
    cells = twin.healthy.cells
    wave = 3.0 * NOISE * np.sin(10.0 * 2.0 * np.pi * (np.arange(cells.count) + 0.5) / cells.count)
    fixed = np.tile(wave, (4, cells.stations, 1)) if known else np.zeros((4, cells.stations, cells.count))
    remains = dataclasses.replace(twin.view.remains, fixed=fixed)
    one = dataclasses.replace(twin, view=dataclasses.replace(twin.view, remains=remains))
    record = turns(2)
    angle = 0.3 + twin.machine.reduction * 1500.0 * RPM / RATE * np.arange(len(record.values))
    bent = dataclasses.replace(record, values=record.values + 3.0 * NOISE * np.sin(10.0 * angle))
    said = one.explain([(bent, Conditions(motor_speed=1500.0 * RPM, load_torque=LOAD, start_angle=0.3))])
    assert (said.verdict == "healthy") == known and (said.level < 1.1) == known
