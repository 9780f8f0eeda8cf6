"""The families bench, random, wear and grid: which items they have, what their labels say, and that rows remake."""

from __future__ import annotations

import dataclasses
import json
import math
from collections import Counter
from typing import Any

import numpy as np
import pytest
from hydra import compose, initialize_config_dir
from omegaconf import OmegaConf
from scipy.integrate import solve_ivp
from scipy.signal import welch

from datagen.campaign import SUBSETS, build
from datagen.campaigns import CAMPAIGNS
from datagen.campaigns.wear import play_after
from datagen.labels import FAULT_CLASSES, fault_class, subset_schedule
from datagen.order import Order, order_from
from datagen.produce import produce
from datagen.remake import remake
from indexer_env.errors import ParameterError
from indexer_env.presets import config_dir

SHORT = ["run.samples=300", "run.warmup_turns=0"]


def ordered(*overrides: str) -> Order:
    with initialize_config_dir(str(config_dir()), version_base="1.3"):
        config = OmegaConf.to_container(compose("datagen", ["out=x", *overrides]))
    assert isinstance(config, dict)
    return order_from({str(key): value for key, value in config.items()})


def items_of(order: Order, count: int | None = None) -> list[Any]:
    return [order.campaign.item(index, order.base, order.seed) for index in range(count or order.count)]


def made(order: Order, indices: list[int]) -> tuple[list[dict[str, Any]], np.ndarray]:
    rows, records, rejected = produce(order, [order.campaign.item(i, order.base, order.seed) for i in indices])
    assert not rejected, rejected[0]["reason"]
    return rows, records


# ---------------------------------------------------------------------------------------------- all families


