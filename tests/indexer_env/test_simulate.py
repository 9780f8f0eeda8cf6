"""One machine: what a run may ask for, what a record holds, and how the transient is left behind."""

import dataclasses
import math
import os
import pickle
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from indexer_env.errors import IndexerError, ParameterError, SimulationError
from indexer_env.operating_point import OperatingPoint
from indexer_env.simulate import Run, simulate, simulate_batch
from indexer_env.trajectory import CHANNELS
from tests.patience import PATIENCE

ALL = tuple(CHANNELS)


# -------------------------------------------------------------------------------- what a run refuses


@pytest.mark.parametrize("name", ["sample_rate", "step", "warmup_tolerance"])
@pytest.mark.parametrize("value", [0.0, -1.0, math.nan, math.inf, True, "1"])
def test_a_run_refuses_wrong_numbers(name, value):
    with pytest.raises(ParameterError, match=rf"^Run\.{name} must be a finite number > 0") as caught:
        Run(**{name: value})
    assert f"got {value!r}" in str(caught.value)


@pytest.mark.parametrize(("name", "low"), [("samples", 1), ("warmup_turns", 0)])
@pytest.mark.parametrize("value", [-1, 2.0, True, "5", math.nan])
def test_a_run_refuses_what_is_not_a_count(name, low, value):
    with pytest.raises(ParameterError, match=rf"^Run\.{name} must be a whole number >= {low}"):
        Run(**{name: value})


@pytest.mark.parametrize("channels", [("table_accelaration",), ("cam_angle", "table_acceleratio")])
def test_an_unknown_channel_gets_a_hint(channels):
    with pytest.raises(ParameterError) as caught:
        Run(channels=channels)
    assert str(caught.value).startswith("Run.channels must be one of cam_angle, ")
    assert str(caught.value).endswith("did you mean 'table_acceleration'.")


@pytest.mark.parametrize("channels", [None, 5, (), "cam_angle"])
def test_channels_are_a_tuple_of_at_least_one_name(channels):
    with pytest.raises(ParameterError, match=r"^Run\.channels must be "):
        Run(channels=channels)


def test_a_run_is_frozen_and_picklable():
    run = Run(samples=10, channels=("cam_angle",))
    with pytest.raises(dataclasses.FrozenInstanceError):
        run.samples = 11
    assert pickle.loads(pickle.dumps(run)) == run and hash(run) == hash(dataclasses.replace(run))


# -------------------------------------------------------------------------------- what a record holds


def test_a_record_is_one_table_turn_unless_asked_otherwise(smooth):
    assert simulate(smooth).table_acceleration.shape == (8200,)
    slow = OperatingPoint(motor_speed=OperatingPoint().motor_speed / 2.0)
    assert simulate(smooth, slow, Run(warmup_turns=0)).table_acceleration.shape == (16400,)
    assert simulate(smooth, run=Run(sample_rate=500.0, warmup_turns=0)).table_acceleration.shape == (4100,)
    assert simulate(smooth, run=Run(samples=1, warmup_turns=0)).table_acceleration.shape == (1,)


def test_every_channel_is_there_alone_as_with_the_others(reference):
    run = Run(samples=60, warmup_turns=0)
    together = simulate(reference, run=dataclasses.replace(run, channels=ALL))
    assert tuple(together.channels) == ALL
    for name in ALL:
        alone = simulate(reference, run=dataclasses.replace(run, channels=(name,)))
        assert list(alone.channels) == [name]
        assert alone.channels[name].dtype == np.float64 and alone.channels[name].shape == (60,)
        assert alone.channels[name].tobytes() == together.channels[name].tobytes()


@pytest.mark.parametrize("sample_rate", [250.0, 1000.0, 1600.0, 4000.0])
def test_time_goes_by_the_sample_rate(smooth, sample_rate):
    trajectory = simulate(
        smooth, run=Run(sample_rate=sample_rate, samples=50, warmup_turns=0, channels=("motor_angle",))
    )
    assert trajectory.sample_rate == sample_rate
    np.testing.assert_allclose(trajectory.time, np.arange(50) / sample_rate, rtol=1e-15)
    expected = OperatingPoint().motor_speed * trajectory.time
    np.testing.assert_allclose(trajectory.channels["motor_angle"], expected, rtol=1e-12, atol=1e-12)


