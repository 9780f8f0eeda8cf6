"""The dwell in closed form: the propagator, that no step shows in it, and the automatic step beside it."""

import dataclasses

import numpy as np
import pytest
import scipy.linalg

from indexer_env.coefficients import coefficients, pack
from indexer_env.effects import make_effect
from indexer_env.engine import advance
from indexer_env.kernels import layout
from indexer_env.kernels.clock import set_clock
from indexer_env.kernels.dwell import propagator
from indexer_env.machine import Machine
from indexer_env.modes import FINEST_STEP, largest_steps, steps_of
from indexer_env.operating_point import OperatingPoint
from indexer_env.reference import simulate_reference
from indexer_env.simulate import Run, simulate, simulate_batch

IN_DWELL = OperatingPoint(start_angle=3.3, load_torque=40.0)


@pytest.mark.unjitted
@pytest.mark.parametrize("time", [1e-9, 1e-4, 1e-3, 0.3])
@pytest.mark.parametrize(
    ("k", "r"),
    [(44e3, 28.0), (44e3, 0.0), (50.0, 300.0), (80.0, 40.0), (80.0, 40.0 + 1e-6), (0.0, 0.0), (0.0, 28.0), (0.0, 1e-9)],
)
def test_the_propagator_is_the_matrix_exponential(k, r, time):
    """Under-, over- and critically damped, and in free flight with and without damping; inertia 5, c = -0.4."""
    a, b, d, e, f, g = propagator(time, k, r, 5.0, -0.4)
    exact = scipy.linalg.expm(time * np.array([[0.0, 1.0, 0.0], [-k / 5.0, -r / 5.0, -0.4], [0.0, 0.0, 0.0]]))
    np.testing.assert_allclose([[a, b, f], [d, e, g]], exact[:2], rtol=1e-11, atol=1e-14)


def with_play(smooth: Machine, play_1: float, play_2: float) -> Machine:
    return dataclasses.replace(
        smooth,
        input_joint=dataclasses.replace(smooth.input_joint, backlash=play_1),
        output_joint=dataclasses.replace(smooth.output_joint, backlash=play_2),
    )


def difference(machine: Machine, steps: tuple[float, float]) -> float:
    """Relative rms difference of φ̈ at two steps over 0.4 s in the dwell, where the load sets the table swinging."""
    coarse, fine = (
        simulate(machine, IN_DWELL, Run(samples=400, warmup_turns=0, step=step)).table_acceleration for step in steps
    )
    return float(np.sqrt(np.mean((coarse - fine) ** 2) / np.mean(fine**2)))


def test_no_step_shows_in_the_dwell(smooth):
    assert difference(smooth, (1e-3, 1e-3 / 64)) < 1e-9
    viscous = smooth.with_effects(make_effect("friction.viscous", coefficient=20.0))
    assert difference(viscous, (1e-3, 1e-3 / 64)) < 1e-9


def test_an_effect_that_acts_in_the_dwell_takes_steps_in_it(smooth):
    """The anti-test: where the closed form does not hold it must not be used, and the step shows."""
    for effect in (
        make_effect("load.process", torque=50.0),
        make_effect("friction.coulomb", torque=1e-3),
        make_effect("output.cubic_stiffness", stiffness=1.0),
    ):
        assert 1e-8 < difference(smooth.with_effects(effect), (1e-3, 1e-3 / 64)) < 1e-2


FORCED = {
    "imbalance": (make_effect("load.imbalance", torque=10.0, phase=0.3), 1e-8, 1e-6),
    "heavy imbalance": (make_effect("load.imbalance", torque=200.0, phase=1.0), 1e-7, 2e-6),
    "ripple": (make_effect("drive.speed_ripple", depth=0.02, phase=0.4), 1e-9, 1e-8),
    "transmission error": (make_effect("drive.transmission_error", amplitude=1e-4), 1e-9, 1e-8),
}
"""What forces the oscillators of a dwell, and the difference allowed without and with play."""


def over_strides(machine: Machine) -> float:
    """Relative rms difference of φ̈ between strides of 1 ms and of 1/16 ms over 0.4 s in the dwell."""
    coarse = simulate(machine, IN_DWELL, Run(samples=400, warmup_turns=0)).table_acceleration
    run = Run(sample_rate=16e3, samples=6400, warmup_turns=0, step=1e-3 / 16)
    fine = simulate(machine, IN_DWELL, run).table_acceleration[::16]
    return float(np.sqrt(np.mean((coarse - fine) ** 2) / np.mean(fine**2)))


