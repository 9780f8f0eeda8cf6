"""One answer of networks and physics: a test for each rule."""

from __future__ import annotations

import dataclasses
import math
from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest

from indexer_env import Sensor, load_machine
from indexer_env.errors import refuse
from tests.twin import builders
from twin.answer import answer_of
from twin.diagnosis import FAULTY, HEALTHY, NOT_COMPARABLE, UNKNOWN, FaultSeen, TurnDiagnosis, said_of, together
from twin.faults import FAULTS
from twin.measured import Measured
from twin.physics import ESTABLISHED, PhysicalFault, Physics
from twin.twin import Twin

MACHINE = load_machine("reference")
MATTERS = {"crack": 0.05, "friction": 0.05, "reducer_play": 0.05}


def network(verdict: str, *names: str, matters: bool = True) -> TurnDiagnosis:
    faults = tuple(FaultSeen(name, 0.9, 5.0, 4.0, 6.0, "N m", 0.2, matters) for name in names)
    return TurnDiagnosis(verdict, faults, {}, {}, -1.0 if verdict == HEALTHY else 1.0, 0.5, "because")


def physics(verdict: str, *faults: tuple[str, float], level: float = 1.0) -> Physics:
    found = tuple(PhysicalFault(name, size, 0.9 * size, 1.1 * size, 0.99, ESTABLISHED, None) for name, size in faults)
    return Physics(verdict, found, level, 5.0, "a black box does better")


def measured(name: str, size: float, spread: float) -> Measured:
    """A fault whose likelihood is normal about a size."""
    return Measured(name, size, size - 1.96 * spread, size + 1.96 * spread, (size / spread) ** 2)


def crack(low: float, high: float, station: int | None = None) -> FaultSeen:
    """As the networks see it; physics measures 0.5 of the largest crack as 30 % (27 to 33)."""
    return FaultSeen("crack", 0.9, 0.5 * (low + high), low, high, "% of stiffness lost", 0.2, True, station)


def answered(seen: TurnDiagnosis, found: Physics | None):
    return answer_of(seen, found, MACHINE, MATTERS)


def test_a_record_that_cannot_be_compared_is_an_answer_of_its_own():
    answer = answered(network(NOT_COMPARABLE), None)
    assert answer.verdict == NOT_COMPARABLE and answer.headline == "Not comparable: because"


def test_without_physics_the_networks_answer():
    assert answered(network(HEALTHY), None).verdict == HEALTHY
    unknown = answered(network(UNKNOWN), None)
    assert unknown.verdict == UNKNOWN and unknown.remarks == ("By the networks because.",)
    answer = answered(network(FAULTY, "friction"), None)
    assert answer.headline == "Faulty: growing friction, 5 N m (4 to 6)."


def test_faults_that_physics_finds_are_the_answer_with_what_the_networks_said_beside_it():
    answer = answered(network(FAULTY, "friction"), physics(FAULTY, ("crack", 0.5)))
    assert answer.headline == "Faulty: cracked rollers, 30 % of stiffness lost (27 to 33)."
    assert [fault.by for fault in answer.faults] == ["physics"]
    assert "Networks: also growing friction" in answer.remarks[0] and "does not name it" not in answer.headline
    seen = network(FAULTY)
    both = answered(dataclasses.replace(seen, faults=(crack(28.0, 35.0),)), physics(FAULTY, ("crack", 0.5)))
    assert [fault.by for fault in both.faults] == ["physics and network"] and both.remarks == ()


def test_what_remains_behind_found_faults_is_said():
    answer = answered(network(FAULTY, "crack"), physics(FAULTY, ("crack", 0.5), level=3.0))
    assert answer.remarks[0] == "3.0 times the noise remains."


@pytest.mark.parametrize("verdict", [HEALTHY, UNKNOWN])
def test_a_fault_that_does_not_matter_explains_no_remainder_away(verdict):
    found = physics(FAULTY, ("crack", 0.01), level=5.0)
    answer = answered(network(verdict), found)
    assert answer.verdict == UNKNOWN
    assert "smaller than what is surely seen, beside which 5.0 times the noise" in answer.remarks[-1]
    assert answered(network(verdict), dataclasses.replace(found, level=1.1)).verdict == HEALTHY


