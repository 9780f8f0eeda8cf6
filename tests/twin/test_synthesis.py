"""Analysis by synthesis: sizes found again, what no fault makes is left, and what a fit is worth."""

from __future__ import annotations

import dataclasses
import math
import threading

import numpy as np
import pytest

from indexer_env import OperatingPoint, Run, Sensor, make_effect, simulate
from indexer_env.units import RPM
from tests.twin.builders import CELLS, MACHINE, WEIGHTS, healthy, record, synthesis, view
from twin import refine as module
from twin import work as work_module
from twin.diagnosis import FAULTY, HEALTHY, UNKNOWN
from twin.faults import FAULTS
from twin.growth import growth_of
from twin.refine import Fits, fitted
from twin.synthesis import effect_of
from twin.teach import LEAST_FITTED
from twin.weigh import Weights, reaches, spread, weights_of
from twin.work import BAD, Work

POINT = OperatingPoint(1400.0 * RPM, 5.0)
NAMES = ("crack", "loose_base", "reducer_play")


def turn(sizes: dict[str, float], seed: int = 0, *more) -> np.ndarray:
    """x (1, stations, cells) of a machine with these faults, and noise."""
    machine = MACHINE.with_effects(
        *(effect_of(FAULTS[name], size, MACHINE, 0.0, 0) for name, size in sizes.items()), *more
    )
    signal, told = record(machine)
    (found,) = CELLS.turns(signal.values, MACHINE.reduction * told.motor_speed, 3.0)
    reference = healthy().turn(POINT)
    x = view().measured(found - reference, reference, POINT)
    return (x + np.random.default_rng(seed).standard_normal(x.shape))[None]


def told(logits: list[float], size: list[float]) -> dict[str, np.ndarray]:
    return {"faults": np.array([logits]), "size": np.array([size])}


def test_sizes_are_found_from_an_estimate_that_is_off_and_a_fault_that_is_not_there_comes_to_nothing():
    fits = fitted(synthesis(), turn({"crack": 0.4, "loose_base": 0.3}), [POINT], told([3.0, 2.0, 1.0], [0.5, 0.2, 0.2]))
    assert fits.size[0] == pytest.approx([0.4, 0.3, 0.0], abs=0.01)
    assert fits.left[0] < 3.0 and (fits.error[0] < 0.05).all()


def test_only_what_the_networks_think_possible_is_tried():
    fits = fitted(synthesis(), turn({"crack": 0.4}), [POINT], told([3.0, -9.0, -9.0], [0.5, 0.2, 0.2]))
    assert np.isfinite(fits.error[0]).tolist() == [True, False, False] and fits.size[0, 1] == 0.0


def test_all_subsets_are_started_from_as_there_are_several_minima(monkeypatch):
    x = turn({"reducer_play": 0.5})
    wrong = told([3.0, 2.0, 1.0], [0.9, 0.9, 0.4])
    whole = fitted(synthesis(), x, [POINT], wrong)
    assert whole.size[0] == pytest.approx([0.0, 0.0, 0.5], abs=0.02)
    monkeypatch.setattr(module, "_subsets", lambda count: [(1.0,) * count])
    assert fitted(synthesis(), x, [POINT], wrong).left[0] > 2.0 * whole.left[0]


def test_parts_are_fitted_side_by_side_and_keep_their_order(monkeypatch):
    both = threading.Barrier(2, timeout=120.0)  # broken where one part waits for the end of another

    def at_once(of, x, points, told):
        both.wait()
        return Fits(x[:, 0], x[:, 0], x[:, 0, 0], 10.0 + x[:, 0, 0])

    monkeypatch.setattr(module, "_fitted", at_once)
    monkeypatch.setattr(module, "TOGETHER", 1)
    advanced: list[int] = []
    found = fitted(synthesis(), np.arange(4.0)[:, None, None], [POINT] * 4, {}, advanced.append)
    assert found.left.tolist() == [0.0, 1.0, 2.0, 3.0] and advanced == [1, 1, 1, 1]


