"""Records against the nominal machine: what is slightly off is put right, what cannot be is refused in one sentence."""

import dataclasses
import math

import numpy as np
import pytest

from discrepancy.indexer import IndexerModel
from discrepancy.model import NONE
from discrepancy.noise import limited_noise, noise_of
from discrepancy.problem import Problem
from discrepancy.records.experiments import experiments
from discrepancy.records.matching import matched, nominal_orders
from discrepancy.records.quality import check_records
from discrepancy.records.speed import speed_known_to
from indexer_env import OperatingPoint, Run, Sensor, Signal, load_machine, make_effect, motion_law, simulate
from indexer_env.errors import ParameterError, SignalError
from indexer_records.resample import CUTOFF

RPM = 2.0 * math.pi / 60.0


def refusal(records, machine, sensor: Sensor | None = None) -> str:
    with pytest.raises(SignalError) as caught:
        experiments(records, machine, sensor or Sensor())
    said = str(caught.value)
    assert said.endswith(".") and "\n" not in said
    return said


def test_a_good_record_passes_and_its_second_half_is_held_out(record, nominal) -> None:
    found = experiments([record()], nominal, Sensor())
    (fitted,), (held,) = found.fitted, found.held_out
    assert (len(fitted.signal.values), len(held.signal.values)) == (9000, 9000)
    turned = held.operating_point.start_angle - fitted.operating_point.start_angle
    assert turned == pytest.approx(9.0 * 1500.0 * RPM / 25.625)
    assert any("a third or a half of each" in note for note in found.notes) and any(
        "one speed" in note for note in found.notes
    )


@pytest.mark.parametrize(("rpm", "noted"), [(1501.2, True), (1530.0, False)])
def test_speeds_that_clocks_tell_apart_are_one_speed(record, nominal, rpm: float, noted: bool) -> None:
    """1500 and 1501.2 rpm, the same record at the rate that it would have; 2 % is another speed."""
    other = record(rate=1000.0 * rpm / 1500.0, motor_speed=rpm * RPM)
    found = experiments([record(), other], nominal, Sensor())
    assert any("one speed" in note for note in found.notes) == noted


def test_a_drift_goes_on_where_the_second_half_is_held_out(record, nominal, values) -> None:
    rate, late = 0.5, 9.0
    drifting = experiments([record(values + rate * np.arange(len(values)) / 1000.0)], nominal, Sensor())
    plain = experiments([record()], nominal, Sensor())
    assert [part.begun for part in (*drifting.fitted, *drifting.held_out)] == [0.0, late]
    for told, before in ((drifting.fitted, plain.fitted), (drifting.held_out, plain.held_out)):
        one, other = IndexerModel(nominal, told, Sensor(offset_drift=rate)), IndexerModel(nominal, before)
        assert level(one) == pytest.approx(level(other), rel=1e-3)
        assert level(IndexerModel(nominal, told)) > 1.5 * level(other)


def test_the_noise_of_a_fast_record_is_that_of_the_record_as_measured(record, nominal, values) -> None:
    """Seed 4; 4 kHz, of which half is held out: behind the anti-alias filter its estimate would be another one."""
    rate, rng = 4000.0, np.random.default_rng(4)
    fast = np.interp(np.arange(4 * len(values)) / rate, np.arange(len(values)) / 1000.0, values)
    fast += 0.5 * rng.standard_normal(len(fast))
    found = experiments([dataclasses.replace(record(), signal=Signal(fast, rate))], nominal, Sensor())
    told = limited_noise(*noise_of(fast, rate), rate, CUTOFF * 1000.0, 1000.0)
    for part in (*found.fitted, *found.held_out):
        assert part.signal.sample_rate == 1000.0 and (part.noise_level, part.colour) == told
    assert told[0] == pytest.approx(0.5 * math.sqrt(2.0 * CUTOFF / 4.0), rel=0.1)