def test_the_record_does_not_depend_on_how_finely_it_is_sampled(smooth):
    """Equal steps, so that every fourth sample is the same number."""
    fine = simulate(smooth, run=Run(sample_rate=4000.0, samples=800, warmup_turns=0, step=0.25e-3)).table_acceleration
    coarse = simulate(smooth, run=Run(sample_rate=1000.0, samples=200, warmup_turns=0, step=0.25e-3)).table_acceleration
    np.testing.assert_allclose(fine[::4], coarse, rtol=0, atol=1e-12)


@pytest.mark.parametrize("model", ["A", "B", "B_on_base"])
def test_rates_and_accelerations_are_derivatives(smooth, visible, model):
    base = dataclasses.replace(smooth.base_joint, stiffness=1e6, damping=500.0)
    machine = dataclasses.replace(smooth, model=model, base_joint=base)
    machine = machine.with_effects(visible("drive.speed_ripple"), visible("friction.viscous"))
    run = Run(sample_rate=4000.0, samples=2000, warmup_turns=0, channels=ALL)
    channels = simulate(machine, run=run).channels
    pairs = [
        *((f"{part}_angle", f"{part}_rate") for part in ("cam", "table", "housing", "motor")),
        *((f"{part}_rate", f"{part}_acceleration") for part in ("table", "housing", "motor")),
        *((f"deflection_{n}", f"deflection_rate_{n}") for n in (1, 2, 3)),
        *([] if model == "A" else [("cam_rate", "cam_acceleration")]),
    ]
    for value, rate in pairs:
        slope = (channels[value][2:] - channels[value][:-2]) * 2000.0
        scale = max(np.abs(channels[rate]).max(), 1e-12)
        np.testing.assert_allclose(slope, channels[rate][1:-1], rtol=0, atol=0.02 * scale, err_msg=rate)


@pytest.mark.parametrize("start", [0.0, 1.0, 4.0, -2.5, 2.0 * math.pi * 9.1])
def test_a_run_starts_at_rest_on_the_law(smooth, start):
    point = OperatingPoint(start_angle=start)
    channels = simulate(smooth, point, Run(samples=1, warmup_turns=0, channels=ALL)).channels
    first = {name: float(values[0]) for name, values in channels.items()}
    rate = point.motor_speed / 25.625
    beta, slope, _ = smooth.motion_law.evaluate(start, 8, 0.5)
    assert first["cam_angle"] == start and first["cam_rate"] == pytest.approx(rate, rel=1e-14)
    assert first["motor_angle"] == pytest.approx(start * 25.625) and first["motor_rate"] == point.motor_speed
    assert first["table_angle"] == pytest.approx(float(beta), abs=1e-9)
    assert first["table_rate"] == pytest.approx(float(slope) * rate, abs=1e-6)
    assert abs(first["deflection_1"]) < 1e-12 and abs(first["deflection_2"]) < 1e-12
    assert first["table_acceleration"] == pytest.approx(-2.0 / 5.0, rel=1e-9)


def test_a_start_a_table_turn_later_is_the_same_motion(smooth):
    run = Run(samples=500, warmup_turns=0)
    here, later = (
        simulate(smooth, OperatingPoint(start_angle=angle), run).table_acceleration
        for angle in (0.7, 0.7 + 16.0 * math.pi)
    )
    np.testing.assert_allclose(later, here, rtol=0, atol=1e-8)


@pytest.mark.parametrize("motor_speed", [50.0 * math.pi, 157.123, 211.0])
@pytest.mark.parametrize("start", [0.0, 1.3])
def test_a_record_begins_at_the_start_angle_of_a_table_turn(smooth, motor_speed, start):
    """Also where a turn is no whole number of steps."""
    point, run = OperatingPoint(motor_speed=motor_speed, start_angle=start), Run(channels=("motor_angle",))
    trajectory = simulate(smooth, point, run)
    assert trajectory.warmup is not None and trajectory.warmup.settled
    turns = (trajectory.channels["motor_angle"][0] / 25.625 - start) / (16.0 * math.pi)
    assert turns == pytest.approx(trajectory.warmup.turns, abs=1e-12)