@pytest.mark.parametrize("name", FORCED)
@pytest.mark.parametrize("play", [(0.0, 0.0), (1e-4, 1e-4)], ids=["no play", "play"])
def test_what_forces_the_dwell_goes_with_its_strides(smooth, name, play):
    """No step shows, and hardly the length of a stride; the effect itself does."""
    effect, most, most_with_play = FORCED[name]
    plain = with_play(smooth, *play)
    machine = plain.with_effects(effect)
    assert difference(machine, (1e-3, 1e-3 / 64)) < 1e-9
    assert over_strides(machine) < (most_with_play if any(play) else most)
    run = Run(samples=400, warmup_turns=0, channels=("table_acceleration", "cam_rate"))
    with_it, without = (simulate(each, IN_DWELL, run).channels for each in (machine, plain))
    assert max(np.abs(with_it[name] - without[name]).max() for name in run.channels) > 1e-4


@pytest.mark.parametrize("name", FORCED)
@pytest.mark.parametrize("play", [(0.0, 0.0), (1e-4, 1e-4)], ids=["no play", "play"])
def test_what_forces_the_dwell_is_that_of_the_reference(smooth, name, play):
    machine = with_play(smooth, *play).with_effects(FORCED[name][0])
    channels = ("table_acceleration", "cam_acceleration", "torque_1", "region_1", "region_2")
    found = simulate(machine, IN_DWELL, Run(samples=300, warmup_turns=0, channels=channels)).channels
    truth = simulate_reference(machine, IN_DWELL, samples=300, channels=channels).channels
    for channel in channels[:3]:
        size = max(np.linalg.norm(truth[channel]), 1e-2)  # an imbalance leaves the cam at its speed
        assert np.linalg.norm(found[channel] - truth[channel]) <= (1e-5 if any(play) else 1e-6) * size, channel
    for joint in (1, 2):
        values = set(np.unique(truth[f"region_{joint}"]))
        assert values == set(np.unique(found[f"region_{joint}"]))
        assert len(values) > 1 or not any(play) or joint == 1


def in_turns(machine: Machine, step: float, acceleration: float = 0.0) -> np.ndarray:
    """α̈ and φ̈ (2, 300) at 1 kHz in the dwell, with the motor on a ramp [rad/s²]."""
    packed = pack([coefficients(machine, IN_DWELL)], [IN_DWELL])
    packed.coefficients[0, layout.COEFFICIENT_NAMES.index("motor_acceleration")] = acceleration
    every = round(1e-3 / step)
    out, status, _ = advance(
        packed, np.array([300 * every]), np.array([step]), np.array([0.0]), every=every, samples=300,
        rows=np.array([layout.CAM_ACC, layout.TABLE_ACC]),
    )  # fmt: skip
    assert status[0] == layout.RUNNING
    return out[0]


def test_on_a_ramp_of_the_motor_a_harmonic_takes_steps(smooth):
    """Its frequency changes then. The anti-test: without a harmonic the ramp has its closed form."""
    ripple = smooth.with_effects(FORCED["ripple"][0])
    for machine, acceleration, least, most in (
        (ripple, 20.0, 1e-9, 1e-5), (ripple, 0.0, 0.0, 1e-12), (smooth, 20.0, 0.0, 1e-12)
    ):  # fmt: skip
        coarse, fine = (in_turns(machine, step, acceleration)[0] for step in (1e-3, 1e-3 / 64))
        assert least <= np.abs(coarse - fine).max() / np.abs(fine).max() <= most


def test_a_harmonic_that_meets_an_undamped_resonance_takes_steps(smooth):
    """Its two parts in the closed form grow without bound there; the motion itself grows slowly."""
    joint = dataclasses.replace(smooth.input_joint, damping=0.0)
    order = float(np.sqrt(joint.stiffness / smooth.cam_inertia)) / IN_DWELL.motor_speed
    found = {}
    for off in (0.0, 1e-4):
        effect = make_effect("drive.transmission_error", amplitude=1e-4, order=order * (1.0 + off))
        machine = dataclasses.replace(smooth, input_joint=joint).with_effects(effect)
        coarse, fine = (in_turns(machine, step)[0] for step in (1e-3, 1e-3 / 64))
        found[off] = np.abs(coarse - fine).max() / np.abs(fine).max()
    assert 1e-9 < found[0.0] < 1e-3 and found[1e-4] < 1e-9