def test_a_weighing_that_was_stopped_fits_the_rest_alone(monkeypatch, tmp_path):
    fitted_turns: list[float] = []

    def one(of, x, points, told):
        if len(fitted_turns) == stop:
            raise KeyboardInterrupt
        fitted_turns.append(float(x[0, 0, 0]))
        return Fits(x[:, 0], x[:, 0], x[:, 0, 0], x[:, 0, 0])

    def run(logits, turns=5):
        x = np.arange(float(turns))[:, None, None]
        done = []
        found = fitted(
            synthesis(), x, [POINT] * turns, {"faults": logits},
            lambda more, earlier=False: done.append((more, earlier)), tmp_path / "fits",
        )  # fmt: skip
        return found.left.tolist(), done

    monkeypatch.setattr(module, "_fitted", one)
    monkeypatch.setattr(module, "TOGETHER", 2)
    monkeypatch.setattr(module, "_SIDE_BY_SIDE", 1)
    logits, stop = np.arange(10.0).reshape(5, 2), 2
    with pytest.raises(KeyboardInterrupt):
        run(logits)
    assert fitted_turns == [0.0, 2.0] and not list(tmp_path.rglob("*.part"))
    stop = -1
    assert run(logits + 1e-5) == ([0.0, 1.0, 2.0, 3.0, 4.0], [(4, True), (1, False)])
    assert fitted_turns == [0.0, 2.0, 4.0]
    # what other networks, or parts of another size, have left is none of it
    other = logits.copy()
    other[3] += 0.5
    run(other)
    assert fitted_turns == [0.0, 2.0, 4.0, 2.0]
    monkeypatch.setattr(module, "TOGETHER", 3)
    run(other)
    assert fitted_turns == [0.0, 2.0, 4.0, 2.0, 0.0, 3.0]


def test_a_part_is_small_beside_the_turns_that_are_weighed():
    """What a run that is stopped loses is what its threads were at."""
    assert module.TOGETHER * module._SIDE_BY_SIDE <= 0.1 * LEAST_FITTED


def test_looking_to_both_sides_gets_past_where_play_is_rough(monkeypatch):
    """From four estimates that are too high: which of them get stuck depends on the last bits of a processor."""
    x = turn({"reducer_play": 0.5})
    monkeypatch.setattr(module, "again", lambda work, fit: fit)

    def errors() -> list[float]:
        estimates = [told([-9.0, -9.0, 3.0], [0.1, 0.1, high]) for high in (0.7, 0.75, 0.8, 0.95)]
        return [abs(fitted(synthesis(), x, [POINT], high).size[0, 2] - 0.5) for high in estimates]

    assert sorted(errors())[2] < 0.02
    monkeypatch.setattr(work_module, "_FACTORS", (1.0,))
    assert sorted(errors())[1] > 0.05


def test_a_fault_with_a_phase_is_found_with_it():
    names = ("friction", "imbalance")
    machine = MACHINE.with_effects(effect_of(FAULTS["imbalance"], 0.4, MACHINE, 2.0, 0))
    signal, stated = record(machine)
    (found,) = CELLS.turns(signal.values, MACHINE.reduction * stated.motor_speed, 3.0)
    reference = healthy().turn(POINT)
    x = view().measured(found - reference, reference, POINT)[None]
    fits = fitted(synthesis(names), x, [POINT], told([-9.0, 3.0], [0.1, 0.3]))
    assert fits.size[0, 1] == pytest.approx(0.4, abs=0.06)


def test_what_no_fault_of_the_table_makes_is_left():
    bump = make_effect("cam.profile_error", height=8e-4, centre=0.25, half_width=0.06)
    strange = fitted(synthesis(), turn({}, 0, bump), [POINT], told([3.0, 3.0, 3.0], [0.2, 0.2, 0.2]))
    assert strange.left[0] > 20.0
    assert WEIGHTS.strangeness(strange)[0] > 1.0


