"""Faults that are fixed, drawn, set in or grow."""

import dataclasses
import math

import numpy as np
import pytest

from indexer_env import Faults, OperatingPoint, ParameterError, Run, load_machine, simulate
from indexer_env.control import ControlTask
from indexer_env.env import IndexerEnv
from indexer_env.fault_law import TIGHT_LOOSENESS, Course, FaultLaw, fault_law
from indexer_env.faults import MOST_BACKLASH
from indexer_env.laws import Choice, Fixed, Uniform
from indexer_env.vector_env import IndexerVectorEnv

ONE = np.ones(1, dtype=np.float32)
PERIOD = 0.01
"""s; short, so that times of faults fall into many periods."""


def truths(env: IndexerEnv, steps: int, **reset: object) -> list[dict]:
    infos = [env.reset(**reset)[1], *(env.step(ONE)[4] for _ in range(steps))]  # type: ignore[arg-type]
    return [info["truth"] for info in infos]


def test_the_forms_a_law_may_have():
    law = fault_law({"backlash_deg": {"uniform": [0, 20]}, "roller_crack": {"choice": [0, 0.4]}, "crack_at": 3})
    assert law.backlash == Uniform(0.0, math.radians(20.0))
    assert law.roller_crack == Choice((0.0, 0.4)) and law.crack_at == Fixed(3.0)
    named = fault_law({"roller": {"choice": ["intact", "cracked"]}, "screws": "loose", "backlash_per_joule_deg": 1})
    assert named.roller_crack == Choice((0.0, 0.4)) and named.screw_looseness == Fixed(1.0)
    assert named.backlash_per_joule == Fixed(math.radians(1.0))
    assert fault_law(law) is law
    assert fault_law(None) == FaultLaw() == fault_law(Faults()) == fault_law(Course())
    faults = Faults(roller_crack=0.2, cracked_station=3)
    assert fault_law(faults).draw(np.random.default_rng(0)).faults == faults


def test_draws_follow_their_law():
    law = fault_law(
        {"backlash": {"uniform": [0.1, 0.3]}, "cracked_station": {"choice": [None, 2]}, "roller_crack": 0.3}
    )
    rng = np.random.default_rng(0)
    drawn = [law.draw(rng) for _ in range(400)]
    backlash = np.array([course.faults.backlash for course in drawn])
    assert backlash.min() >= 0.1 and backlash.max() < 0.3 and backlash.mean() == pytest.approx(0.2, abs=0.01)
    stations = [course.faults.cracked_station for course in drawn]
    assert 150 < stations.count(2) < 250 and stations.count(2) + stations.count(None) == 400


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ({"rollercrack": 0.1}, "faults has no parameter 'rollercrack'; did you mean 'roller_crack'."),
        ({"roller_crack": 1.5}, "faults.roller_crack must be a finite number >= 0 and < 1, got 1.5."),
        ({"roller_crack": {"uniform": [0.0, 1.5]}}, "faults.roller_crack must be a finite number >= 0 and < 1"),
        ({"roller_crack": {"uniform": [0.3, 0.1]}}, "faults.roller_crack must be {uniform: [low, high]} with"),
        (
            {"roller_crack": {"normal": [0.3, 0.1]}},
            "faults.roller_crack must be a finite number >= 0 and < 1, got -0.5",
        ),
        ({"roller_crack": {"unifrom": [0, 1]}}, "faults.roller_crack must be a value or one of {uniform: [low, high]}"),
        ({"roller_crack": {"choice": []}}, "faults.roller_crack must be {choice: [value, ...]}, got"),
        ({"roller_crack": {"around": 0.1}}, "faults.roller_crack must be a law that needs no data set and no nominal"),
        ({"roller_crack": {"sobol": [0, 0.1]}}, "faults.roller_crack must be a law that needs no data set"),
        ({"roller_crack": "0.3"}, "faults.roller_crack must be a finite number >= 0 and < 1, got '0.3'."),
        ({"roller_crack": math.nan}, "faults.roller_crack must be a finite number >= 0 and < 1, got nan."),
        ({"roller": "broken"}, "faults.roller must be one of intact, cracked, got 'broken'."),
        ({"roller": {"uniform": [0, 1]}}, "faults.roller must be one of intact, cracked or a choice of them"),
        ({"rolle": "cracked"}, "faults has no parameter 'rolle'; did you mean 'roller'."),
        (
            {"roller": "cracked", "roller_crack": 0.2},
            "faults.roller_crack must be left out where faults.roller is",
        ),
        ({"backlash_deg": "much"}, "faults.backlash_deg must be a finite number in deg, got 'much'."),
        ({"cracked_station": 1.5}, "faults.cracked_station must be a whole number >= 0, got 1.5."),
        ({"cracked_station": {"choice": [0, {"uniform": [1, 3]}]}}, "faults.cracked_station must be a station or a"),
        ({"cracked_station": {"uniform": [0, 3]}}, "faults.cracked_station must be a station or a choice of stations"),
        ({"crack_at": -1.0}, "faults.crack_at must be a finite number >= 0 s, got -1.0."),
        ({"backlash_per_joule": -1.0}, "faults.backlash_per_joule must be a finite number >= 0 rad/J, got -1.0."),
        (
            {"backlash": 0.1, "backlash_deg": 5.0},
            "faults.backlash_deg must be left out where faults.backlash is given, which says the same",
        ),
        (0.3, "faults must be a mapping of faults to their values or laws, got 0.3."),
    ],
)
def test_what_is_wrong_with_a_law_is_one_sentence(given, said):
    with pytest.raises(ParameterError) as caught:
        fault_law(given)
    assert str(caught.value).startswith(said)