def test_records_by_one_sensor_share_their_noise_but_where_it_is_stated(record, nominal, values) -> None:
    """Seed 4; what a third of a record would say by itself is another number."""
    noise = np.random.default_rng(4).standard_normal((2, len(values)))
    one, other = (record(values + size * row) for size, row in zip((0.1, 0.5), noise, strict=True))
    stated = dataclasses.replace(other, conditions=dataclasses.replace(other.conditions, noise=0.7))
    found = experiments([one, other], nominal, Sensor())
    quieter = noise_of(one.signal.values, 1000.0)
    assert [(part.noise_level, part.colour) for part in (*found.fitted, *found.held_out)] == [quieter] * 4
    found = experiments([one, stated], nominal, Sensor())
    assert [part.noise_level for part in found.fitted] == [quieter[0], 0.7]


@pytest.mark.parametrize(("sensor", "rate"), [(Sensor(), 1000.0), (Sensor(lowpass_hz=800.0), 4000.0)])
def test_a_sensor_with_filters_reads_at_the_rate_of_its_record(record, nominal, values, sensor, rate) -> None:
    """At 1 kHz a low-pass of 800 Hz would be none, one of 400 Hz another one."""
    time = np.arange(4 * len(values)) / 4000.0
    fast = np.interp(time, np.arange(len(values)) / 1000.0, values)
    found = experiments([dataclasses.replace(record(), signal=Signal(fast, 4000.0))], nominal, sensor)
    assert {part.signal.sample_rate for part in (*found.fitted, *found.held_out)} == {rate}


@pytest.mark.parametrize("slow", [500.0, 999.0 * (1.0 - 1e-6), 999.5])
def test_records_of_several_rates_are_taken_at_the_lowest(record, nominal, values, slow: float) -> None:
    """One logger at 1 kHz, one at half of it, one whose clock is off by 0.1 %, one by 0.05 %, which is left to the fit.
    The slow record is the fast one, read at its times; seed 4."""
    count, rng = int(len(values) * slow / 1000.0), np.random.default_rng(4)
    other = np.interp(np.arange(count) / slow, np.arange(len(values)) / 1000.0, values)
    slower = record(other + 0.1 * rng.standard_normal(count), rate=slow)
    slower = dataclasses.replace(slower, name="slow.csv")
    check_records([record(), slower], nominal)
    found = experiments([record(), slower], nominal, Sensor())
    fast, kept = (e.signal.sample_rate for e in found.fitted)
    same = slow == 999.5
    assert (fast, kept) == (1000.0 if same else slow, slow)
    assert any(f"run.csv is taken at {slow:g} Hz of its 1000 Hz" in note for note in found.notes) != same
    IndexerModel(nominal, found.fitted)  # takes records of one rate alone
    left, own = (level(IndexerModel(nominal, [e])) * e.noise_level for e in found.fitted)
    assert left == pytest.approx(own, rel=0.05), "as well predicted as the record of that rate"
    stated = experiments([record(noise=0.2), slower], nominal, Sensor()).fitted[0]
    share = 1.0 if same else math.sqrt(2.0 * CUTOFF * slow / 1000.0)
    assert stated.noise_level == pytest.approx(0.2 * share, rel=0.1)


def level(model: IndexerModel) -> float:
    problem = Problem(model, NONE)
    return problem.point(np.zeros(len(model.parameters)), np.zeros((len(model.counts), 4))).level(model)


def test_a_record_named_to_be_held_out_is(record, nominal) -> None:
    found = experiments([record(), record(held_out=True)], nominal, Sensor())
    assert (len(found.fitted), len(found.held_out)) == (1, 1)
    assert "all of them held out" in refusal([record(held_out=True)], nominal)


def test_a_start_angle_that_is_not_stated_is_found(record, nominal) -> None:
    found = experiments([record(start_angle=None)], nominal, Sensor())
    assert found.fitted[0].operating_point.start_angle == pytest.approx(1.3, abs=0.01)
    assert any("start angle is not stated" in note for note in found.notes)


def test_a_speed_that_is_slightly_off_is_put_right(record, nominal) -> None:
    found = experiments([record(motor_speed=1510.0 * RPM)], nominal, Sensor())
    assert found.fitted[0].operating_point.motor_speed == pytest.approx(1500.0 * RPM, rel=1e-4)
    assert any("1500.0" in note and "1510" in note for note in found.notes)