def test_a_fault_comes_on_top_of_what_the_machine_has():
    rubbing = MACHINE.with_effects(make_effect("friction.coulomb", torque=5.0))
    fault = FAULTS["friction"]
    assert effect_of(fault, 0.1, rubbing, 0.0, 0).torque == pytest.approx(5.0 + fault.value(0.1, rubbing))


def test_a_loose_sensor_comes_on_top_of_the_bracket_that_it_stands_on():
    softer, fault = Sensor(bracket_hz=60.0, bracket_damping=0.05), FAULTS["sensor_loose"]
    found = effect_of(fault, 0.1, MACHINE, 0.0, 0, sensor=softer)
    assert found.inverse_square == pytest.approx(1.0 / (2.0 * np.pi * 60.0) ** 2 + fault.value(0.1, MACHINE))
    assert found.damping == 0.05
    assert effect_of(fault, 0.1, MACHINE, 0.0, 0, sensor=Sensor()).inverse_square == fault.value(0.1, MACHINE)
    plain = synthesis(("sensor_loose",))
    on_bracket = dataclasses.replace(plain, healthy=dataclasses.replace(plain.healthy, sensor=softer))
    nothing, stations = np.zeros((1, on_bracket.components.count)), np.zeros(1, dtype=int)
    work = Work(on_bracket, nothing, [POINT], np.ones((1, 1), dtype=bool), stations)
    unknowns = np.zeros(work.free.shape[1])
    unknowns[0] = 0.1
    assert work._machine(unknowns, 0)[1].bracket_hz == pytest.approx(found.extend_sensor(softer).bracket_hz)


def test_the_twin_names_by_synthesis_and_refuses_what_it_cannot_make():
    from tests.twin.builders import Fixed
    from tests.twin.test_judge import twin

    loud = [2.0 if name == "crack" else -9.0 for name in FAULTS]
    given = twin(Fixed(1.0, loud), alone=False)
    known = given.judged(turn({"crack": 0.3}), POINT, True)
    assert known.verdict == FAULTY and known.faults[0].size == pytest.approx(18.0, abs=0.5)
    bump = make_effect("cam.profile_error", height=8e-4, centre=0.25, half_width=0.06)
    assert given.judged(turn({}, 0, bump), POINT, True).verdict == UNKNOWN
    quiet = twin(Fixed(-1.0, loud), alone=False)
    assert quiet.judged(turn({}), POINT, True).verdict == HEALTHY
    assert quiet.judged(turn({}, 0, bump), POINT, True).verdict == UNKNOWN


def drawn(rng: np.random.Generator, count: int) -> tuple[Fits, np.ndarray, np.ndarray]:
    """Fits whose errors beside another fault are three times as large as they say."""
    there = rng.random((count, 2)) < 0.5
    size = np.where(there, rng.uniform(0.1, 1.0, (count, 2)), 0.0)
    error = np.full((count, 2), 0.01)
    off = 0.01 * rng.standard_normal((count, 2)) * np.where(there.all(axis=1), 3.0, 1.0)[:, None]
    return Fits(np.where(there, size + off, 0.0), error, np.ones(count), np.zeros(count)), there, size


def test_intervals_hold_in_every_group():
    rng = np.random.default_rng(0)
    weights = weights_of(*drawn(rng, 3000), [np.ones(200)] * 2, 0.9)
    fits, there, size = drawn(rng, 3000)
    named = weights.logits(fits) > 0.0
    assert (named == there).mean() > 0.99
    held = np.abs(fits.size - size) <= spread(fits) * weights.reach[:, (named.sum(axis=1) > 1).astype(int)].T
    for group in (True, False):
        mine = named & there & ((named.sum(axis=1) > 1) == group)[:, None]
        assert 0.86 < held[mine].mean() < 0.94