@pytest.mark.parametrize(("size", "spread", "there"), [(0.01, 0.005, False), (0.05, 0.01, True), (0.0, 1e-9, False)])
def test_a_fault_that_networks_alone_name_stays_where_physics_measures_it_to_be_there(size, spread, there):
    seen = network(FAULTY, "crack", "friction")
    found = physics(FAULTY, ("crack", 0.5))
    found = dataclasses.replace(found, measured=(measured("friction", size, spread),))
    answer = answered(seen, found)
    assert {fault.name for fault in answer.faults} == ({"crack", "friction"} if there else {"crack"})
    # beside a fault that is not there the networks' size of the other one is not its own
    crack = next(fault for fault in answer.faults if fault.name == "crack")
    assert crack.size == pytest.approx(5.0 if there else 30.0) and crack.by == "physics and network"
    assert crack.sized_by == ("network" if there else "physics")
    unexplained = answered(seen, dataclasses.replace(found, level=1.3))
    assert {fault.name for fault in unexplained.faults} == ({"crack", "friction"} if there else {"crack"})
    # physics found no name, and leaves something
    nameless = answered(seen, dataclasses.replace(found, level=3.0, verdict=UNKNOWN, faults=()))
    assert {fault.name for fault in nameless.faults} == ({"crack", "friction"} if there else {"crack"})
    alone = answered(network(FAULTY, "friction"), dataclasses.replace(found, verdict=HEALTHY, faults=()))
    assert alone.verdict == (FAULTY if there else HEALTHY)
    said = "also without growing friction; by networks" if there else "down to the noise without it"
    assert said in alone.remarks[0] and len(alone.remarks) == 1
    if there:
        assert [fault.by for fault in alone.faults] == ["physics and network"]


@pytest.mark.parametrize(
    ("probability", "level", "verdict", "there"),
    [(0.4, 1.0, FAULTY, True), (0.0005, 1.0, FAULTY, False), (0.4, 1.3, FAULTY, True), (0.4, 1.0, HEALTHY, True)],
)
def test_a_fault_that_neither_names_is_told_where_both_together_find_it(probability, level, verdict, there):
    """A size of 4 standard deviations: a Bayes factor of 75."""
    (friction,) = network(FAULTY, "friction").faults
    unnamed = (dataclasses.replace(friction, probability=probability),)
    seen = dataclasses.replace(network(FAULTY, "crack"), unnamed=unnamed)
    looks = measured("friction", 0.04, 0.01), measured("crack", 0.5, 0.05)
    found = physics(verdict, *([("crack", 0.5)] if verdict == FAULTY else []), level=level)
    answer = answered(seen, dataclasses.replace(found, measured=looks))
    by = {fault.name: fault.by for fault in answer.faults}
    assert set(by) == ({"crack", "friction"} if there else {"crack"})
    if there:
        assert by["friction"] == "physics and network" and not answer.faults[-1].matters
        assert answer.faults[-1].sized_by == "physics"
    unlike = answered(dataclasses.replace(seen, faults=()), dataclasses.replace(found, measured=looks))
    assert verdict == HEALTHY or {fault.name for fault in unlike.faults} == {"crack"}
    # of two that may each explain what is left the likelier one alone
    more = (*unnamed, dataclasses.replace(friction, name="reducer_play", probability=0.3))
    both = dataclasses.replace(found, measured=(*looks, measured("reducer_play", 0.03, 0.01)))
    told = answered(dataclasses.replace(seen, unnamed=more), both)
    assert {fault.name for fault in told.faults} == set(by)


def test_an_alarm_without_a_likely_fault_is_healthy_where_the_nearest_one_is_too_small_to_matter():
    (crack,) = network(FAULTY, "crack", matters=False).faults
    nearest = dataclasses.replace(crack, probability=0.44)
    verdict, faults, why = said_of(7.6, 0.5, (), nearest)
    assert (verdict, faults) == (HEALTHY, ()) and "the turn shows" not in why
    assert why.endswith("no fault is likely; nearest: cracked rollers, 44 %, too small to matter")
    assert said_of(7.6, 0.5, (), dataclasses.replace(nearest, matters=True))[0] == UNKNOWN
    seen = TurnDiagnosis(verdict, faults, {}, {}, 7.6, 0.5, why, unnamed=(nearest,))
    for found in (None, physics(HEALTHY)):
        answer = answered(seen, found)
        assert (answer.verdict, answer.faults, answer.remarks) == (HEALTHY, (), (f"By the networks {why}.",))
    # physics may make it likely
    sure = dataclasses.replace(physics(HEALTHY), measured=(measured("crack", 0.2, 0.01),))
    assert answered(seen, sure).verdict == FAULTY


def test_a_likely_fault_too_small_to_matter_is_called_so_where_the_headline_is_healthy():
    named = network(FAULTY, "crack", matters=False).faults
    verdict, faults, why = said_of(7.6, 0.5, named, named[0])
    assert (verdict, faults) == (FAULTY, named) and why == "the turn shows cracked rollers, too small to matter"
    large = (*named, *network(FAULTY, "friction").faults)
    assert said_of(7.6, 0.5, large, named[0])[2] == "the turn shows cracked rollers and growing friction"