def test_a_record_that_repeats_every_second_cam_turn_passes_at_its_speed_alone(record, nominal, values) -> None:
    """A machine that is shaken hard may take two cam turns to repeat; so does one at twice the speed that it has."""
    cam = 2.0 * math.pi * 1500.0 / 60.0 / 25.625
    twice = values + 0.5 * values.std() * np.sin(0.5 * cam * np.arange(len(values)) / 1000.0)
    found = experiments([record(twice)], nominal, Sensor())
    assert any("run.csv repeats itself only after several cam turns" in note for note in found.notes)
    said = refusal([record(twice, motor_speed=3000.0 * RPM)], nominal)
    assert "3000 rpm stated" in said and "as it repeats every 2.05 s" in said


@pytest.mark.parametrize("stated", [750.0, 1000.0, 1400.0, 1600.0, 3000.0])
def test_a_wrong_speed_is_refused_with_the_right_one(record, nominal, stated: float) -> None:
    said = refusal([record(motor_speed=stated * RPM)], nominal)
    assert "motor speed must be" in said and f"{stated:g} rpm stated" in said
    assert float(said.split(" rpm by the record")[0].split()[-1]) == pytest.approx(1500.0, rel=3e-3)


@pytest.mark.parametrize(
    ("factor", "guess"),
    [(1.0 / 9.80665, "g where m/s^2"), (9.80665, "m/s^2 where g"), (1000.0, "mm/s^2 where m/s^2")],
)
def test_a_wrong_unit_is_refused_with_the_likely_one(record, nominal, values, factor: float, guess: str) -> None:
    samples = 0.4 * values * factor
    said = refusal([record(samples, unit="m/s^2")], nominal, Sensor(radius=0.4))
    assert "the level must be" in said and f"looks like {guess}" in said


@pytest.mark.parametrize(("drawn", "noted"), [(10, True), (6, True), (8, False)])
def test_a_level_of_another_number_of_stations_is_said(record, nominal, values, drawn: int, noted: bool) -> None:
    """A drawing with 10 or 6 stations of a table that has 8."""
    notes = experiments([record(values)], dataclasses.replace(nominal, stations=drawn), Sensor()).notes
    assert (
        any(f"as a table with 8 stations would have; check machine.stations, {drawn}" in one for one in notes) == noted
    )


def test_a_tangential_record_needs_its_radius(record, nominal, values) -> None:
    tangential = record(0.4 * values, unit="m/s^2")
    said = refusal([tangential], nominal)
    assert "known.sensor_radius=0.35 (m), or as sensor_radius in records.csv or records.yaml" in said
    assert len(experiments([tangential], nominal, Sensor(radius=0.4)).fitted) == 1


def test_a_wrong_start_angle_is_refused(record, nominal) -> None:
    said = refusal([record(start_angle=2.0)], nominal)
    assert "2.000 rad (114.6°) stated and 1.29" in said and "(74." in said


def test_noise_alone_is_no_record_of_a_machine(record, nominal) -> None:
    """Seed 2."""
    said = refusal([record(np.random.default_rng(2).standard_normal(18000))], nominal)
    assert "must repeat with the cam" in said


@pytest.mark.parametrize("change", [{"motion_share": 0.7}, {"stations": 4}])
def test_a_record_of_another_machine_is_refused(record, nominal, change: dict) -> None:
    said = refusal([record(_samples(dataclasses.replace(nominal, **change)))], nominal)
    assert "must look like the nominal machine" in said or "the level must be" in said


@pytest.mark.parametrize(
    ("change", "words"),
    [
        ({"motion_law": motion_law("polynomial_345")}, "with motion_law polynomial_345"),
        ({"motion_law": motion_law("cycloidal")}, "with motion_law cycloidal"),
        ({"motion_share": 0.55}, "with motion_share 0.55"),
    ],
)
def test_another_motion_that_is_more_like_the_record_is_named(record, nominal, change: dict, words: str) -> None:
    """The first is as like as 0.988, which a machine that is shaken hard is not."""
    given = record(_samples(dataclasses.replace(nominal, **change)))
    said = refusal([given], nominal)
    assert words in said and "correct motion_law or motion_share, or set check_motion=false" in said
    found = experiments([given], nominal, Sensor(), check_motion=False)
    assert found.fitted and any(words in note and "the stated one is taken" in note for note in found.notes)