def test_a_fault_is_named_where_its_fit_shows_it():
    weights = weights_of(*drawn(np.random.default_rng(0), 400), [np.ones(200)] * 2, 0.9)
    sizes = Fits(np.array([[0.1, 0.003]]), np.full((1, 2), 0.002), np.ones(1), np.zeros(1))
    assert (weights.logits(sizes)[0] > 0.0).tolist() == [True, False]


def test_a_fit_that_leaves_much_shows_less():
    sizes = [Fits(np.array([[0.02]]), np.array([[0.002]]), np.array([left]), np.zeros(1)) for left in (1.0, 20.0)]
    assert WEIGHTS.logits(sizes[0])[0, 0] > 0.0 > WEIGHTS.logits(sizes[1])[0, 0]


def test_the_measured_turns_own_scatter_counts_beyond_that_of_noise():
    of, rng = synthesis(), np.random.default_rng(0)
    quiet = rng.standard_normal((1, 8, CELLS.count))
    rattling = quiet + 30.0 * rng.standard_normal((1, 8, 1)) * np.sin(np.arange(CELLS.count) / 3.0)
    calm, loud = (np.trace(of.chance(x)[0]) for x in (quiet, rattling))
    assert calm < 0.5 * np.trace(of.covariance) < loud


def test_a_small_group_takes_the_reach_of_its_fault():
    error = np.array([[1.0], [2.0]] * 30)
    named = np.ones((60, 1), dtype=bool)
    found, pooled = reaches(error, named, named, 0.9)
    assert found[0, 0] == found[0, 1] == 2.0 and not pooled.any()


def test_a_fault_has_an_interval_of_its_own_from_as_few_turns_as_can_tell_it():
    """Ten turns of a fault that misses ten times as far as the other, and eight, which tell no quantile of 90 %."""
    for count, own in ((10, 10.0), (8, 1.0)):
        error, named = np.ones((200, 2)), np.zeros((200, 2), dtype=bool)
        error[:count, 1] = 10.0
        named[:count, 1] = named[count:, 0] = True
        found, pooled = reaches(error, named, named, 0.9)
        assert found[1].tolist() == [own, own] and pooled.tolist() == [False, count == 8]


def test_turns_too_few_for_the_coverage_bound_no_size_and_looks_at_one_turn_are_no_turns():
    error, named = np.ones((60, 1)), np.ones((60, 1), dtype=bool)
    assert (reaches(error, named, named, 0.98)[0] == 1.0).all()
    assert np.isinf(reaches(error, named, named, 0.99)[0]).all()
    assert np.isinf(reaches(error, named, named, 0.98, np.repeat(np.arange(15), 4))[0]).all()


def test_weights_are_stored_and_come_back():
    assert Weights.restore(WEIGHTS.plain()).plain() == WEIGHTS.plain()


def test_what_cannot_be_simulated_is_never_the_best():
    given = synthesis()
    object.__setattr__(given, "healthy", dataclasses.replace(healthy()))
    work = Work(given, given.seen(turn({"crack": 0.4})), [POINT], np.ones((1, 3), bool), np.zeros(1, int))
    q = work.at(np.array([[0.4, 0.0, 0.0], [0.4, 1e-9, 0.0]]), np.array([0, 0])).q
    assert q[0] < 3.0 and q[1] == BAD


def test_a_sensor_so_little_loose_that_the_rate_cannot_show_it_is_never_the_best():
    """At 500 Hz a bracket above 225 Hz is refused: the fit goes on without such a size."""
    of = synthesis(("crack", "sensor_loose"))
    of = dataclasses.replace(of, healthy=dataclasses.replace(of.healthy, cells=dataclasses.replace(CELLS, rate=500.0)))
    work = Work(of, np.zeros((1, of.components.count)), [POINT], np.array([[True, True]]), np.zeros(1, int))
    sizes = np.array([[0.0, 0.005], [0.0, 0.5]])
    x = work.simulated(sizes, np.zeros(2, int))
    assert np.isnan(x[0]).all() and np.isfinite(x[1]).all()