@pytest.mark.parametrize("novelty", [0.5, 2.0])
def test_an_alarm_without_a_likely_fault_gets_one_where_both_together_find_it(novelty):
    (friction,) = network(FAULTY, "friction").faults
    nearest = dataclasses.replace(friction, probability=0.45)
    seen = dataclasses.replace(network(UNKNOWN), unnamed=(nearest,), novelty=novelty)
    found = dataclasses.replace(physics(HEALTHY), measured=(measured("friction", 0.2, 0.01),))
    assert answered(seen, found).verdict == (FAULTY if novelty < 1.0 else HEALTHY)


def test_a_fault_that_both_name_keeps_the_size_of_the_networks():
    answer = answered(network(FAULTY, "crack", "friction"), physics(FAULTY, ("crack", 0.5)))
    assert [(fault.name, fault.by, fault.size) for fault in answer.faults] == [
        ("crack", "physics and network", 5.0), ("friction", "network", 5.0),
    ]  # fmt: skip
    assert answer.remarks[0] == (
        "By the networks alone: growing friction; physics does not name it and explains the record without it."
    )


def test_where_more_than_noise_is_left_the_networks_other_faults_stand_beside_those_of_physics():
    answer = answered(network(FAULTY, "friction"), physics(FAULTY, ("crack", 0.5), level=3.0))
    assert [(fault.name, fault.by) for fault in answer.faults] == [("crack", "physics"), ("friction", "network")]
    assert answer.remarks[0].startswith("By the networks alone: growing friction; physics does not name it and leaves")


def test_physics_that_needs_no_fault_overrules_an_alarm_and_says_so():
    found = dataclasses.replace(physics(HEALTHY), measured=(Measured("friction", 0.0, 0.0, 0.1, 0.0),))
    answer = answered(network(FAULTY, "friction"), found)
    assert answer.verdict == HEALTHY and "down to the noise without it" in answer.remarks[0]
    assert answered(network(HEALTHY), physics(HEALTHY)).remarks == ()


def test_a_turn_like_none_that_was_simulated_is_unknown_where_physics_leaves_more_than_noise():
    unlike, found = dataclasses.replace(network(UNKNOWN), novelty=2.0), physics(FAULTY, ("crack", 0.5), level=2.3)
    answer = answered(unlike, found)
    assert answer.verdict == UNKNOWN and answer.faults == () and "2.3 times the noise remains" in answer.remarks[1]
    assert answered(unlike, physics(FAULTY, ("crack", 0.5))).verdict == FAULTY


def test_an_alarm_without_a_likely_fault_leaves_what_physics_establishes():
    answer = answered(network(UNKNOWN), physics(FAULTY, ("crack", 0.5), level=2.3))
    assert answer.verdict == FAULTY and [fault.name for fault in answer.faults] == ["crack"]
    assert answer.remarks[-1] == "2.3 times the noise remains."


def test_without_physics_a_turn_like_none_that_was_simulated_has_no_fault():
    """Its headline is that no fault of the table explains it."""
    answer = answered(network(UNKNOWN, "crack"), None)
    assert answer.verdict == UNKNOWN and answer.faults == ()


def test_sizes_beside_a_turn_like_none_that_was_simulated_are_those_of_physics():
    unlike = dataclasses.replace(network(UNKNOWN), faults=(crack(4.0, 6.0, 5),), novelty=40.0)
    found = physics(FAULTY, ("crack", 0.5))
    found = dataclasses.replace(found, faults=(dataclasses.replace(found.faults[0], station=2),))
    (told,) = answered(unlike, found).faults
    assert (told.size, told.sized_by, told.station) == (pytest.approx(30.0), "physics", 2)


@pytest.mark.parametrize(
    ("low", "high", "station", "differ"), [(28.0, 35.0, 2, False), (28.0, 35.0, 5, True), (34.0, 40.0, 2, True)]
)
def test_stations_and_sizes_that_contradict_each_other_are_told(low, high, station, differ):
    found = physics(FAULTY, ("crack", 0.5))
    found = dataclasses.replace(found, faults=(dataclasses.replace(found.faults[0], station=2),))
    answer = answered(dataclasses.replace(network(FAULTY), faults=(crack(low, high, station),)), found)
    assert answer.faults[0].station == station
    assert [remark.startswith("Physics and networks differ: ") for remark in answer.remarks] == [True] * differ