def test_a_lane_that_is_forced_leaves_its_neighbours_their_bits(smooth):
    """Nor do they change its own."""
    run = Run(samples=400, warmup_turns=0)
    machines = [smooth, *(with_play(smooth, 1e-4, 1e-4).with_effects(effect) for effect, *_ in FORCED.values())]
    together = simulate_batch(machines, IN_DWELL, run).table_acceleration
    for machine, record in zip(machines, together, strict=True):
        assert simulate(machine, IN_DWELL, run).table_acceleration.tobytes() == record.tobytes()


def test_a_forced_run_in_parts_is_the_run_in_one(smooth):
    """What forces a lane is worked out anew from its state, with the same bits."""
    point = OperatingPoint(start_angle=2.9, load_torque=40.0)
    plays = ((0.0, 0.0), (1e-4, 1e-4), (0.01, 1e-3))
    machines = [with_play(smooth, *play).with_effects(effect) for play in plays for effect, *_ in FORCED.values()]
    count = len(machines)

    def run(parts: list[int]) -> tuple[np.ndarray, np.ndarray]:
        packed, out = pack([coefficients(machine, point) for machine in machines], [point] * count), []
        for steps in parts:
            out.append(advance(
                packed, np.full(count, steps), np.full(count, 1e-3), np.zeros(count), every=1, samples=steps,
                rows=np.array([layout.CAM_ACC, layout.TABLE_ACC, layout.TORQUE_1]),
            )[0])  # fmt: skip
        return np.concatenate(out, axis=2), packed.states

    (whole, end), (joined, end_in_parts) = run([400]), run([1, 1, 98, 150, 37, 113])
    np.testing.assert_array_equal(joined, whole)
    assert end.tobytes() == end_in_parts.tobytes()


@pytest.mark.parametrize(
    ("name", "size"), [("cam.profile_error", {"height": 1e-3}), ("load.process", {"torque": 50.0})]
)
def test_a_bump_leaves_the_dwell_exact_where_it_does_not_reach_into_it(smooth, name, size):
    def found(centre: float) -> float:
        return difference(smooth.with_effects(make_effect(name, size, centre=centre)), (1e-3, 1e-3 / 64))

    assert found(0.3) < 1e-9 < 1e-8 < found(0.7)


@pytest.mark.parametrize(("play_1", "play_2"), [(0.0, 1e-3), (0.0136, 1e-3)])
def test_landing_on_the_play_in_the_dwell_is_of_high_order(smooth, play_1, play_2):
    found = difference(with_play(smooth, play_1, play_2), (1e-3, 1e-3 / 64))
    assert found < 2e-5


def test_the_dwell_ends_where_it_should(smooth):
    """Starts shortly before the end, with steps that do not divide what is left of it."""
    for share in (0.02, 0.35, 0.9):
        point = OperatingPoint(start_angle=2.0 * np.pi - 6.13 * (3.0 + share) * 1e-3)
        records = [
            simulate(smooth, point, Run(samples=60, warmup_turns=0, step=step)).table_acceleration
            for step in (0.5e-3, 1e-3 / 32)
        ]
        np.testing.assert_allclose(records[0], records[1], rtol=0, atol=1e-6 * np.abs(records[1]).max())


@pytest.mark.parametrize(("model", "step"), [("A", 1e-3), ("B", 1e-3), ("B_on_base", 1e-3 / 16)])
def test_a_dwell_may_end_with_a_step(smooth, model, step):
    """Starts whole steps before the end: rounding decides on which side of it the step ends, and hardly any rest of the
    step is left behind it."""
    machine, cam_speed = dataclasses.replace(smooth, model=model), OperatingPoint().motor_speed / smooth.reduction_ratio
    points = [
        OperatingPoint(start_angle=2.0 * np.pi * turns - cam_speed * steps * 1e-3)
        for steps in range(1, 20)
        for turns in (1, 7)
    ]
    coarse, fine = (
        simulate_batch([machine] * len(points), points, Run(samples=60, warmup_turns=0, step=step)).table_acceleration
        for step in (step, step / 32)
    )
    np.testing.assert_allclose(coarse, fine, rtol=0, atol=1e-6 * np.abs(fine).max())


def varied(machine: Machine, rng: np.random.Generator) -> Machine:
    """Inertias, stiffnesses and dampings times 1/1.5 … 1.5."""

    def off(value: float) -> float:
        return value * 1.5 ** float(rng.uniform(-1.0, 1.0))

    joints = {
        name: dataclasses.replace(joint, stiffness=off(joint.stiffness), damping=off(joint.damping))
        for name, joint in (("input_joint", machine.input_joint), ("output_joint", machine.output_joint))
    }
    inertias = {name: off(getattr(machine, name)) for name in ("cam_inertia", "follower_inertia", "table_inertia")}
    return dataclasses.replace(machine, **joints, **inertias)


