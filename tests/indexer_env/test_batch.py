"""A batch: an item's numbers are its own, whatever runs beside it; one that cannot be run takes no other with it."""

import dataclasses
import importlib
import threading
import time

import numpy as np
import pytest

from indexer_env import engine
from indexer_env.coefficients import coefficients
from indexer_env.effects import EFFECTS, MachineEffect
from indexer_env.errors import ParameterError, SimulationError
from indexer_env.kernels.layout import USES_SLIP
from indexer_env.machine import CONTACT_LAWS, Joint, Machine
from indexer_env.motion_law import Cycloidal, ModifiedTrapezoid, Polynomial345
from indexer_env.operating_point import OperatingPoint
from indexer_env.simulate import Run, _groups, simulate, simulate_batch
from indexer_env.turns import LEAST_COMPARED, OnCores

RUN = Run(samples=260, warmup_turns=1, channels=("table_acceleration", "torque_1", "region_2"))


@pytest.fixture(scope="module")
def mixed(smooth, reference, visible) -> tuple[list[Machine], list[OperatingPoint]]:
    """70 machines of all models, laws, shapes and effects: more than two blocks of lanes, in many groups."""
    base = Joint(stiffness=1e6, damping=800.0, backlash=1e-4)
    random = np.random.default_rng(5)
    machines = [smooth.with_effects(visible(name)) for name, kind in EFFECTS.items() if issubclass(kind, MachineEffect)]
    laws = (Cycloidal(), ModifiedTrapezoid(), Polynomial345(), smooth.motion_law)
    while len(machines) < 70:
        n = len(machines)
        output = dataclasses.replace(
            smooth.output_joint,
            stiffness=smooth.output_joint.stiffness * random.uniform(0.9, 1.1),
            backlash=(0.0, 1e-3)[n % 2],
            stiffness_ratio=(1.0, 0.6)[n // 2 % 2],
        )
        machines.append(
            dataclasses.replace(
                (smooth, reference)[n % 2],
                model=("B", "B", "A", "B_on_base")[n % 4],
                base_joint=base,
                output_joint=output,
                contact_law=CONTACT_LAWS[n % 3],
                motion_law=laws[n % 4],
                motion_share=(0.5, 0.35)[n % 2],
                name=f"machine {n}",
            )
        )
    points = [
        OperatingPoint(motor_speed=(157.0, 300.0, 80.0)[n % 3], load_torque=float(n % 5), start_angle=0.1 * n)
        for n in range(len(machines))
    ]
    return machines, points


@pytest.fixture(scope="module")
def together(mixed):
    batch = simulate_batch(*mixed, RUN)
    assert batch.rejected == {}
    return batch


def same(one, other, rows: dict[int, int]) -> None:
    """Bit-equal items: row of `one` → row of `other`."""
    for mine, theirs in rows.items():
        for name in RUN.channels:
            assert one.channels[name][mine].tobytes() == other.channels[name][theirs].tobytes(), (mine, name)
        assert one.settled[mine] == other.settled[theirs]
        assert one.warmup_turns[mine] == other.warmup_turns[theirs]
        assert one.warmup_difference[mine].tobytes() == other.warmup_difference[theirs].tobytes()


def test_an_item_alone_is_the_item_in_the_batch(mixed, together):
    for n, (machine, point) in enumerate(zip(*mixed, strict=True)):
        same(simulate_batch([machine], [point], RUN), together, {0: n})


def test_simulate_is_a_batch_of_one(mixed, together):
    machines, points = mixed
    for n in (0, 33, 69):
        trajectory = simulate(machines[n], points[n], RUN)
        assert trajectory.table_acceleration.tobytes() == together.table_acceleration[n].tobytes()
        assert trajectory.warmup is not None
        assert trajectory.warmup.turns == together.warmup_turns[n]
        assert trajectory.warmup.settled == together.settled[n]


@pytest.mark.parametrize("threads", [1, 2, 5])
def test_the_number_of_threads_does_not_matter(mixed, together, threads):
    same(simulate_batch(*mixed, RUN, threads=threads), together, {n: n for n in range(70)})


def test_a_sink_gets_every_sound_item_once_and_the_batch_keeps_none(mixed, together):
    machines, points = list(mixed[0]), list(mixed[1])
    points[40] = OperatingPoint(load_torque=1e7, start_angle=1.0)  # deflects a joint too far
    taken: dict[int, dict[str, np.ndarray]] = {}

    def sink(items, channels):
        assert all(len(values) == len(items) for values in channels.values())
        for row, item in enumerate(items):
            assert item not in taken
            taken[int(item)] = {name: values[row] for name, values in channels.items()}

    batch = simulate_batch(machines, points, RUN, sink=sink)
    assert batch.channels == {} and len(batch) == 70 and list(batch.rejected) == [40]
    assert set(taken) == set(range(70)) - {40}
    for item, channels in taken.items():
        assert tuple(channels) == RUN.channels
        for name, values in channels.items():
            assert values.tobytes() == together.channels[name][item].tobytes()


def test_what_a_sink_raises_ends_the_run(smooth):
    def sink(items, channels):
        raise OSError("the disk is full")

    with pytest.raises(OSError, match="the disk is full"):
        simulate_batch([smooth] * 40, run=Run(samples=5, warmup_turns=0), sink=sink)


def test_threads_share_equal_items(smooth):
    """Many blocks of one group, which is where threads divide the work."""
    joints = [
        dataclasses.replace(smooth.output_joint, stiffness=smooth.output_joint.stiffness * (1.0 + 1e-3 * n))
        for n in range(300)
    ]
    machines = [dataclasses.replace(smooth, output_joint=joint) for joint in joints]
    run = Run(samples=40, warmup_turns=0)
    one, two = (simulate_batch(machines, run=run, threads=threads).table_acceleration for threads in (1, 2))
    assert one.tobytes() == two.tobytes()
    assert len({row.tobytes() for row in one}) == 300


def test_the_order_of_items_does_not_matter(mixed, together):
    machines, points = mixed
    order = np.random.default_rng(3).permutation(70)
    shuffled = simulate_batch([machines[n] for n in order], [points[n] for n in order], RUN)
    same(shuffled, together, {row: int(n) for row, n in enumerate(order)})


def test_records_beyond_some_turns_and_not_others(smooth, reference):
    """Turns of 8.2, 4.1 and 8.1996 s; 5000 and 8200 samples are longer than some turns and shorter than others."""
    speeds = (50.0 * np.pi, 100.0 * np.pi, 50.0 * np.pi * 1.00005)
    machines = [smooth, smooth, smooth, reference, reference, reference]
    points = [OperatingPoint(motor_speed=float(speed)) for speed in (*speeds, *speeds)]
    for samples in (5000, 8200):
        run = Run(samples=samples)
        batch = simulate_batch(machines, points, run)
        assert batch.table_acceleration.shape == (6, samples) and np.isfinite(batch.table_acceleration).all()
        for n, (machine, point) in enumerate(zip(machines, points, strict=True)):
            alone = simulate_batch([machine], [point], run)
            assert alone.table_acceleration[0].tobytes() == batch.table_acceleration[n].tobytes()
            assert alone.warmup_turns[0] == batch.warmup_turns[n] and alone.settled[0] == batch.settled[n]
            assert alone.warmup_difference[0] == batch.warmup_difference[n]


def test_a_slipping_machine_starts_where_it_does_alone(smooth, visible):
    """Each takes its own number of runs to the end of its turn, whatever the others still need."""
    slips = ((0.05, 2.0), (0.5, 2.0), (2.0, 100.0), (5.0, 50.0), (10.0, 400.0), (8.0, 200.0), (0.3, 10.0))
    machines = [smooth.with_effects(visible("drive.slip", compliance=compliance)) for compliance, _ in slips]
    points = [OperatingPoint(load_torque=load) for _, load in slips]
    together = simulate_batch(machines, points, RUN)
    for n, (machine, point) in enumerate(zip(machines, points, strict=True)):
        same(simulate_batch([machine], [point], RUN), together, {0: n})


@pytest.mark.parametrize("part", [1, 33])
def test_items_prepared_in_parts_are_those_prepared_at_once(mixed, together, monkeypatch, part):
    """And no more coefficients are at hand at once than a part has."""
    at_hand = []

    def counted(items, steps, share):
        at_hand.append(len(items))
        return _groups(items, steps, share)

    module = importlib.import_module("indexer_env.simulate")
    monkeypatch.setattr(module, "_PART", part)
    monkeypatch.setattr(module, "_groups", counted)
    same(simulate_batch(*mixed, RUN), together, {n: n for n in range(70)})
    assert max(at_hand) == part and sum(at_hand) == 70


def test_two_turns_differ_alike_whatever_is_compared_beside_them():
    """Windows of several lengths and places; shorter than a cam turn, or a cam turn of few samples, is not compared."""
    random = np.random.default_rng(11)
    previous, present = random.normal(size=(2, 7, 900))
    lengths, cam_turn = np.array([900, 900, 850, 700, 900, 90, 900]), np.array([100, 100, 100, 87, 311, 100, 15])
    differences = OnCores().differences
    together = differences(previous, present, lengths, cam_turn, LEAST_COMPARED)
    assert np.isnan(together[5:]).all() and np.isfinite(together[:5]).all()
    for n in range(5):
        chosen = [n]
        alone = differences(
            previous[chosen, : lengths[n]], present[chosen], lengths[chosen], cam_turn[chosen], LEAST_COMPARED
        )
        assert alone.tobytes() == together[chosen].tobytes()
        window = slice(lengths[n] - cam_turn[n], lengths[n])
        change = np.linalg.norm(present[n, window] - previous[n, window])
        assert together[n] == pytest.approx(change / np.linalg.norm(present[n, window]), rel=1e-13)


def test_lanes_stay_full_however_many_sets_of_effects_there_are(mixed):
    """Items of one model and step run together with the effects of all of them; motors that slip and linear dwells
    stay among themselves."""
    items = {n: coefficients(machine, point) for n, (machine, point) in enumerate(zip(*mixed, strict=True))}
    groups = list(_groups(items, dict.fromkeys(items, 2), len(items)))
    assert sorted(n for group in groups for n, _ in group) == sorted(items)
    kinds = [{(item.model, item.features & USES_SLIP, item["linear_dwell"]) for _, item in group} for group in groups]
    assert all(len(kind) == 1 for kind in kinds)
    assert len(groups) == len(set.union(*kinds)) < len({item.features for item in items.values()})
    apart = list(_groups(items, {n: 2 + n % 2 for n in items}, len(items)))
    assert all(len({n % 2 for n, _ in group}) == 1 for group in apart)


# -------------------------------------------------------------------------------- rejected items


def test_a_rejected_item_takes_no_other_with_it(mixed, together):
    machines, points = mixed
    doomed = dataclasses.replace(machines[40], name="doomed")
    hit = OperatingPoint(load_torque=1e7, start_angle=1.0)
    batch = simulate_batch([*machines[:40], doomed, *machines[40:]], [*points[:40], hit, *points[40:]], RUN)
    assert list(batch.rejected) == [40]
    assert batch.rejected[40].startswith("doomed (item 40) deflected a joint beyond 0.5 rad at t = ")
    assert "(cam_angle " in batch.rejected[40]
    for values in batch.channels.values():
        assert np.isnan(values[40]).all()
    same(batch, together, {n if n < 40 else n + 1: n for n in range(70)})


def test_items_that_cannot_be_built_are_rejected_too(smooth, visible):
    stationless = smooth.with_effects(visible("cam.station_spacing", station=9))
    stiff = dataclasses.replace(smooth, output_joint=dataclasses.replace(smooth.output_joint, stiffness=1e9))
    run = Run(samples=50, warmup_turns=0)
    batch = simulate_batch([stationless, smooth, stiff], run=run)
    assert list(batch.rejected) == [0, 2]
    for index, machine in ((0, stationless), (2, stiff)):
        with pytest.raises(ParameterError) as caught:
            simulate(machine, run=run)
        assert batch.rejected[index] == str(caught.value)
        assert np.isnan(batch.table_acceleration[index]).all()
    assert batch.table_acceleration[1].tobytes() == simulate(smooth, run=run).table_acceleration.tobytes()


def test_an_item_that_fails_in_the_warm_up_or_late_in_the_record_is_rejected(smooth, visible):
    """The process torque comes in the dwell: after 0.7 s."""
    late = dataclasses.replace(smooth, name="late").with_effects(visible("load.process", torque=1e6))
    for run in (Run(samples=100, warmup_turns=1), Run(samples=1000, warmup_turns=0), Run(samples=9000, warmup_turns=0)):
        batch = simulate_batch([smooth, late], run=run)
        assert list(batch.rejected) == [1]
        when = float(batch.rejected[1].split(" t = ")[1].split(" ")[0])
        assert 0.6 < when < 0.9
        assert np.isnan(batch.table_acceleration[1]).all() and np.isfinite(batch.table_acceleration[0]).all()
        with pytest.raises(SimulationError, match=r"^late "):
            simulate(late, run=run)


def test_all_items_rejected_is_still_a_batch(smooth):
    batch = simulate_batch([smooth, smooth], OperatingPoint(load_torque=1e8, start_angle=1.0), Run(samples=30))
    assert list(batch.rejected) == [0, 1] and np.isnan(batch.table_acceleration).all()
    assert not batch.settled.any()


# -------------------------------------------------------------------------------- what a batch is asked for


def test_an_empty_batch_is_empty():
    batch = simulate_batch([], run=Run(samples=10))
    assert len(batch) == 0 and batch.table_acceleration.shape[0] == 0 and batch.rejected == {}


def test_one_operating_point_serves_all(smooth, reference):
    point, run = OperatingPoint(load_torque=5.0), Run(samples=30, warmup_turns=0)
    one, each = simulate_batch([smooth, reference], point, run), simulate_batch([smooth, reference], [point] * 2, run)
    assert one.table_acceleration.tobytes() == each.table_acceleration.tobytes()
    default = simulate_batch([smooth], run=run)
    assert default.table_acceleration.tobytes() == simulate(smooth, run=run).table_acceleration.tobytes()


def test_points_and_machines_must_match_in_number(smooth):
    with pytest.raises(ParameterError) as caught:
        simulate_batch([smooth], [OperatingPoint()] * 2, RUN)
    assert str(caught.value) == (
        "simulate_batch needs one operating point per machine or one for all, got 2 for 1 machines."
    )


def test_records_of_unequal_length_must_be_asked_for_by_samples(smooth):
    points = [OperatingPoint(), OperatingPoint(motor_speed=314.159)]
    with pytest.raises(ParameterError) as caught:
        simulate_batch([smooth, smooth], points, Run())
    assert str(caught.value) == (
        "Run.samples must be given where turns differ in length, got turns of 4100 to 8200 samples."
    )
    assert simulate_batch([smooth, smooth], points, Run(samples=20, warmup_turns=0)).table_acceleration.shape == (2, 20)


@pytest.mark.parametrize("threads", [-1, 1.5, "2", True])
def test_threads_are_a_count(smooth, threads):
    with pytest.raises(ParameterError, match=r"threads must be a whole number >= 1"):
        simulate_batch([smooth] * 40, run=Run(samples=5, warmup_turns=0), threads=threads)


def test_another_machine_differs(together):
    """The anti-test: no two of the 70 records are the same."""
    assert len({row.tobytes() for row in together.table_acceleration}) == 70


def test_one_machine_given_many_times_is_as_many_equal_machines(smooth) -> None:
    """Its coefficients are made once for each operating point, never for a machine that only looks like it."""
    machine, point = smooth, OperatingPoint(motor_speed=100.0)
    other = dataclasses.replace(machine, table_inertia=1.2 * machine.table_inertia)
    faster = dataclasses.replace(point, motor_speed=130.0)
    run = Run(samples=400, warmup_turns=0)
    given = simulate_batch([machine, other, machine, machine], [point, point, faster, point], run)
    copies = [dataclasses.replace(each) for each in (machine, other, machine, machine)]
    copied = simulate_batch(copies, [dataclasses.replace(p) for p in (point, point, faster, point)], run)
    one, each = (batch.channels["table_acceleration"] for batch in (given, copied))
    np.testing.assert_array_equal(one, each)
    assert (one[0] == one[3]).all() and (one[0] != one[1]).any() and (one[0] != one[2]).any()


def test_a_run_that_is_broken_off_leaves_nobody_who_still_writes(monkeypatch):
    """Ctrl-C in the thread that waits; the others would write into what a reset has begun anew."""
    begun, ended, main = [], [], threading.get_ident()

    def kernel(first, last, *arguments):
        if threading.get_ident() == main:
            raise KeyboardInterrupt
        begun.append(first)
        time.sleep(0.05)
        ended.append(first)

    monkeypatch.setattr(engine, "_kernel", lambda: kernel)
    monkeypatch.setattr(engine, "cores", lambda: 2)
    count = 40 * engine._BLOCK
    steps = np.full(count, 10**6)
    with pytest.raises(KeyboardInterrupt):
        engine.run_kernel((None, None, np.zeros((count, 1)), None, None, steps))
    assert begun == ended and len(begun) < 4
    time.sleep(0.1)
    assert begun == ended