def test_networks_are_believed_with_a_caution_where_physics_is_at_a_loss():
    answer = answered(network(FAULTY, "crack"), physics(UNKNOWN, level=4.0))
    assert answer.verdict == FAULTY and "does not confirm" in answer.remarks[0] and "4.0 times" in answer.remarks[0]
    assert answered(network(HEALTHY), physics(UNKNOWN, level=4.0)).verdict == UNKNOWN
    slight = answered(network(FAULTY, "crack", matters=False), physics(UNKNOWN, level=4.0))
    assert slight.verdict == UNKNOWN and "4.0 times the noise remains" in slight.remarks[0]
    assert answered(network(UNKNOWN), physics(UNKNOWN, level=4.0)).verdict == UNKNOWN


def test_why_physics_is_at_a_loss_is_one_sentence_with_one_full_stop():
    found = dataclasses.replace(physics(UNKNOWN, level=4.0), sentence="No effect lessens it.")
    assert answered(network(UNKNOWN), found).remarks[0].endswith("explains (No effect lessens it).")


def test_what_does_not_matter_is_told_but_not_in_the_headline():
    answer = answered(network(HEALTHY), physics(FAULTY, ("crack", 0.01)))
    assert answer.verdict == HEALTHY and "crack" not in answer.headline
    assert answer.remarks[-1].startswith("Smaller than what is surely seen: cracked rollers")
    mixed = answered(network(HEALTHY), physics(FAULTY, ("crack", 0.01), ("reducer_play", 0.5)))
    assert mixed.verdict == FAULTY and "crack" not in mixed.headline and "play in the reducer" in mixed.headline


def test_an_effect_outside_the_table_is_told_in_its_own_words():
    answer = answered(network(HEALTHY), physics(FAULTY, ("friction.viscous", 30.0)))
    assert answer.headline.startswith("Faulty: Viscous drag in the table bearing")


def turn(verdict: str, alarm: float, novelty: float = 0.5) -> TurnDiagnosis:
    return TurnDiagnosis(verdict, (), {}, {}, alarm, novelty, "because")


def test_several_records_raise_no_more_false_alarms_than_one():
    sound = turn(HEALTHY, -3.0)
    assert together([sound, turn(FAULTY, 0.5), sound]) is sound
    clear = turn(FAULTY, 9.0)
    # a fault that shows at one speed alone
    assert together([sound, clear, sound]) is clear


def test_one_strange_record_among_several_does_not_make_the_machine_unknown():
    sound, strange = turn(HEALTHY, -3.0), turn(UNKNOWN, -1.0, novelty=30.0)
    assert together([sound, strange, sound]) is sound
    assert together([sound, strange, strange]) is strange
    assert together([strange]) is strange


def test_of_records_with_an_alarm_one_that_names_its_faults_speaks():
    named, nameless = network(FAULTY, "crack"), turn(UNKNOWN, 3.0)
    assert together([nameless, named, nameless]) is named
    assert together([nameless]) is nameless


def test_the_alarm_of_a_strange_record_does_not_count():
    clear, sound, strange = turn(FAULTY, 1.0), turn(HEALTHY, -0.5), turn(UNKNOWN, -5.0, novelty=30.0)
    assert together([clear, sound, strange]) is clear


class OfRecords:
    """A twin that says of each record what it is given."""

    machine, matters, faults = MACHINE, MATTERS, tuple(FAULTS.values())

    def __init__(self, *said: TurnDiagnosis) -> None:
        self.said = list(said)

    def diagnose_turn(self, *record: object) -> TurnDiagnosis:
        return self.said.pop(0)

    def explain(self, *records: object) -> Physics:
        raise refuse("IndexerModel", "experiments", "records that hold a whole cam turn each", 0)


def test_a_record_that_differs_from_the_others_is_told_by_name():
    from discrepancy.records.conditions import Conditions
    from discrepancy.records.reading import Record
    from indexer_env.signal import Signal
    from twin.diagnose import diagnosed

    told = Conditions(150.0, 2.0, 1.0)
    records = [Record(name, Signal(np.zeros(16), 1000.0), told) for name in ("a.csv", "b.csv", "c.csv")]
    twin = OfRecords(turn(HEALTHY, -3.0), turn(FAULTY, 0.5), turn(NOT_COMPARABLE, 0.0))
    answer, each = diagnosed(twin, records, physics=False)  # type: ignore[arg-type]
    assert answer.verdict == HEALTHY and len(each) == 3
    assert answer.remarks == ("b.csv by itself is faulty: because.", "c.csv was left out: because")
    twin = OfRecords(turn(HEALTHY, -3.0), turn(HEALTHY, -2.0), turn(HEALTHY, -1.0))
    answer, _ = diagnosed(twin, records, physics=True)  # type: ignore[arg-type]
    assert answer.verdict == HEALTHY and answer.remarks[0].startswith("Physics was left out: IndexerModel.experiments")
    assert answer.no_physics.startswith("IndexerModel.experiments must be records that hold a whole cam turn")