@pytest.mark.parametrize("name", sorted(CAMPAIGNS))
def test_rows_of_every_campaign_are_made_again_bit_for_bit(name):
    order = ordered(f"campaign={name}", "seed=4", *SHORT)
    indices = sorted({0, 1, order.count // 3, order.count // 2, order.count - 1} & set(range(order.count)))
    rows, records = made(order, indices)
    for row, record in zip(rows, records, strict=True):
        np.testing.assert_array_equal(remake(row), record.astype(np.float32))


@pytest.mark.parametrize("name", sorted(CAMPAIGNS))
def test_an_item_depends_on_seed_and_number_alone(name):
    order = ordered(f"campaign={name}", *SHORT)
    last = order.count - 1
    alone = ordered(f"campaign={name}", *SHORT).campaign.item(last, order.base, 0)
    assert items_of(order)[last] == alone
    if name != "grid":
        assert order.campaign.item(last, order.base, 1) != alone
        assert order.campaign.example(order.base, 0) != order.campaign.item(order.campaign.example_index, order.base, 0)


@pytest.mark.parametrize("name", sorted(CAMPAIGNS))
def test_a_machine_draw_is_in_one_subset(name):
    order = ordered(f"campaign={name}", *SHORT)
    pairs = {(item.label.machine_draw, item.label.subset) for item in items_of(order)}
    assert len(pairs) == len({draw for draw, _ in pairs})


def test_rows_with_loose_screws_effects_and_a_drawn_sensor_remake():
    order = ordered(
        "campaign=random",
        "faults.screws=loose",
        "~campaign.draws.faults.screw_looseness",
        "sensor=bench",
        "+campaign.draws.effects.drive.slip.compliance={uniform:[0.05,0.1]}",
        "+campaign.draws.effects.sensor.mains_hum.amplitude={uniform:[0.1,0.2]}",
        "+campaign.draws.sensor.lowpass_hz={choice:[null,100,200]}",
        "sensor.bits={choice:[12,16]}",
        *SHORT,
    )
    rows, records = made(order, list(range(12)))
    assert len({row["sensor_noise_density"] for row in rows}) == 12
    assert {row["sensor_lowpass_hz"] for row in rows} == {None, 100.0, 200.0}
    assert all(0.1 <= row["sensor_hum_amplitude"] < 0.2 and row["fault_screw_looseness"] == 1.0 for row in rows)
    assert all("drive.slip" in row["effects"] and "base.looseness" in row["effects"] for row in rows)
    for row, record in zip(rows, records, strict=True):
        np.testing.assert_array_equal(remake(row), record.astype(np.float32))


# ---------------------------------------------------------------------------------------------- labels and subsets


def test_the_paper_s_bits_are_the_code():
    assert fault_class({}) == (1, "intact", "000")
    assert fault_class({"faults.roller_crack": 0.4, "faults.backlash": 0.1}) == (6, "roller cracked, backlash", "101")
    assert fault_class({"effects.base.looseness.compliance": 1e-6}) == (3, "screws loose", "010")
    assert len(set(FAULT_CLASSES)) == 8 and FAULT_CLASSES[7] == "roller cracked, screws loose, backlash"


@pytest.mark.parametrize(
    "parts", [{"calibration": 5, "control": 2, "validation": 3}, {"calibration": 1, "validation": 1}]
)
def test_every_prefix_of_the_draws_has_its_shares(parts):
    schedule = subset_schedule(parts, "split")
    total = sum(parts.values())
    assert len(schedule) == total and Counter(schedule) == Counter(parts)
    for draws in range(1, total + 1):
        for subset in SUBSETS:
            assert abs(schedule[:draws].count(subset) - parts.get(subset, 0) * draws / total) < 1.0


# ---------------------------------------------------------------------------------------------- bench


def test_the_bench_has_the_paper_s_20_cases_10_times():
    order = ordered("campaign=bench")
    cases = Counter(
        (item.faults["roller_crack"], item.faults["screw_looseness"], round(math.degrees(item.faults["backlash"]) / 5))
        for item in items_of(order)
    )
    assert order.count == 200 and len(cases) == 20 and set(cases.values()) == {10}
    assert set(cases) == {(crack, loose, step) for crack in (0.0, 0.4) for loose in (0.0, 1.0) for step in range(5)}
    rounds = Counter((item.label.machine_draw, item.label.subset) for item in items_of(order))
    assert set(rounds.values()) == {20}
    assert Counter(subset for _, subset in rounds) == {"calibration": 5, "control": 2, "validation": 3}


def test_the_bench_s_codes_are_its_faults():
    for item in items_of(ordered("campaign=bench"), 20):
        faults = (item.faults["roller_crack"], item.faults["screw_looseness"], item.faults["backlash"])
        assert item.label.code == "".join("1" if fault > 0.0 else "0" for fault in faults)


def test_repeats_of_the_bench_differ_as_they_should():
    """Machine parameters from round to round, start, load and speed from test to test, a set play by 2 %; no play stays
    none."""
    items = items_of(ordered("campaign=bench"))
    stiffness = {item.label.machine_draw: item.machine["output_joint.stiffness"] for item in items}
    assert len(set(stiffness.values())) == 10
    assert all(item.machine["output_joint.stiffness"] == stiffness[item.label.machine_draw] for item in items)
    values = np.array(list(stiffness.values())) / 44413.22
    assert 0.99 <= values.min() < values.max() <= 1.01
    for name in ("start_angle", "load_torque", "motor_speed"):
        assert len({item.operating_point[name] for item in items}) == 200
    plays = np.degrees([item.faults["backlash"] for item in items]).reshape(10, 4, 5)
    assert (plays[..., 0] == 0.0).all() and 4.9 <= plays[..., 1].min() < plays[..., 1].max() <= 5.1
    assert 0.0 < plays[..., 4].std() < 0.4


@pytest.fixture(scope="module")
def bench_spectra() -> dict[str, np.ndarray]:
    """Mean density of three rounds for each case, (m/s²)²/Hz by roller, screws and degrees; 8.2 s at 1 kHz."""
    order = ordered("campaign=bench")
    spectra: dict[str, list[np.ndarray]] = {}
    indices = [20 * round_ + case for round_ in range(3) for case in range(20)]
    rows, records = made(order, indices)
    for row, record in zip(rows, records, strict=True):
        key = f"{row['code'][:2]}{5 * round(math.degrees(row['fault_backlash']) / 5)}"
        spectra.setdefault(key, []).append(welch(record, 1000.0, nperseg=1000)[1])
    return {key: np.mean(each, axis=0) for key, each in spectra.items()}


def test_the_classes_of_the_bench_differ_in_their_spectra(bench_spectra):
    """Teeth that have play hit each other, which excites what lies above the 15 Hz of the output joint; a housing on
    loose screws sways below its own 12 Hz and takes the place of the 15 Hz; the softer sense of a cracked roller rings
    below them."""
    assert len(bench_spectra) == 20

    def power(case: str, low: int, high: int) -> float:
        return float(bench_spectra[case][low:high].sum())

    for case in ("00", "01", "10", "11"):
        assert power(f"{case}20", 20, 40) > 5.0 * power(f"{case}0", 20, 40)
    for degrees in ("0", "10", "20"):
        assert power(f"01{degrees}", 5, 10) > 1.4 * power(f"00{degrees}", 5, 10)
        assert power(f"01{degrees}", 14, 20) < 0.5 * power(f"00{degrees}", 14, 20)
    for degrees in ("0", "5", "10"):
        assert power(f"10{degrees}", 10, 14) > 2.5 * power(f"00{degrees}", 10, 14)


def test_a_bench_without_what_differs_is_refused():
    with pytest.raises(ParameterError, match=r"datagen\.count must be <= 20 where nothing is drawn"):
        ordered("campaign=bench", "sensor=ideal", "~campaign.draws", "~campaign.drift")


# ---------------------------------------------------------------------------------------------- random


def test_a_random_campaign_draws_within_its_laws_and_balances_the_classes():
    order = ordered("campaign=random", *SHORT)
    items = items_of(order)
    inertia = np.array([item.machine["table_inertia"] for item in items])
    assert 2.5 <= inertia.min() < 2.6 and 9.6 < inertia.max() <= 10.0
    assert np.median(inertia) == pytest.approx(5.0, rel=0.1)
    assert all(80 < number < 170 for number in Counter(item.label.number for item in items).values())
    coulomb = [item.effects["friction.coulomb"]["torque"] for item in items if "friction.coulomb" in item.effects]
    assert 250 < len(coulomb) < 350 and min(coulomb) >= 1.0 and max(coulomb) <= 20.0
    assert {item.machine["model"] for item in items} == {"B", "B_on_base"}
    # what one effect draws does not depend on which others are there
    other = ordered("campaign=random", "campaign.draws.effects.friction.viscous.probability=1.0", *SHORT)
    for mine, theirs in zip(items[:50], items_of(other, 50), strict=True):
        assert mine.machine == theirs.machine
        assert mine.effects.get("friction.coulomb") == theirs.effects.get("friction.coulomb")


def test_repeats_on_one_machine_share_it_and_differ_by_drift():
    drift = "+campaign.drift.operating_point.load_torque={around:0.1}"
    order = ordered("campaign=random", "campaign.machines=5", "campaign.repeats=3", drift, *SHORT)
    items = items_of(order)
    assert [item.label.machine_draw for item in items] == [0, 0, 0, 1, 1, 1, 2, 2, 2, 3, 3, 3, 4, 4, 4]
    assert items[0].machine == items[2].machine != items[3].machine
    loads = [item.operating_point["load_torque"] for item in items[:3]]
    assert len(set(loads)) == 3 and max(loads) / min(loads) < 1.1 / 0.9


def test_what_cannot_be_is_rejected_with_its_reason():
    order = ordered("campaign=random", "campaign.draws.machine.model={choice:[A,B]}", *SHORT)
    rows, _, rejected = produce(order, items_of(order, 40))
    assert rows and rejected
    assert all(row["reason"].endswith("which that model does not have.") for row in rejected)
    assert all(json.loads(row["draws"])["machine"]["model"] == "A" for row in rejected)


def test_a_value_of_the_wrong_kind_is_rejected_too():
    order = ordered("faults.roller_crack={choice:[0,much]}", "count=8", *SHORT)
    rows, _, rejected = produce(order, items_of(order))
    assert rows and rejected
    assert {row["reason"] for row in rejected} == {
        "Faults.roller_crack must be a finite number >= 0 and < 1, got 'much'."
    }


# ---------------------------------------------------------------------------------------------- wear


def test_play_grows_as_its_differential_equation_says():
    """dg/dn = a + b g with the two constants that the ends and the speed-up fix, solved by DOP853."""
    first, last, speed_up, life = 0.01, 0.35, 4.0, 5e6
    b = math.log(speed_up) / life
    a = b * (last - first) / (speed_up - 1.0) - b * first
    solved = solve_ivp(lambda n, g: a + b * g, (0.0, life), [first], "DOP853", rtol=1e-10, max_step=life / 50)
    assert solved.y[0, -1] == pytest.approx(last, rel=1e-8)
    for n, g in zip(solved.t, solved.y[0], strict=True):
        assert play_after(n / life, first, last, speed_up) == pytest.approx(g, rel=1e-8)
    assert (a + b * last) / (a + b * first) == pytest.approx(speed_up)
    assert play_after(0.5, 1.0, 3.0, 1.0) == 2.0


def test_a_life_runs_from_its_first_play_to_failure():
    order = ordered("campaign=wear", "campaign.lives=4", "campaign.records_per_life=6", *SHORT)
    items = items_of(order)
    plays = np.degrees([item.faults["backlash"] for item in items]).reshape(4, 6)
    left = np.array([item.label.remaining_turns for item in items]).reshape(4, 6)
    assert (np.diff(plays) > 0.0).all() and plays[:, 0].max() <= 1.0 and plays[:, -1] == pytest.approx(20.0)
    assert (left[:, -1] == 0).all() and (left[:, 0] >= 1e6).all() and (left[:, 0] <= 1e7).all()
    assert np.ptp(np.diff(left), axis=1).max() <= 1
    assert len(set(left[:, 0])) == 4 and len({item.machine["output_joint.stiffness"] for item in items}) == 4
    assert [item.label.machine_draw for item in items] == [life for life in range(4) for _ in range(6)]
    rows, _ = made(order, [0, 5])
    assert [row["remaining_turns"] for row in rows] == [left[0, 0], 0]


def test_listed_turns_beyond_a_life_are_rejected():
    turns = ["campaign.records_per_life=null", "campaign.turns=[0,3000000]", "campaign.lives=10"]
    order = ordered("campaign=wear", *turns, *SHORT)
    rows, _, rejected = produce(order, items_of(order))
    assert len(rows) + len(rejected) == 20 and 0 < len(rejected) < 10
    assert all("which this machine lives, got 3000000." in row["reason"] for row in rejected)
    assert {row["remaining_turns"] > 0 for row in rows} == {True}


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ("campaign.turns=[5]", "campaign.turns must be given where records_per_life is null"),
        ("campaign.last_play_deg=200", "Faults.backlash must be a finite number >= 0 and <= 2 rad"),
        ("campaign.last_play_deg=0.5", "campaign.last_play_deg must be a law that lies above first_play_deg"),
        ("+campaign.speed_up={normal:[2,1]}", "{'uniform': [1, 5], 'normal': [2, 1]}; keep one law."),
        ("~campaign.speed_up +campaign.speed_up={normal:[2,1]}", "campaign.speed_up must be a finite number >= 1e-06"),
        (
            "~campaign.life_turns +campaign.life_turns={around:0.1}",
            "campaign.life_turns must be a law other than sobol and",
        ),
        ("+campaign.draws.faults.backlash={uniform:[0,1]}", "as the campaign wear decides it"),
    ],
)
def test_a_life_that_cannot_be(change, said):
    with pytest.raises(ParameterError) as caught:
        ordered("campaign=wear", *change.split(" "), *SHORT)
    assert said in str(caught.value)