def test_the_shift_of_a_simulated_turn_is_taken_out_as_that_of_a_measured_one():
    machine = MACHINE.with_effects(effect_of(FAULTS["crack"], 0.3, MACHINE, 0.0, 0))
    samples = int(1.1 * machine.turn_duration(POINT) * 500.0)
    start = OperatingPoint(POINT.motor_speed, POINT.load_torque, 3.0)
    values = simulate(machine, start, Run(500.0, samples, warmup_turns=1)).table_acceleration
    (found,) = CELLS.turns(values, MACHINE.reduction * POINT.motor_speed, 3.0 + 0.004)
    reference = healthy().turn(POINT)
    x = view().measured(found - reference, reference, POINT)[None]
    fits = fitted(synthesis(), x, [POINT], told([3.0, -9.0, -9.0], [0.25, 0.2, 0.2]))
    assert fits.size[0, 0] == pytest.approx(0.3, abs=0.02)


def test_a_shift_moves_what_a_fault_does_too(monkeypatch):
    """Two standard deviations of the pulse on a turn with a large crack."""
    machine = MACHINE.with_effects(effect_of(FAULTS["crack"], 0.9, MACHINE, 0.0, 0))
    signal, stated = record(machine)
    reference = healthy().turn(POINT)
    left = []
    for off in (0.0, 0.004):
        (found,) = CELLS.turns(signal.values, MACHINE.reduction * stated.motor_speed, 3.0 + off)
        x = view().measured(found - reference, reference, POINT)[None]
        left.append(fitted(synthesis(), x, [POINT], told([3.0, -9.0, -9.0], [0.85, 0.2, 0.2])).left[0])
    assert left[0] < 0.1 and left[1] < 1.0
    monkeypatch.setattr(Work, "shifted", lambda self, x, at: np.zeros((len(x), 2, self.m.shape[1])))
    assert fitted(synthesis(), x, [POINT], told([3.0, -9.0, -9.0], [0.85, 0.2, 0.2])).left[0] > 2.0 * left[1]


def test_what_the_posterior_leaves_open_grows_with_the_faults():
    soft = dataclasses.replace(MACHINE, output_joint=dataclasses.replace(MACHINE.output_joint, stiffness=43000.0))
    sizes, turns = [0.2, 0.5, 0.8] * 2, []
    for size in sizes:
        given = soft.with_effects(effect_of(FAULTS["crack"], size, soft, 0.0, 0))
        signal, stated = record(given)
        (found,) = CELLS.turns(signal.values, MACHINE.reduction * stated.motor_speed, 3.0)
        turns.append(view().measured(found - healthy().turn(POINT), healthy().turn(POINT), POINT))
    size = np.array([[s, 0.0, 0.0] for s in sizes])
    of = synthesis()
    growth = growth_of(of, np.array(turns), [POINT] * 6, size, np.zeros(6, int))
    wide = dataclasses.replace(of, growth=growth)
    narrow, wider = (fitted(o, turns[2][None], [POINT], told([3.0, -9.0, -9.0], [0.8, 0.1, 0.1])) for o in (of, wide))
    assert wider.left[0] < 0.3 * narrow.left[0] and wider.error[0, 0] > narrow.error[0, 0]


def test_what_may_be_left_of_faulty_turns_is_not_decided_by_the_many_healthy_ones():
    rng = np.random.default_rng(0)
    fits, there, size = drawn(rng, 400)
    fits = dataclasses.replace(fits, left=np.exp(rng.normal(2.0, 1.0, 400)))
    weights = weights_of(fits, there, size, [np.full(5000, 1.0), np.full(5000, 2.0)], 0.9)
    assert (weights.strangeness(fits) > 1.0).mean() < 0.02
    for known, limit in ((True, 1.0), (False, 2.0)):
        below, above = weights.oddness(np.array([0.99, 1.01]) * limit, stations_known=known)
        assert below < 1.0 < above


