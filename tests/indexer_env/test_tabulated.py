"""Tabulated torques: the spline, the simulator against the reference solver, and the ways in."""

import dataclasses
import math

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from indexer_env import Machine, OperatingPoint, Run, load_machine, make_effect, simulate
from indexer_env.effects import EFFECTS, TABLES, effects_by_name
from indexer_env.effects.tabulated import PLACES
from indexer_env.errors import ParameterError
from indexer_env.reference import simulate_reference

HEALTHY = load_machine("smooth")
PLAY = load_machine("reference")
VALUES = (3.0, -8.0, 5.0, 20.0, -4.0, 9.0, 14.0, -11.0, 6.0)
"""N m, of no shape."""

REACH = {
    "tabulated.speed": {"low": -0.2, "high": 1.9}, "tabulated.angle": {}, "tabulated.cam": {},
    "tabulated.deflection": {"low": -1.5e-3, "high": 1e-3},
}  # fmt: skip
"""Within what is passed, so that the ends count."""


def table(name: str, values: tuple[float, ...] = VALUES, **more: float):
    torques = {f"torque_{k}": value for k, value in enumerate(values, start=1)}
    return make_effect(name, **{**torques, **REACH[name], **more})


def accelerations(machine: Machine, samples: int = 500) -> np.ndarray:
    return simulate(machine, OperatingPoint(), Run(warmup_turns=0, samples=samples)).table_acceleration


def test_no_table_is_in_the_library_that_is_searched() -> None:
    assert set(TABLES) == set(REACH) and not set(TABLES) & set(EFFECTS)


@pytest.mark.parametrize("name", REACH)
@pytest.mark.parametrize("model", ["A", "B", "B_on_base"])
def test_the_simulator_agrees_with_the_reference(name: str, model: str) -> None:
    machine = dataclasses.replace(HEALTHY, model=model).with_effects(table(name))
    if model == "B_on_base" and name == "tabulated.deflection":
        with pytest.raises(ParameterError, match=r"tabulated\.deflection"):
            simulate_reference(machine, OperatingPoint(), samples=10)
        return
    expected = simulate_reference(machine, OperatingPoint(), samples=500).table_acceleration
    size = np.linalg.norm(expected)
    # where a table ends within what is passed, its torque has a kink on which no step lands
    tolerance = 1e-4 if REACH[name] else 1e-5
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
    """Of the kernel's own functions, against scipy's spline, its ends held or closed."""
    from indexer_env.coefficients import coefficients
    from indexer_env.kernels.effects import knot_weight, spline_place

    effect = table(name)
    item = coefficients(HEALTHY.with_effects(effect), OperatingPoint())

    def torque(x: float) -> float:
        closed = item["tabulated_closed"]
        place = spline_place(x, item["tabulated_first"], item["tabulated_per"], closed)
        return sum(item[f"tabulated_{k}"] * knot_weight(place, float(k), closed) for k in range(11))

    low, high = effect.reach
    xs = np.linspace(low, high, PLACES)
    np.testing.assert_allclose([torque(x) for x in xs], VALUES, rtol=1e-12)
    finer = np.linspace(low, high, 57)
    if effect.closed:
        spline = CubicSpline(np.linspace(0.0, 2.0 * math.pi, 10), [*VALUES, VALUES[0]], bc_type="periodic")
        assert torque(xs[3] + 8.0 * math.pi) == pytest.approx(VALUES[3])
    else:
        spline = CubicSpline(xs, VALUES, bc_type="natural")
        assert torque(high + 1.0) == pytest.approx(VALUES[-1])
    np.testing.assert_allclose([torque(x) for x in finer], spline(finer), atol=1e-10)


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


def test_a_steep_table_is_resolved() -> None:
    from indexer_env.coefficients import coefficients
    from indexer_env.modes import largest_steps

    steep = table("tabulated.speed", tuple(1e5 * value for value in VALUES), low=-0.01, high=0.01)
    items = [coefficients(m, OperatingPoint()) for m in (HEALTHY, HEALTHY.with_effects(steep))]
    plain, finer = largest_steps(items)
    assert finer < 0.1 * plain
