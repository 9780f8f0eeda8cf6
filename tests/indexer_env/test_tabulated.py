"""Tabulated torques: the spline, the simulator against the reference solver, and the ways in."""

import dataclasses
import math
import pickle
from collections.abc import Sequence

import numpy as np
import pytest
from numba.core.dispatcher import Dispatcher

from indexer_env import Machine, OperatingPoint, Run, load_machine, make_effect, simulate, simulate_batch
from indexer_env.effects import EFFECTS, TABLES, effects_by_name
from indexer_env.effects.tabulated import OPEN_PLACES, PLACES, TURN_PLACES
from indexer_env.errors import ParameterError
from indexer_env.kernels.layout import COEFFICIENT_NAMES
from indexer_env.reference import simulate_reference
from indexer_env.reference.tables import spline_of

HEALTHY = load_machine("smooth")
PLAY = load_machine("reference")
VALUES = (3.0, -8.0, 5.0, 20.0, -4.0, 9.0, 14.0, -11.0, 6.0)
"""Of no shape."""

SPEED, DEFLECTION = {"low": -0.2, "high": 1.9}, {"low": -1.5e-3, "high": 1e-3}
REACH = {
    "tabulated.speed": SPEED, "tabulated.angle": {}, "tabulated.cam": {}, "tabulated.deflection": DEFLECTION,
    "tabulated.speed_angle": SPEED, "tabulated.speed_cam": SPEED,
    "tabulated.deflection_rate": {**DEFLECTION, "low_2": -0.1, "high_2": 0.08}, "tabulated.profile": {},
}  # fmt: skip
"""Within what is passed, so that the ends count."""


def table(name: str, values: Sequence[float] | None = None, **more: float):
    """A table of some values, or of VALUES over and over, of an error of the cam's motion in 10 µrad."""
    grid = TABLES[name].grid
    if values is None:
        values = [VALUES[k % len(VALUES)] * (1e-5 if TABLES[name].moves else 1.0) for k in range(len(grid))]
    return make_effect(name, {**dict(zip(grid, values, strict=True)), **REACH[name], **more})


def accelerations(machine: Machine, samples: int = 500) -> np.ndarray:
    return simulate(machine, OperatingPoint(), Run(warmup_turns=0, samples=samples)).table_acceleration


def test_no_table_is_in_the_library_that_is_searched() -> None:
    assert set(TABLES) == set(REACH) and not set(TABLES) & set(EFFECTS)


@pytest.mark.parametrize("name", REACH)
@pytest.mark.parametrize("model", ["A", "B", "B_on_base"])
def test_the_simulator_agrees_with_the_reference(name: str, model: str) -> None:
    machine = dataclasses.replace(HEALTHY, model=model).with_effects(table(name))
    expected = simulate_reference(machine, OperatingPoint(), samples=500).table_acceleration
    size = np.linalg.norm(expected)
    # where a table ends within what is passed, its torque has a kink on which no step lands
    tolerance = 1e-4 if REACH[name] else 1e-6
    assert np.linalg.norm(accelerations(machine) - expected) <= tolerance * size
    assert np.linalg.norm(accelerations(dataclasses.replace(HEALTHY, model=model)) - expected) > 1e-3 * size


def test_a_table_of_a_straight_line_is_viscous_friction() -> None:
    """A natural spline is exact on straight lines, also with play and in the dwell, where no closed form is left."""
    drag = 4.0
    speeds = np.linspace(-1.0, 5.0, PLACES)
    line = table("tabulated.speed", tuple(drag * speeds), low=-1.0, high=5.0)
    viscous = make_effect("friction.viscous", coefficient=drag)
    one, other = (accelerations(PLAY.with_effects(effect), 600) for effect in (line, viscous))
    np.testing.assert_allclose(one, other, atol=1e-4 * np.abs(other).max())