@pytest.mark.parametrize("bad", [0, 3])
def test_few_fits_in_a_wrong_minimum_do_not_decide_what_is_strange(bad):
    """Seed 1: of 120 turns three leave a thousand times the noise's power, as a fit does that went astray."""
    fits, there, size = drawn(np.random.default_rng(0), 120)
    left = np.exp(np.random.default_rng(1).normal(0.0, 0.5, 120))
    left[:bad] = 1000.0
    weights = weights_of(dataclasses.replace(fits, left=left), there, size, [np.ones(200)] * 2, 0.9)
    limit = 1.0 / weights.strangeness(dataclasses.replace(fits, left=np.ones(120)))[0] ** 2
    assert left[bad:].max() < limit < 60.0


def test_many_fits_that_name_the_wrong_faults_do_not_decide_what_is_strange():
    """Seed 1: a quarter of the fits miss what is there, and leave some hundred times the noise's power."""
    fits, there, size = drawn(np.random.default_rng(0), 160)
    rng = np.random.default_rng(1)
    left, found, bad = np.exp(rng.normal(0.0, 0.3, 160)), fits.size.copy(), np.arange(160) < 40
    left[bad], found[bad], there[bad, 0] = np.exp(rng.normal(6.0, 1.0, 40)), 0.0, True
    weights = weights_of(dataclasses.replace(fits, size=found, left=left), there, size, [np.ones(200)] * 2, 0.9)
    limit = 1.0 / weights.strangeness(dataclasses.replace(fits, left=np.ones(160)))[0] ** 2
    assert left[~bad].max() < limit < 20.0


def test_how_much_a_turn_rattles_is_what_its_cam_turns_differ_by_beyond_noise():
    rng = np.random.default_rng(0)
    calm = turn({"crack": 0.3})
    rattling = calm + 30.0 * rng.standard_normal((1, 8, 1)) * np.sin(np.arange(CELLS.count) / 3.0)
    said = told([3.0, -9.0, -9.0], [0.3, 0.1, 0.1])
    still, loud = (fitted(synthesis(), x, [POINT], said).rattling[0] for x in (calm, rattling))
    assert still < 1.0 and loud > 20.0


def test_what_turns_may_leave_that_rattle_more_than_any_seen_is_not_extrapolated():
    """Five seeds: how little the turns rattle says nothing of what is left of them."""
    for seed in range(5):
        rng = np.random.default_rng(seed)
        fits, there, size = drawn(rng, 160)
        rattling, left = np.abs(0.1 * rng.standard_normal(160)), np.exp(0.5 * rng.standard_normal(160))
        fits = dataclasses.replace(fits, rattling=rattling, left=left)
        weights = weights_of(fits, there, size, [np.ones(200)] * 2, 0.9)
        asked = dataclasses.replace(fits, rattling=np.full(160, 1000.0), left=np.full(160, 20.0))
        assert 1.0 < weights.strangeness(asked)[0] < 3.0


def test_only_a_turn_that_rattles_may_leave_as_much_as_turns_that_rattle():
    """Seed 1: the cam turns of one half differ by a thousand times the noise; these leave 30 times it."""
    rng = np.random.default_rng(1)
    fits, there, size = drawn(np.random.default_rng(0), 200)
    rattling = np.where(np.arange(200) < 100, 0.0, 1000.0)
    left = np.exp(rng.normal(np.where(rattling > 0.0, math.log(30.0), 0.0), 0.2))
    fits = dataclasses.replace(fits, left=left, rattling=rattling)
    weights = weights_of(fits, there, size, [np.ones(200)] * 2, 0.9)
    asked = dataclasses.replace(fits, left=np.full(200, 20.0))
    assert ((weights.strangeness(asked) > 1.0) == (rattling == 0.0)).all()
    assert (weights.strangeness(fits) > 1.0).mean() < 0.02