# ---------------------------------------------------------------------------------------------- grid


def test_a_grid_has_every_combination_so_many_times():
    axes = ["+campaign.axes.faults.roller=[intact,cracked]", "+campaign.axes.machine.table_inertia=[4,5,6]"]
    order = ordered(*axes, "campaign.repeats=2", "sensor.noise_density=0.01", *SHORT)
    items = items_of(order)
    cells = Counter((item.faults["roller_crack"], item.machine["table_inertia"]) for item in items)
    assert order.count == 12 and set(cells.values()) == {2}
    assert set(cells) == {(crack, inertia) for crack in (0.0, 0.4) for inertia in (4, 5, 6)}
    assert {item.label.number for item in items} == {1, 5}
    # three machines in each repeat, whatever their faults
    for item in items:
        machine = [4, 5, 6].index(item.machine["table_inertia"])
        assert item.label.machine_draw == 3 * (item.index // 6) + machine


def test_the_default_grid_is_the_machine_as_configured(base):
    order = ordered("faults.backlash_deg=10", "faults.roller=cracked", *SHORT)
    (item,) = items_of(order)
    case = build(item, order.base)
    assert case.machine == dataclasses.replace(order.base.faults, cracked_station=None).applied_to(base.machine)
    assert math.degrees(case.faults.backlash) == pytest.approx(10.0) and case.faults.roller_crack == 0.4
    assert (item.label.number, item.label.code) == (6, "101")


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ("+campaign.axes.machine.table_inertia=[4,4]", "a list of different values"),
        ("+campaign.axes.machine.table_inertia={uniform:[4,5]}", "a list of values, got {uniform: [4.0, 5.0]}"),
        ("+campaign.axes.run.samples=[4,5]", "campaign.axes.key must be one of machine, operating_point"),
        (
            "+campaign.axes.faults.backlash_deg=[0,5] +campaign.draws.faults.backlash_deg={uniform:[0,1]}",
            "left out or {around: share}, as the campaign grid decides it",
        ),
        ("campaign.repeats=0", "campaign.repeats must be a whole number >= 1"),
    ],
)
def test_a_grid_that_cannot_be(change, said):
    with pytest.raises(ParameterError) as caught:
        ordered(*change.split(" "), *SHORT)
    assert said in str(caught.value)