def test_a_longer_record_goes_on_where_a_shorter_one_ends(smooth, reference):
    for machine in (smooth, reference):
        short, turn, long = (
            simulate(machine, run=Run(samples=samples)).table_acceleration for samples in (3000, 8200, 12000)
        )
        assert short.tobytes() == turn[:3000].tobytes()
        assert turn.tobytes() == long[:8200].tobytes()
        np.testing.assert_allclose(long[8200:], long[:3800], rtol=0, atol=1e-4)


# -------------------------------------------------------------------------------- warm-up


def test_the_smooth_machine_settles_in_one_turn(smooth):
    trajectory = simulate(smooth)
    assert trajectory.warmup is not None
    assert (trajectory.warmup.turns, trajectory.warmup.settled) == (1, True)
    assert trajectory.warmup.difference <= 1e-6


@pytest.mark.parametrize("name", ["smooth", "reference"])
def test_a_settled_record_does_not_change_with_more_warm_up(request, name):
    machine = request.getfixturevalue(name)
    settled = simulate(machine)
    assert settled.warmup is not None and settled.warmup.settled
    three_more = Run(warmup_turns=settled.warmup.turns + 3, warmup_tolerance=1e-300)
    later = simulate(machine, run=three_more)
    assert later.warmup is not None
    assert (later.warmup.turns, later.warmup.settled) == (settled.warmup.turns + 3, False)
    change = np.sqrt(np.mean((later.table_acceleration - settled.table_acceleration) ** 2))
    assert change < 1e-6 * np.sqrt(np.mean(settled.table_acceleration**2))


def test_without_warm_up_the_start_is_in_the_record(smooth):
    raw = simulate(smooth, run=Run(warmup_turns=0))
    assert raw.warmup is not None
    assert (raw.warmup.turns, raw.warmup.settled) == (0, False) and math.isnan(raw.warmup.difference)
    assert np.abs(raw.table_acceleration - simulate(smooth).table_acceleration)[:500].max() > 0.1


def test_light_damping_takes_more_turns(smooth):
    joint = dataclasses.replace(smooth.output_joint, damping=0.02 * smooth.output_joint.damping)
    machine = dataclasses.replace(smooth, output_joint=joint)
    few, many = (simulate(machine, run=Run(warmup_turns=turns)).warmup for turns in (2, 60))
    assert few is not None and many is not None
    assert not few.settled and many.settled and many.turns > 2


@pytest.mark.parametrize("samples", [None, 2000, 12000, 16400])
def test_big_play_never_settles_and_the_bound_holds(reference, visible, samples):
    machine = reference.with_effects(visible("input.backlash", backlash=0.0136), visible("output.backlash"))
    report = simulate(machine, run=Run(samples=samples)).warmup
    assert report is not None
    assert report.turns == 2 and not report.settled and report.difference > 1e-3


def test_a_coarse_sample_rate_is_no_proof_of_settling(reference, visible):
    """Fewer samples in a turn than stations: there is nothing in its last cam turn to compare."""
    machine = reference.with_effects(visible("input.backlash", backlash=0.0136), visible("output.backlash"))
    report = simulate(machine, run=Run(sample_rate=0.5)).warmup
    assert report is not None and not report.settled


@pytest.mark.parametrize(("compliance", "load"), [(0.5, 2.0), (2.0, 100.0), (10.0, 400.0)])
def test_a_slipping_machine_settles_too_and_starts_at_the_start_angle(smooth, visible, compliance, load):
    machine = smooth.with_effects(visible("drive.slip", compliance=compliance))
    run = Run(warmup_turns=20, channels=("table_acceleration", "cam_angle"))
    trajectory = simulate(machine, OperatingPoint(load_torque=load), run)
    assert trajectory.warmup is not None and trajectory.warmup.settled
    begins = trajectory.channels["cam_angle"][0]
    assert begins == pytest.approx(16.0 * math.pi * trajectory.warmup.turns, abs=1e-5)


def test_the_bound_on_warm_up_turns_holds_for_a_slipping_machine(smooth, visible):
    report = simulate(smooth.with_effects(visible("drive.slip")), OperatingPoint(load_torque=400.0), Run()).warmup
    assert report is not None and report.turns <= Run().warmup_turns


# -------------------------------------------------------------------------------- out of range