def test_a_fixed_fault_is_the_simulated_one(reference):
    faults = Faults(roller_crack=0.3, backlash=0.2)
    env = IndexerEnv(period=PERIOD, faults=faults)
    _, info = env.reset(seed=0, options={"start_angle": 0.0})
    record = np.concatenate([info["acceleration"][-1:], *(env.step(ONE)[4]["acceleration"] for _ in range(40))])
    run = Run(step=ControlTask.step, samples=401, warmup_turns=0)
    np.testing.assert_array_equal(
        record, simulate(faults.applied_to(reference), OperatingPoint(), run).table_acceleration
    )


def test_options_are_for_one_episode():
    env = IndexerEnv(period=PERIOD, reveal=True)
    assert truths(env, 1, options={"faults": {"roller_crack": 0.4}})[1]["roller_crack"] == 0.4
    assert truths(env, 1)[1]["roller_crack"] == 0.0


def test_a_crack_sets_in_at_its_time():
    """Bit-equal to the sound machine until then, another record afterwards."""
    sound, cracking = (
        IndexerEnv(period=PERIOD),
        IndexerEnv(period=PERIOD, faults={"roller_crack": 0.5, "crack_at": 0.5}, reveal=True),
    )
    sound.reset(seed=1, options={"start_angle": 0.0})
    cracking.reset(seed=1, options={"start_angle": 0.0})
    same = []
    for k in range(1, 90):
        a, b = sound.step(ONE)[4], cracking.step(ONE)[4]
        same.append(np.array_equal(a["acceleration"], b["acceleration"]))
        assert b["truth"]["roller_crack"] == (0.5 if k >= 50 else 0.0)
    assert all(same[:50]) and not any(same[60:])


def test_screws_let_go_at_their_time():
    env = IndexerEnv(period=PERIOD, faults={"screw_looseness": 1.0, "loose_at": 0.4}, reveal=True)
    seen = truths(env, 80, seed=1, options={"start_angle": 0.0})
    assert [truth["screw_looseness"] for truth in seen] == [TIGHT_LOOSENESS] * 40 + [1.0] * 41
    third = np.array([np.abs(truth["torques"][2]).max() for truth in seen])
    assert third[0] == 0.0 and (third[1:] > 0.0).all()


def test_waiting_screws_are_all_but_tight(reference):
    """Until they let go the machine differs from one on a rigid base by a few hundredths of its signal."""
    env, tight = IndexerEnv(period=PERIOD, faults={"screw_looseness": 1.0, "loose_at": 1e6}), IndexerEnv(period=PERIOD)
    records = []
    for each in (env, tight):
        each.reset(seed=1, options={"start_angle": 0.0})
        records.append(np.concatenate([each.step(ONE)[4]["acceleration"] for _ in range(50)]))
    gap = np.sqrt(np.mean((records[0] - records[1]) ** 2) / np.mean(records[1] ** 2))
    assert 0.0 < gap < 0.05