@pytest.mark.parametrize(("play", "samples", "most"), [((0.0, 0.0), 2100, 1e-6), ((0.0136, 1e-3), 500, 1e-5)])
def test_the_automatic_step_keeps_its_promise(smooth, play, samples, most):
    """Machines and speeds drawn with seed 11, against a run with some twenty times as many steps."""
    rng = np.random.default_rng(11)
    machines = [varied(with_play(smooth, *play), rng) for _ in range(24)]
    points = [OperatingPoint(motor_speed=157.0 * float(rng.uniform(0.6, 1.5))) for _ in machines]
    run = Run(samples=samples, warmup_turns=0)
    found = simulate_batch(machines, points, run).table_acceleration
    truth = simulate_batch(machines, points, dataclasses.replace(run, step=1e-3 / 48)).table_acceleration
    errors = np.sqrt(np.mean((found - truth) ** 2, axis=1) / np.mean(truth**2, axis=1))
    assert 1e-2 * most < errors.max() <= most
    _, steps = steps_of([coefficients(m, p) for m, p in zip(machines, points, strict=True)], points)
    assert steps.max() > 1.3 * steps.min() and steps.min() >= FINEST_STEP


def test_the_automatic_step_is_the_item_s_own(smooth, reference):
    """Items of different steps in one batch keep the bits that they have alone."""
    stiff, stiffer = (
        dataclasses.replace(smooth, output_joint=dataclasses.replace(smooth.output_joint, stiffness=stiffness))
        for stiffness in (2e5, 6e5)
    )
    point, run = OperatingPoint(motor_speed=80.0), Run(samples=300, warmup_turns=0)
    machines = [stiff, stiffer, reference, smooth]
    parts = [run.steps_per_sample(float(steps_of([coefficients(m, point)], [point])[1][0])) for m in machines]
    assert len(set(parts)) == 3, parts
    together = simulate_batch(machines, point, run).table_acceleration
    for machine, record in zip(machines, together, strict=True):
        assert simulate(machine, point, run).table_acceleration.tobytes() == record.tobytes()


def test_what_asks_for_a_finer_automatic_step(smooth, visible):
    def step(machine: Machine, speed: float = 157.0) -> float:
        point = OperatingPoint(motor_speed=speed)
        return float(steps_of([coefficients(machine, point)], [point])[1][0])

    assert step(smooth) == pytest.approx(0.8 * largest_steps([coefficients(smooth, OperatingPoint())])[0])
    assert step(smooth, 300.0) < step(smooth)
    for effect, share in (
        (visible("output.cubic_stiffness"), 0.5),
        (make_effect("drive.speed_ripple", depth=0.02), 0.5),
        (make_effect("drive.speed_ripple", depth=0.005), 1.0),
    ):
        assert step(smooth.with_effects(effect)) == pytest.approx(share * step(smooth))
    for depth, phase in ((0.3, 0.09 / 0.3**0.25), (0.5, 0.09 / 0.5**0.25)):
        ripple = make_effect("drive.speed_ripple", depth=depth)
        assert step(smooth.with_effects(ripple)) == pytest.approx(0.5 * phase / 157.0, rel=1e-12)
    fine = smooth.with_effects(make_effect("drive.transmission_error", amplitude=1e-7, order=5.0))
    assert step(fine) == pytest.approx(0.4 / (5.0 * 157.0), rel=1e-12)
    rattling = with_play(smooth, 0.0136, 1e-3)
    assert step(rattling) == pytest.approx(step(smooth)) and step(smooth, 20.0) == pytest.approx(step(smooth))
    assert step(rattling, 20.0) == pytest.approx(0.5 * step(smooth))


def test_a_stride_keeps_its_phase_on_the_flank_that_the_mesh_stiffens():
    """κ = 1/2 doubles the stiffness where the cam drives the motor: 24 steps of 0.01 rad become 12 of 0.014 rad."""
    strides = []
    for friction in (0.0, 0.5):
        w = np.zeros(layout.WORKSPACE)
        w[layout.K_1], w[layout.J_CAM] = 1e4, 1.0
        w[layout.K_2], w[layout.J_TABLE], w[layout.MESH_FRICTION] = 1.0, 1.0, friction
        getattr(set_clock, "py_func", set_clock)(w, np.uint64(0), 1e-4, 100, 24)
        strides.append(w[layout.STRIDE])
    assert strides == [24.0, 12.0]