def _soft(machine, share: float):
    """The machine with an output joint so much less stiff, as much damped for its mode."""
    joint = machine.output_joint
    joint = dataclasses.replace(joint, stiffness=share * joint.stiffness, damping=math.sqrt(share) * joint.damping)
    return dataclasses.replace(machine, output_joint=joint)


def test_a_stiffness_that_is_off_does_not_make_another_motion(record, nominal, monkeypatch) -> None:
    """A soft table that rings among the orders compared and is a quarter stiffer than in the drawing: taken as the
    drawing has it, its likeness falls short by 0.38 times as much with another law."""
    given, soft = [record(_samples(_soft(nominal, 0.17 * 1.25)))], _soft(nominal, 0.17)
    assert experiments(given, soft, Sensor()).fitted
    monkeypatch.setattr("discrepancy.records.likeness._NEARER", 0.5)
    assert experiments(given, soft, Sensor()).fitted, "compared as stiff as makes it most alike"
    monkeypatch.setattr("discrepancy.records.matching._STIFFNESSES", (1.0,))
    assert "with motion_law polynomial_345" in refusal(given, soft)
    monkeypatch.setattr("discrepancy.records.likeness._NEARER", 0.25)
    assert experiments(given, soft, Sensor()).fitted, "another law would leave a quarter"


@pytest.mark.parametrize("stiffer", [0.75, 0.87, 1.33])
def test_another_law_is_seen_through_a_stiffness_that_is_off(record, nominal, stiffer: float) -> None:
    """A soft table, the law of the drawing wrong: the right law is the more like one, 0.01 to 0.21 times as far off."""
    drawn = dataclasses.replace(_soft(nominal, 0.25), motion_law=motion_law("modified_sine"))
    truth = dataclasses.replace(_soft(nominal, 0.25 * stiffer), motion_law=motion_law("polynomial_345"))
    assert "with motion_law polynomial_345" in refusal([record(_samples(truth))], drawn)


def test_strong_friction_does_not_make_another_motion(record, nominal) -> None:
    """Below the likeness that another motion law leaves, but none of them is nearer."""
    joint = dataclasses.replace(nominal.output_joint, stiffness=0.3 * nominal.output_joint.stiffness)
    soft = dataclasses.replace(nominal, output_joint=joint)
    samples = _samples(soft.with_effects(make_effect("friction.viscous", coefficient=400.0)))
    orders = nominal_orders(soft, OperatingPoint(), Sensor(), 1000.0)
    rate = nominal.reduction * OperatingPoint().motor_speed
    assert 0.95 < matched(samples, 1000.0, rate, orders).likeness < 0.98
    assert experiments([record(samples)], soft, Sensor()).fitted


def _samples(machine) -> np.ndarray:
    return simulate(machine, OperatingPoint(start_angle=1.3), Run(samples=18000)).table_acceleration


def test_strong_effects_do_not_make_another_machine(record, nominal) -> None:
    """20° of play, a slipping motor and a soft output joint pass the door."""
    loose = dataclasses.replace(nominal.input_joint, backlash=math.radians(20.0) / 25.625)
    machines = [
        dataclasses.replace(nominal, input_joint=loose),
        nominal.with_effects(make_effect("drive.slip", compliance=1.5)),
        nominal.with_effects(make_effect("output.backlash", backlash=1e-3)),
    ]
    for machine in machines:
        run = simulate(machine, OperatingPoint(start_angle=1.3), Run(samples=18000))
        found = experiments([record(run.table_acceleration, motor_speed=_mean_speed(machine))], nominal, Sensor())
        assert found.fitted[0].operating_point.start_angle == 1.3


def _mean_speed(machine) -> float:
    run = simulate(machine, OperatingPoint(start_angle=1.3), Run(samples=18000, channels=("motor_rate",)))
    return float(run.channels["motor_rate"].mean())