def test_play_wears_with_the_work_done():
    env = IndexerEnv(period=PERIOD, faults={"backlash_per_joule": 1e-4}, reveal=True)
    seen = truths(env, 350, seed=1, options={"start_angle": 0.0})
    backlash = np.array([truth["backlash"] for truth in seen])
    changes = np.flatnonzero(np.diff(backlash))
    # once per cam turn of 1.025 s; 328 J a turn of eight indexes was measured for the sound machine
    assert len(changes) == 3 and np.all(np.abs(np.diff(changes) - 102.5) <= 1.0)
    assert (np.diff(backlash) >= 0.0).all()
    assert backlash[-1] == pytest.approx(3 * 1e-4 * 328.0 / 8, rel=0.1)


def test_wear_ends():
    assert Course(backlash_per_joule=1.0).at(1.0, 1e9).backlash == MOST_BACKLASH
    assert Course(backlash_per_joule=1.0).worst.backlash == MOST_BACKLASH and Course().worst == Faults()


def test_a_machine_whose_model_lacks_the_fault_is_refused():
    one_mass = dataclasses.replace(load_machine("smooth"), model="A")
    with pytest.raises(ParameterError, match=r"input\.backlash needs Machine.model B or B_on_base, got 'A'"):
        IndexerEnv(machine=one_mass, faults={"backlash_per_joule": 1e-4}).reset(seed=0)


@pytest.mark.parametrize(
    ("faults", "said"),
    [
        (
            {"screw_looseness": {"uniform": [0.0, 1.0]}},
            "faults.screw_looseness can be 1e-09, but IndexerEnv.step must be <= ",
        ),
        (
            {"screw_looseness": {"choice": [0.001, 0.5]}},
            "faults.screw_looseness can be 0.001, but IndexerEnv.step must be <= ",
        ),
        (
            {"roller_crack": {"uniform": [0.1, 0.4]}, "cracked_station": {"choice": [0, 8]}},
            "faults.cracked_station can be 8, but roller.crack_single.station must be below the machine's 8 stations",
        ),
    ],
)
@pytest.mark.parametrize("make", [IndexerEnv, lambda **given: IndexerVectorEnv(2, **given)])
def test_a_law_that_can_draw_an_impossible_fault_is_refused_at_once(make, faults, said):
    with pytest.raises(ParameterError) as caught:
        make(faults=faults)
    assert str(caught.value).startswith(said)


def test_a_law_that_only_one_of_many_machines_refuses():
    machines = [load_machine(), dataclasses.replace(load_machine(), stations=4)]
    law = {"roller_crack": 0.2, "cracked_station": 5}
    IndexerVectorEnv(2, machine=machines[0], faults=law)
    with pytest.raises(
        ParameterError, match=r"faults\.cracked_station can be 5, but .* the machine's 4 stations, got 5"
    ):
        IndexerVectorEnv(2, machine=machines, faults=law)


def test_the_ends_of_a_law_are_tried_once_each_and_no_fault_not_at_all():
    law = fault_law({"backlash": {"uniform": [0.0, 0.2]}, "loose_at": 2.0, "screw_looseness": {"choice": [0.0, 0.5]}})
    tried = [(name, value) for name, value, _ in law.extremes()]
    assert tried == [("screw_looseness", 0.5), ("backlash", 1e-9 * 0.2), ("backlash", 0.2), ("loose_at", 2.0)]
    assert list(FaultLaw().extremes()) == []
    mixed = fault_law({"screw_looseness": {"choice": [0.0, {"uniform": [0.1, 1.0]}]}})
    assert [value for name, value, _ in mixed.extremes() if name == "screw_looseness"] == [0.1, 1.0]
    IndexerEnv(faults=mixed)


def test_wear_ends_where_the_input_joint_has_no_more_room(reference):
    """At a reduction of 5 that is 1 rad at the motor; the machine was refused for it."""
    quick, point = dataclasses.replace(reference, reduction_ratio=5.0), OperatingPoint(motor_speed=30.0)
    env = IndexerEnv(machine=quick, operating_point=point, faults={"backlash_per_joule": 10.0}, reveal=True)
    env.reset(seed=0)
    worn = [env.step(ONE)[4]["truth"]["backlash"] for _ in range(60)]
    assert worn[0] == 0.0 and max(worn) == pytest.approx(1.0)