@pytest.mark.parametrize("name", REACH)
def test_the_spline_passes_through_its_values(name: str) -> None:
    """Of the kernel's own functions, against scipy's splines, their ends held or closed."""
    from indexer_env.coefficients import coefficients
    from indexer_env.kernels.effects import tabulated

    effect = table(name)
    item = coefficients(HEALTHY.with_effects(effect), OperatingPoint())
    first = np.uint64(COEFFICIENT_NAMES.index("tabulated_first_1"))

    def spline(*xs: float) -> tuple[float, float, float]:
        return tabulated(item.row, first, np.uint64(1), xs[0], xs[1] if len(xs) == 2 else 0.0)

    reaches, axes = [axis.high - axis.low for axis in effect.axes], effect.axes
    for at in np.ndindex(effect.values.shape):
        xs = [axis.places[k] for axis, k in zip(axes, at, strict=True)]
        assert spline(*xs)[0] == pytest.approx(effect.values[at], rel=1e-12)
        further = [x + 4.0 * reach * axis.closed for x, reach, axis in zip(xs, reaches, axes, strict=True)]
        assert spline(*further)[0] == pytest.approx(effect.values[at], rel=1e-9)
    expected, size = spline_of(effect), np.abs(effect.values).max()
    # from below the first place to above the last one
    for share in np.linspace(-0.3, 1.3, 57):
        xs = [axis.low + (share + 0.11 * n) * reach for n, (axis, reach) in enumerate(zip(axes, reaches, strict=True))]
        assert spline(*xs)[0] == pytest.approx(expected(*xs), abs=1e-10 * size)
        if axes[0].closed:
            for n in (1, 2):
                assert spline(*xs)[n] == pytest.approx(expected(*xs, derivatives=n), abs=1e-10 * size)


@pytest.mark.parametrize("value", [math.nan, math.inf, -math.inf])
def test_a_run_that_is_lost_reads_no_foreign_memory(value: float) -> None:
    """A state that is not finite makes an index, too; in plain Python an infinite one is an error of its own."""
    from indexer_env.kernels.effects import spline_cell

    if isinstance(spline_cell, Dispatcher):
        for count, closed in ((11.0, 0.0), (9.0, 1.0)):
            cell, _ = spline_cell(value, 0.5, 3.0, count, closed)
            assert 0.0 <= cell <= count - 1.0 - 3.0 * (1.0 - closed)


def _outer(f, g) -> list[float]:
    """f over five places of the speed times g over seven of a turn."""
    speeds, angles = np.linspace(-1.0, 5.0, OPEN_PLACES), np.arange(TURN_PLACES) * (2.0 * math.pi / TURN_PLACES)
    return np.outer(f(speeds), g(angles)).ravel().tolist()


@pytest.mark.parametrize("name", ["tabulated.speed_angle", "tabulated.speed_cam"])
def test_over_two_variables_a_drag_is_viscous_friction(name: str) -> None:
    """A line over the speed, the same at every angle."""
    drag = 4.0
    plane = table(name, _outer(lambda v: drag * v, np.ones_like), low=-1.0, high=5.0)
    viscous = make_effect("friction.viscous", coefficient=drag)
    one, other = (accelerations(PLAY.with_effects(effect), 600) for effect in (plane, viscous))
    np.testing.assert_allclose(one, other, atol=1e-4 * np.abs(other).max())


def test_over_two_variables_one_may_not_count() -> None:
    """The same at every speed, it is the table over the angle alone; through a sine, seven places or nine."""
    alone = table("tabulated.angle", (40.0 * np.sin(np.arange(PLACES) * (2.0 * math.pi / PLACES))).tolist())
    both = table("tabulated.speed_angle", _outer(np.ones_like, lambda p: 40.0 * np.sin(p)), low=-1.0, high=5.0)
    plain, one, other = (accelerations(m) for m in (HEALTHY, HEALTHY.with_effects(alone), HEALTHY.with_effects(both)))
    assert np.linalg.norm(one - other) < 0.02 * np.linalg.norm(one - plain)


def test_a_joint_tabulated_over_deflection_and_rate_is_its_spring_and_damper() -> None:
    """A plane k δ2 + r δ̇2 acts on the table as the joint does; so where the follower's own inertia and the cam's are
    so large that the reaction moves nothing, it is a stiffer and better damped joint."""
    heavy = dataclasses.replace(HEALTHY, cam_inertia=1e6, follower_inertia=1e6)
    joint = heavy.output_joint
    k, r = 0.2 * joint.stiffness, 0.5 * joint.damping
    deflections, rates = np.linspace(-0.02, 0.02, OPEN_PLACES), np.linspace(-2.0, 2.0, OPEN_PLACES)
    plane = (k * deflections[:, None] + r * rates).ravel().tolist()
    ends = {"low": -0.02, "high": 0.02, "low_2": -2.0, "high_2": 2.0}
    stiffer = dataclasses.replace(joint, stiffness=joint.stiffness + k, damping=joint.damping + r)
    one = accelerations(heavy.with_effects(table("tabulated.deflection_rate", plane, **ends)))
    other = accelerations(dataclasses.replace(heavy, output_joint=stiffer))
    plain = accelerations(heavy)
    assert np.linalg.norm(one - other) < 1e-3 * np.linalg.norm(plain - other)