@pytest.mark.parametrize("load", [1e4, 1e6, 1e12, 1e100, 1e300])
@pytest.mark.parametrize("sample_rate", [1000.0, 20.0])
def test_a_run_that_leaves_the_physical_range_names_machine_time_and_state(smooth, load, sample_rate):
    machine, point = dataclasses.replace(smooth, name="doomed"), OperatingPoint(load_torque=load, start_angle=1.0)
    with pytest.raises(SimulationError) as caught:
        simulate(machine, point, Run(samples=50, sample_rate=sample_rate, warmup_turns=0))
    text = str(caught.value)
    assert isinstance(caught.value, IndexerError)
    found = re.match(
        r"doomed .*(deflected a joint beyond 0\.5 rad|became non-finite) at t = (\S+) s "
        r"\(cam_angle \S+, cam_rate \S+, table_angle \S+, table_rate ", text,
    )  # fmt: skip
    assert found is not None, text
    assert text.endswith(").") and "\n" not in text
    assert 0.0 < float(found[2]) <= 0.3


STALL = """
import resource, sys
resource.setrlimit(resource.RLIMIT_AS, (16 << 30, 16 << 30))
from indexer_env.effects import make_effect
from indexer_env.operating_point import OperatingPoint
from indexer_env.presets import load_machine
from indexer_env.simulate import simulate_batch
smooth = load_machine("smooth")
stalling = smooth.with_effects(make_effect("drive.slip", compliance=float(sys.argv[1])))
batch = simulate_batch([stalling, smooth], OperatingPoint(load_torque=400.0))
print(sorted(batch.rejected), batch.rejected.get(0, ""))
"""


@pytest.mark.parametrize("compliance", [30.0, 100.0])
def test_a_stalling_motor_is_rejected(compliance, simulator):
    """Its load takes more speed than it has: the table turn that warm-up waits for never ends. In a process of its own,
    whose time and memory are limited."""
    root = Path(__file__).parents[2]
    child = subprocess.run(
        [sys.executable, "-c", STALL, str(compliance)], capture_output=True, text=True, check=False, timeout=PATIENCE,
        env=os.environ | {"PYTHONPATH": str(root)},
    )  # fmt: skip
    assert child.returncode == 0, child.stderr
    assert child.stdout.startswith("[0] smooth (item 0) "), child.stdout


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("reference",), r"^simulate\.machine must be of the class Machine, got 'reference'; load_machine gives"),
        (("machine", Run(samples=100)), r"^simulate\.operating_point must be of the class OperatingPoint, got Run"),
        (
            ("machine", OperatingPoint(), {"samples": 1}),
            r"^simulate\.run must be of the class Run, got \{",
        ),
    ],
    ids=lambda value: "" if isinstance(value, str) else repr(value)[:20],
)
def test_what_is_of_another_class_is_refused(arguments, said, reference):
    with pytest.raises(ParameterError, match=said):
        simulate(*(reference if each == "machine" else each for each in arguments))


def test_a_batch_of_no_sequence_is_refused(reference):
    with pytest.raises(ParameterError, match=r"^simulate_batch\.machines must be a sequence of Machine, got "):
        simulate_batch(reference)
    with pytest.raises(ParameterError, match=r"^simulate_batch\.machine must be of the class Machine, got 'reference'"):
        simulate_batch([reference, "reference"])


def test_a_channel_that_was_not_recorded_is_refused(reference):
    found = simulate(reference, run=Run(channels=("cam_angle",), samples=10, warmup_turns=0))
    with pytest.raises(ParameterError, match=r"^Run\.channels must be a tuple that holds table_acceleration "):
        _ = found.table_acceleration


def test_numbers_of_numpy_are_pythons_numbers(reference):
    """What is worked out from a float32 would be one, too, and no warm-up would settle."""
    point = OperatingPoint(motor_speed=np.float32(157.0), load_torque=np.float64(2.0), start_angle=np.int64(0))
    assert [type(value) for value in dataclasses.astuple(point)] == [float, float, int]
    ratio = np.float32(25.625)
    machine = dataclasses.replace(reference, reduction_ratio=ratio, stations=np.int64(8))
    joint = dataclasses.replace(reference.input_joint, stiffness=np.float32(8000.0))
    assert type(machine.turn_duration(point)) is type(joint.stiffness) is float and type(machine.stations) is int
    assert machine.turn_duration(point) == dataclasses.replace(reference, reduction_ratio=25.625).turn_duration(point)
    assert type(Run(sample_rate=np.float32(1000.0), samples=np.int64(5)).samples) is int