@pytest.mark.parametrize(("verdict", "code"), [(NOT_COMPARABLE, 2), (HEALTHY, 0), (UNKNOWN, 0)])
def test_a_record_that_cannot_be_compared_ends_with_its_own_code(
    monkeypatch, tmp_path, run_command, verdict: str, code: int
) -> None:
    from twin import diagnose

    monkeypatch.setattr(OfRecords, "about", {"check": {"trusted": True}}, raising=False)
    monkeypatch.setattr(diagnose.Twin, "load", lambda folder: OfRecords(turn(verdict, 0.0)))
    lines = [f"{k / 1000.0:.3f},{k % 7:.5f}" for k in range(3000)]
    (tmp_path / "a.csv").write_text("\n".join(["time [s],acceleration [rad/s^2]", *lines, ""]))
    keys = ("known.motor_speed_rpm=1500", "known.load_torque=2", "physics=false")
    done, out, err = run_command(diagnose, f"twin={tmp_path}", f"signal={tmp_path / 'a.csv'}", *keys)
    assert (done, err) == (code, "") and out


def test_an_interval_of_physics_ends_where_there_is_no_more():
    found = Physics(FAULTY, (PhysicalFault("loose_base", 0.8, 0.1, 1.54, 0.99, ESTABLISHED, None),), 1.0, 5.0, "")
    assert answered(network(FAULTY), found).headline == "Faulty: loose base screws, 80 % loose (10 to 100)."


def test_physics_tells_no_station_where_it_was_found_by_comparison(monkeypatch):
    about = {
        "sample_noise": 0.1, "calibration": {"findings": (), "spread": {}},
        "settings": {"faults": ["crack_single"]}, "range": {"motor_speed_rpm": [1200.0, 1500.0]},
    }  # fmt: skip
    twin = Twin(Path(), about, builders.MACHINE, Sensor(), builders.view(), (), cast(Any, None), builders.healthy())
    cracked = PhysicalFault("crack_single", 0.5, 0.4, 0.6, 0.99, ESTABLISHED, station=3)
    monkeypatch.setattr(Twin, "draws", {})
    monkeypatch.setattr("twin.physics.checked", lambda *given: None)
    monkeypatch.setattr("twin.physics.explained", lambda *given: Physics(FAULTY, (cracked,), 1.0, 5.0, "said"))
    signal, told = builders.record(turns=1.2)
    turns = (signal, told), (signal, dataclasses.replace(told, start_angle=None))
    assert [twin.explain([turn]).faults[0].station for turn in turns] == [3, None]
    assert twin.explain(turns).faults[0].station is None


def test_a_size_of_which_nothing_is_told_speaks_neither_for_nor_against_a_fault():
    assert Measured("friction", 0.3, 0.0, math.inf, 0.0).evidence == 0.0
    assert Measured("friction", 0.3, 0.299, 0.301, 0.2).evidence < -5.0
    # a better minimum, in which the fault is held at nothing
    assert Measured("loose_base", 0.001, 0.001, 0.001, 110.0, nothing=0.001).evidence < -5.0


def test_networks_that_are_certain_do_not_name_what_physics_holds_at_nothing():
    (friction,) = network(FAULTY, "friction").faults
    seen = dataclasses.replace(network(FAULTY), faults=(dataclasses.replace(friction, probability=1.0),))
    nothing = (Measured("friction", 0.0, 0.0, 0.0, -20.0),)
    assert answered(seen, dataclasses.replace(physics(HEALTHY), measured=nothing)).verdict == HEALTHY


@pytest.mark.parametrize(("probability", "there"), [(0.6, False), (0.99, True)])
def test_what_physics_leaves_open_the_networks_decide(probability, there):
    """A size of 2.2 standard deviations: a Bayes factor of 0.29."""
    (friction,) = network(FAULTY, "friction").faults
    seen = dataclasses.replace(network(FAULTY), faults=(dataclasses.replace(friction, probability=probability),))
    look = measured("friction", 0.022, 0.01)
    assert look.evidence == pytest.approx(math.log(math.sqrt(2 * math.pi) * 0.01) + 0.5 * 2.2**2)
    answer = answered(seen, dataclasses.replace(physics(HEALTHY), measured=(look,)))
    assert [fault.name for fault in answer.faults] == (["friction"] if there else [])
