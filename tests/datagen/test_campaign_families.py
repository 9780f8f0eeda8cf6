"""All families of campaigns, then bench and random: which items they have, what their labels say, that rows remake."""

from __future__ import annotations

import json
import math
from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
from scipy.signal import welch

from classifier.codes import CodeBook
from datagen.campaign import SUBSETS
from datagen.campaigns import CAMPAIGNS
from datagen.check import check
from datagen.generate import generate
from datagen.labels import FAULT_CLASSES, fault_class, subset_schedule
from datagen.produce import produce
from datagen.remake import remake
from datagen.shard import read_shards
from indexer_env.effects import TABLES
from indexer_env.errors import ParameterError
from indexer_env.faults import LOOSE_HOUSING_HZ
from tests.datagen.families import SHORT, items_of, made, ordered

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
def test_a_row_depends_on_order_seed_and_number_alone(name):
    """Not on the items beside it, their order, the threads or the count: all columns and samples, bit for bit."""
    slip = "+campaign.draws.effects.drive.slip"
    slips = [f"{slip}.compliance={{uniform:[0.05,2]}}", f"{slip}.probability=0.3"] if name == "random" else []
    order = ordered(f"campaign={name}", "seed=9", "run.samples=300", *slips)
    items = items_of(order, min(order.count, 70))
    rows, records, _ = produce(order, items, threads=2)
    expected = {row["item"]: (row, record.tobytes()) for row, record in zip(rows, records, strict=True)}
    shuffled = [items[n] for n in np.random.default_rng(9).permutation(len(items))]
    for some, threads in ((items[:25], 1), (items[25:], 3), (items[:1], 1), (shuffled, 2)):
        rows, records, _ = produce(order, some, threads=threads)
        for row, record in zip(rows, records, strict=True):
            assert (row, record.tobytes()) == expected[row["item"]]


@pytest.mark.parametrize("name", sorted(CAMPAIGNS))
def test_a_machine_draw_is_in_one_subset(name):
    order = ordered(f"campaign={name}", *SHORT)
    pairs = {(item.label.machine_draw, item.label.subset) for item in items_of(order)}
    assert len(pairs) == len({draw for draw, _ in pairs})


@pytest.mark.parametrize("name", sorted(CAMPAIGNS))
def test_data_sets_of_every_campaign_pass_their_check_and_can_be_taught(name, tmp_path):
    """Seed 0, so few items as have two classes: one name and one code for each."""
    settings = {
        "grid": ["+campaign.axes.faults.backlash_deg=[0,5]", "sensor=bench"],
        "wear": ["campaign.first_backlash_deg=0"],
    }
    order = ordered(f"campaign={name}", *settings.get(name, []), *SHORT)
    generate(replace(order, count=min(order.count, 24)), tmp_path / "set")
    assert check(tmp_path / "set", remake=1).faults == []
    table = read_shards(tmp_path / "set").table
    codes = CodeBook.of_rows(*(np.array(table.column(each).to_pylist()) for each in ("class", "class_name", "code")))
    assert len(codes.classes) > 1


def test_the_columns_of_faults_hold_what_effects_add():
    """The label counts an effect that is such a fault; a severity of 0 beside it would teach the wrong size."""
    order = ordered(
        "faults.roller_crack=0.5",
        "faults.backlash_deg=1",
        "+machine.effects={roller.crack: {stiffness_loss: 0.2}, input.backlash: {backlash: 1e-3}, "
        "base.looseness: {compliance: 1e-5}}",
        *SHORT,
    )
    (row,), _ = made(order, [0])
    assert row["code"] == "111" and row["fault_roller_crack"] == pytest.approx(1.0 - 0.8 * 0.5)
    assert row["fault_backlash"] == pytest.approx(math.radians(1.0) + row["reduction_ratio"] * 1e-3)
    stiffness = (row["follower_inertia"] + row["housing_inertia"]) * (2.0 * math.pi * LOOSE_HOUSING_HZ) ** 2
    assert row["fault_screw_looseness"] == pytest.approx(1e-5 * stiffness)
    assert row["fault_cracked_station"] is None


def test_the_station_of_a_single_crack_is_that_of_its_effect():
    order = ordered("+machine.effects.roller.crack_single={stiffness_loss: 0.3, station: 2}", *SHORT)
    (row,), _ = made(order, [0])
    assert (row["fault_roller_crack"], row["fault_cracked_station"]) == (pytest.approx(0.3), 2)


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


def test_rows_with_a_table_remake():
    """A table over two variables that the machine has, one of its values drawn."""
    grid = ",".join(f"{name}:3.0" for name in TABLES["tabulated.speed_angle"].grid)
    order = ordered(
        "campaign=random",
        f"+machine.effects.tabulated.speed_angle={{{grid},low:-0.1,high:2.0}}",
        "+campaign.draws.effects.tabulated.speed_angle.torque_2_3={uniform:[5.0,9.0]}",
        *SHORT,
    )
    rows, records = made(order, list(range(6)))
    drawn = [next(one for one in json.loads(row["effects"]) if one["name"] == "tabulated.speed_angle") for row in rows]
    assert len({one["torque_2_3"] for one in drawn}) == 6 and all(one["torque_5_7"] == 3.0 for one in drawn)
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


def test_a_law_in_an_effects_own_place_holds_in_every_item():
    """The campaign gives friction to three items of ten; a machine with friction has it in all."""
    order = ordered("campaign=random", "+machine.effects.friction.coulomb.torque={log_uniform:[1,20]}", *SHORT)
    torques = [item.effects["friction.coulomb"]["torque"] for item in items_of(order, 40)]
    assert len(set(torques)) == 40 and min(torques) >= 1.0 and max(torques) <= 20.0


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