def test_pulses_give_speed_and_start(record, nominal) -> None:
    turn = 8.2
    first = (-1.3 / (1500.0 * RPM / 25.625)) % turn
    found = experiments([record(pulses=np.array([first, first + turn]), start_angle=None)], nominal, Sensor())
    point = found.fitted[0].operating_point
    assert point.start_angle == pytest.approx(1.3, abs=1e-6)
    assert point.motor_speed == pytest.approx(1500.0 * RPM)
    uneven = np.array([first, first + turn, first + 2.5 * turn])
    assert "pulses must come evenly" in refusal([record(pulses=uneven)], nominal)
    slow = np.array([first, first + 1.5 * turn])
    assert "1000 rpm by the record, by the pulses" in refusal([record(pulses=slow)], nominal)


@pytest.mark.parametrize(("often", "got"), [(0.5, "one in 2 turns"), (8.0, "8 in each"), (8.0 * 25.625, "205 in each")])
def test_pulses_that_do_not_come_once_a_turn_are_refused(record, nominal, often: float, got: str) -> None:
    """One missed each time, one of the cam, one of the motor."""
    said = refusal([record(pulses=1.0 + np.arange(3) * 8.2 / often)], nominal)
    assert f"one pulse in each turn of the table, got {got} at the 1500 rpm stated; take the pulse from" in said


@pytest.mark.parametrize(("drift", "last"), [(0.002, 2), (-0.004, 2), (0.004, 3)])
def test_a_speed_by_pulses_is_as_uncertain_as_the_drift_makes_it(record, drift: float, last: int) -> None:
    """A speed that drifts from the first sample to the last one; pulses of its first turns alone tell another mean."""
    duration, turn, late = 3.2 * 8.2, 8.2, 0.4
    long = record(np.zeros(int(1000.0 * duration)))
    time = np.linspace(0.0, duration, 100_001)
    turned = time + drift * (0.5 * time**2 / duration - 0.5 * time)  # at its mean speed the time itself
    pulses = np.interp(late + turn * np.arange(last), turned, time)
    error = turn / float(np.diff(pulses).mean()) - 1.0
    long = dataclasses.replace(long, pulses=pulses)
    spread = speed_known_to(long, 1500.0 * RPM / 25.625)
    assert abs(error) < 1.05 * abs(drift) / 0.002 * spread and abs(error) > 5e-5


def test_what_pulses_tell_is_as_sure_as_they_are_far_apart(record, nominal) -> None:
    cam_rate = 1500.0 * RPM / 25.625
    first = (-1.3 / cam_rate) % 8.2
    pulsed = record(pulses=np.array([first, first + 8.2]), start_angle=None)
    found = experiments([pulsed, record(held_out=True)], nominal, Sensor()).fitted[0]
    middle = (first + 4.1) / pulsed.signal.duration
    speed = math.hypot(math.sqrt(2.0) * 0.002 / (8.2 * cam_rate), 0.002 * (middle - 0.5))
    assert found.speed_uncertainty == pytest.approx(speed)
    assert found.start_uncertainty == pytest.approx(math.hypot(0.002, first * cam_rate * speed))


def test_an_experiment_tells_whether_its_start_was_found_by_comparison(record, nominal) -> None:
    """A record that is divided knows its later start less well, and yet nothing was compared."""
    pulse = np.array([(-1.3 / (1500.0 * RPM / 25.625)) % 8.2])
    for angle, pulses, compared in ((1.3, None, False), (None, pulse, False), (None, None, True)):
        found = experiments([record(start_angle=angle, pulses=pulses)], nominal, Sensor())
        assert [e.start_compared for e in (*found.fitted, *found.held_out)] == [compared, compared]


def test_a_late_pulse_counts_with_the_speed_put_right(record, nominal) -> None:
    """The speed stated is 0.5 % too high, which the cam turns by 0.2 rad until the pulse comes."""
    cam_rate = 1500.0 * RPM / 25.625
    pulse = np.array([(-1.3 / cam_rate) % 8.2])
    assert pulse[0] > 6.0
    wrong = record(pulses=pulse, start_angle=None, motor_speed=1507.5 * RPM)
    found = experiments([wrong], nominal, Sensor()).fitted[0]
    assert found.operating_point.start_angle == pytest.approx(1.3, abs=0.02)
    assert 0.002 < found.start_uncertainty < 0.05