def test_a_profile_that_is_tabulated_is_near_the_bump_that_it_samples() -> None:
    """Nine places in a turn follow β'' of a bump over the whole turn to a sixth; the same error at every angle moves
    the table to another place and not otherwise."""
    bump = make_effect("cam.profile_error", height=1e-3, centre=0.5, half_width=0.5)
    turns = np.arange(PLACES) / PLACES
    sampled = table("tabulated.profile", (1e-3 * (1.0 - (2.0 * turns - 1.0) ** 2) ** 4).tolist())
    plain, one, other = (accelerations(m) for m in (HEALTHY, HEALTHY.with_effects(bump), HEALTHY.with_effects(sampled)))
    assert np.linalg.norm(one - other) < 0.2 * np.linalg.norm(one - plain)
    moved = accelerations(HEALTHY.with_effects(table("tabulated.profile", [1e-3] * PLACES)))
    np.testing.assert_allclose(moved, plain, atol=1e-6 * np.abs(plain).max())


def test_neighbours_of_a_table_are_as_without_it() -> None:
    """Machines of one call share the effects that are worked out, not their numbers."""
    tables = [table(name) for name in REACH]
    machines = [HEALTHY, *(HEALTHY.with_effects(one) for one in tables)]
    bump = make_effect("cam.profile_error", height=1e-3)
    machines.append(HEALTHY.with_effects(bump, table("tabulated.profile")))
    run = Run(warmup_turns=0, samples=200)
    together = simulate_batch(machines, OperatingPoint(), run)
    for k, machine in enumerate(machines):
        np.testing.assert_array_equal(together.table_acceleration[k], accelerations(machine, 200))


def test_a_machine_with_a_table_is_sent_to_other_processes() -> None:
    for name in REACH:
        assert pickle.loads(pickle.dumps(table(name))) == table(name)


def test_at_zero_it_is_nothing() -> None:
    nothing = HEALTHY.with_effects(table("tabulated.angle", (0.0,) * PLACES))
    np.testing.assert_array_equal(accelerations(nothing), accelerations(HEALTHY))


def test_it_is_loaded_by_name_like_any_effect() -> None:
    effect = table("tabulated.speed")
    fields = {field.name: getattr(effect, field.name) for field in dataclasses.fields(effect)}
    named = effects_by_name({"tabulated": {"speed": fields}})
    assert make_effect("tabulated.speed", named["tabulated.speed"]) == effect


def test_refusals() -> None:
    with pytest.raises(ParameterError, match=r"tabulated\.speed\.high must be above low, 3, got 2"):
        table("tabulated.speed", low=3.0, high=2.0)
    with pytest.raises(ParameterError, match="only table of a machine"):
        accelerations(HEALTHY.with_effects(table("tabulated.speed"), table("tabulated.angle")), 10)
    with pytest.raises(ParameterError, match="lacks torque_9"):
        make_effect("tabulated.angle", {f"torque_{k}": 0.0 for k in range(1, 9)})
    with pytest.raises(ParameterError, match=r"tabulated\.deflection_rate\.high_2 must be above low_2, 0\.2, got 0\.1"):
        table("tabulated.deflection_rate", low_2=0.2, high_2=0.1)
    with pytest.raises(ParameterError, match=r"tabulated\.speed_angle\.torque_5_7 must be a finite number"):
        make_effect("tabulated.speed_angle", {**dict.fromkeys(TABLES["tabulated.speed_angle"].grid, 0.0),
                                              **SPEED, "torque_5_7": math.nan})  # fmt: skip
    with pytest.raises(
        ParameterError, match=r"tabulated\.profile\.error_3 must be a finite number >= -0\.05 and <= 0\.05 rad"
    ):
        table("tabulated.profile", (0.0, 0.0, 0.06, *VALUES[3:]))
    with pytest.raises(ParameterError, match=r"no effect 'tabulated\.angle_speed'; did you mean"):
        make_effect("tabulated.angle_speed")


@pytest.mark.parametrize("name", ["tabulated.speed", "tabulated.speed_angle", "tabulated.deflection_rate"])
def test_a_steep_table_is_resolved(name: str) -> None:
    from indexer_env.coefficients import coefficients
    from indexer_env.modes import largest_steps

    narrow = {end: 0.01 * value for end, value in REACH[name].items()}
    steep = table(name, [1e4 * VALUES[k % len(VALUES)] for k in range(len(TABLES[name].grid))], **narrow)
    items = [coefficients(m, OperatingPoint()) for m in (HEALTHY, HEALTHY.with_effects(steep))]
    plain, finer = largest_steps(items)
    assert finer < 0.1 * plain