def test_a_stated_start_angle_goes_before_the_pulse(record, nominal) -> None:
    """The pulse stands where the cam leaves station 3, which nobody said."""
    cam_rate = 1500.0 * RPM / 25.625
    first = ((3.0 * 2.0 * math.pi - 1.3) / cam_rate) % 8.2
    one = record(pulses=np.array([first, first + 8.2]))
    assert experiments([one], nominal, Sensor()).fitted[0].operating_point.start_angle == 1.3
    said = refusal([record(pulses=np.array([first, first + 8.2]), pulse_angle=0.0)], nominal)
    assert "must be one within 0.5 rad" in said and "leave one out" in said
    alone = refusal([record(pulses=np.array([first + 0.5, first + 8.7]), start_angle=None)], nominal)
    # the cam turns by 175.6° in 0.5 s
    assert "by the pulse, whose angle is taken for 0.0°," in alone and "pulse_angle_deg, of which 17" in alone
    both = record(pulses=np.array([first, first + 8.2]), pulse_angle=6.0 * math.pi)
    assert experiments([both], nominal, Sensor()).fitted[0].operating_point.start_angle == 1.3


def test_a_known_filter_does_not_shift_the_start_that_is_found(record, nominal, values) -> None:
    sensor = Sensor(lowpass_hz=20.0, lowpass_order=2)
    late = sensor.read(values, 1000.0).values
    found = experiments([record(late, start_angle=None)], nominal, sensor)
    assert found.fitted[0].operating_point.start_angle == pytest.approx(1.3, abs=0.01)
    assert any("low-pass filter may have taken a part" in note for note in found.notes)
    unknown = experiments([record(late, start_angle=None)], nominal, Sensor())
    assert unknown.fitted[0].operating_point.start_angle < 1.25


@pytest.mark.parametrize(
    ("sensor", "said"),
    [(Sensor(lowpass_hz=6.0, lowpass_order=1), "late, as behind a slow"), (Sensor(highpass_hz=0.4), "AC-coupled")],
)
def test_a_sensor_that_shifts_the_motion_is_guessed_by_the_direction(record, nominal, values, sensor, said) -> None:
    notes = experiments([record(sensor.read(values, 1000.0).values)], nominal, Sensor()).notes
    assert any("rad from that of the nominal machine's motion" in note and said in note for note in notes)


def test_several_records_without_start_angles_have_no_station_in_common(record, nominal) -> None:
    said = "not known to begin at the same station"
    compared = record(start_angle=None)
    for given, noted in (([record(), record()], False), ([record(), compared], True), ([compared], False)):
        assert any(said in note for note in experiments(given, nominal, Sensor()).notes) == noted


@pytest.mark.parametrize(("ratio", "turns", "noted"), [(25.625, 0, False), (25.3, 0, True), (25.3, 1, False)])
def test_a_motor_that_stands_otherwise_after_a_turn_is_noted(record, nominal, ratio: float, turns: int, noted) -> None:
    """205 or 202.4 turns of the motor in one of the table; the second record is told to begin so many turns later."""
    machine, speed = dataclasses.replace(nominal, reduction_ratio=ratio), 1500.0 * RPM * ratio / 25.625
    given = [record(motor_speed=speed, start_angle=1.3 + 16.0 * math.pi * later) for later in (0, turns)]
    notes = experiments(given, machine, Sensor()).notes
    assert any("202.4 times in a turn of the table" in note for note in notes) == noted


def test_a_machine_that_cannot_run_is_refused(record) -> None:
    nominal = load_machine("reference")
    stiff = dataclasses.replace(nominal.output_joint, stiffness=1e14)
    with pytest.raises(ParameterError, match=r"must run at the conditions of run\.csv, but .*; correct its parameters"):
        experiments([record()], dataclasses.replace(nominal, output_joint=stiff), Sensor())


def test_a_part_with_too_few_cam_turns_is_refused(record, nominal, values) -> None:
    short = record(values[:4000], held_out=True)
    short = dataclasses.replace(short, name="held.csv")
    said = refusal([record(), short], nominal)
    assert "The records held out must hold 4 whole cam turns or more in all" in said and "got 3 in held.csv" in said
    assert "record 0.7 turns or more of this table of 8 stations" in said
    said = refusal([record(values[:7200])], nominal)
    assert "4 whole cam turns or more to fit and as many to hold out" in said and "got 4 and 2 in run.csv" in said
    assert "record 1.3 turns or more of this table of 8 stations" in said
    assert len(experiments([record(values[:10700])], nominal, Sensor()).fitted) == 1
    said = refusal([record(), record(values[:1350]), record(held_out=True)], nominal)
    assert "run.csv must hold a whole cam turn, from dwell to dwell, in the part fitted" in said


def test_the_direction_in_which_the_table_turns_need_not_be_known(record, nominal, values) -> None:
    found, stated = (experiments([record(y)], nominal, Sensor()) for y in (-values, values))
    assert (found.fitted[0].signal.values == stated.fitted[0].signal.values).all()
    assert found.fitted[0].operating_point == stated.fitted[0].operating_point
    assert any("turns the other way" in note for note in found.notes)
    assert not any("turns the other way" in note for note in stated.notes)


@pytest.mark.parametrize("drift", [0.0, 0.5])
def test_a_constant_offset_is_taken_out_and_a_drift_is_left(record, nominal, values, drift: float) -> None:
    time = np.arange(len(values)) / 1000.0
    found = experiments([record(values + 0.25 + drift * time)], nominal, Sensor())
    assert any("the sensor reads 0.249 rad/s^2 at rest" in note for note in found.notes)
    left = found.fitted[0].signal.values - (values + drift * time)[: len(found.fitted[0].signal.values)]
    assert np.abs(left).max() < 0.03
    known = experiments([record(values + 0.25)], nominal, Sensor(offset=0.25))
    assert not any("at rest" in note for note in known.notes)
    np.testing.assert_array_equal(known.fitted[0].signal.values, (values + 0.25)[: len(known.fitted[0].signal.values)])


def test_a_speed_that_drifts_is_no_offset(record, nominal, values) -> None:
    """1.2 % over a record that begins in the motion, where the table's rate is no longer the same a cam turn later."""
    time = np.arange(len(values)) / 1000.0
    warped = time * (1.0 + 0.006 * time / time[-1])
    faster = np.interp(warped, time, values) * np.gradient(warped, time) ** 2
    found = experiments([record(faster)], nominal, Sensor())
    assert not any("at rest" in note for note in found.notes)


def test_rates_that_differ_by_their_clocks_are_thinned_alike(record, nominal, values) -> None:
    """1999.99 and 2000.01 Hz lie on either side of twice the rate of the search."""
    fast = np.interp(np.arange(2 * len(values)) / 2000.0, np.arange(len(values)) / 1000.0, values)
    made = [dataclasses.replace(record(), signal=Signal(fast, rate)) for rate in (1999.99, 2000.01)]
    found = experiments(made, nominal, Sensor())
    rates = [part.signal.sample_rate for part in (*found.fitted, *found.held_out)]
    assert max(rates) / min(rates) - 1.0 < 2e-5
    assert len({part.noise_level for part in (*found.fitted, *found.held_out)}) == 1
    IndexerModel(nominal, found.fitted)


def test_the_start_angle_is_found_where_the_speed_drifts(record, nominal, values) -> None:
    """By 2 % over 17 cam turns: a straight line through the angles of the turns would begin 0.18 rad off."""
    time = np.arange(len(values)) / 1000.0
    slower = np.interp(time * (1.0 + 0.02 * (time / time[-1] - 1.0)), time, values)
    found = experiments([record(slower, start_angle=None)], nominal, Sensor())
    assert found.fitted[0].operating_point.start_angle == pytest.approx(1.3, abs=0.04)


def test_a_record_shorter_than_a_cam_turn_is_told_so(record, nominal, values) -> None:
    said = refusal([record(), record(values[:400])], nominal)
    assert "must hold a whole cam turn, 1.02 s at the speed stated, got 0.4 s" in said
