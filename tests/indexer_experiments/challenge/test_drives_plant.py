"""The plant that makes the truth: against forces written down by hand, SciPy, and what physics asks of it."""

import math
from collections.abc import Callable

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from indexer_experiments.challenge.drives.motions import reference
from indexer_experiments.challenge.drives.plant import FIELDS, _level, _resisted, simulate_plant

MIDDLE, HALF = 0.3, 2.0
"""Of the stroke, whose half is not 1, so that a place and its share differ."""

FORCES: dict[str, tuple[dict[str, float], Callable[[float, float, float, float, float], float]]] = {
    "viscous": ({"viscous": 3.0}, lambda x, v, z, w, t: 3.0 * v),
    "quadratic": ({"quadratic": 3.0}, lambda x, v, z, w, t: 3.0 * v**2 if v > 0 else -3.0 * v**2),
    "offset": ({"offset": 3.0}, lambda x, v, z, w, t: 3.0),
    "gravity": (
        {"gravity": 3.0, "gravity_phase": 0.4}, lambda x, v, z, w, t: 3.0 * math.sin(MIDDLE + x + 0.4)),
    "spring": ({"spring": 3.0}, lambda x, v, z, w, t: 3.0 * x),
    "cubic": ({"cubic": 3.0}, lambda x, v, z, w, t: 3.0 * x**3),
    "bilinear": (
        {"bilinear": 3.0, "bilinear_place": 0.5}, lambda x, v, z, w, t: 3.0 * (x - 0.5) if x > 0.5 else 0.0),
    "stops": (
        {"stops": 3.0, "stops_place": 0.5},
        lambda x, v, z, w, t: 3.0 * (x - 0.5) if x > 0.5 else 3.0 * (x + 0.5) if x < -0.5 else 0.0),
    "presliding": ({"presliding": 3.0}, lambda x, v, z, w, t: 3.0 * z),
    "cogging": (
        {"cogging": 3.0, "cogging_wavenumber": 5.0, "cogging_phase": 0.4},
        lambda x, v, z, w, t: 3.0 * math.sin(5.0 * (MIDDLE + x) + 0.4)),
    "hysteresis": ({"hysteresis": 3.0}, lambda x, v, z, w, t: 3.0 * w),
    "thickening": ({"thickening": 3.0}, lambda x, v, z, w, t: math.copysign(3.0 * abs(v) ** 1.5, v)),
    "warming": ({"viscous": 3.0, "warming": 0.6}, lambda x, v, z, w, t: 3.0 * (1.0 - 0.6 * t) * v),
    "streaked": ({"streaked": 3.0}, lambda x, v, z, w, t: 3.0 * v * math.sin(1.5 * x) ** 2),
    "cable": ({"cable": 3.0}, lambda x, v, z, w, t: 3.0 * x**3 / 8.0 if x > 0 else 0.0),
    "shuttle": (
        {"shuttle": 3.0, "shuttle_place": 0.4}, lambda x, v, z, w, t: 3.0 if 0.7 < x < 0.9 and v > 0 else 0.0),
    "sag": ({"sag": 3.0}, lambda x, v, z, w, t: math.copysign(3.0 * math.sqrt(abs(x) / 2.0), x)),
}  # fmt: skip
"""Smooth forces against the motion at x from the middle, speed v, states z and w, and a share t of the record."""

LEVELS: dict[str, tuple[dict[str, float], Callable[[float, float, float], float]]] = {
    "coulomb": ({"coulomb": 3.0}, lambda x, v, rested: 3.0),
    "asymmetric": ({"coulomb": 3.0, "asymmetric": 0.8}, lambda x, v, rested: 3.8 if v > 0 else 2.2),
    "stribeck": (
        {"coulomb": 3.0, "stribeck": 2.0, "stribeck_speed": 0.5},
        lambda x, v, rested: 3.0 + 2.0 / (1.0 + (v / 0.5) ** 2)),
    "tilted": ({"coulomb": 3.0, "tilted": 0.8}, lambda x, v, rested: 3.0 + 0.4 * x),
    "bending": ({"bending": 3.0}, lambda x, v, rested: 3.0 * math.sin(1.5 * x) ** 2),
    "stick_growth": ({"stick_growth": 3.0}, lambda x, v, rested: 3.0 * math.log(1.0 + rested / 0.05)),
    "never driving": ({"coulomb": 3.0, "tilted": -80.0}, lambda x, v, rested: max(3.0 - 40.0 * x, 0.0)),
}  # fmt: skip
"""Levels of dry friction after a rest."""

ELSEWHERE = {
    "mass", "load", "stiffness", "damping", "play", "load_coulomb", "load_viscous", "breathing", "limit", "swing",
    "middle", "stroke", "stribeck_speed", "presliding_distance", "hysteresis_reach", "gravity_phase", "bilinear_place",
    "stops_place", "cogging_wavenumber", "cogging_phase", "breathing_wavenumber", "shuttle_place",
}  # fmt: skip
"""Of masses and what is between them, which the runs below check, and numbers that come with another field."""

PLACES = [-1.3, -0.6, -0.2, 0.3, 0.8, 1.4]
SPEEDS = [-0.7, 0.7]


def fields(values: dict[str, float]) -> np.ndarray:
    return np.array([{"middle": MIDDLE, "stroke": HALF, **values}.get(name, 0.0) for name in FIELDS])


def test_every_field_is_checked() -> None:
    assert set(FIELDS) == (set(FORCES) | set(LEVELS) | ELSEWHERE) - {"never driving"}


@pytest.mark.parametrize("name", FORCES)
def test_a_force_is_what_stands_on_paper(name: str) -> None:
    values, by_hand = FORCES[name]
    got = [_resisted(fields(values), MIDDLE + x, v, 0.2, -0.4, 0.25) for x in PLACES for v in SPEEDS]
    assert got == pytest.approx([by_hand(x, v, 0.2, -0.4, 0.25) for x in PLACES for v in SPEEDS], abs=1e-12)
    assert any(got)


@pytest.mark.parametrize("name", LEVELS)
def test_a_level_of_friction_is_what_stands_on_paper(name: str) -> None:
    values, by_hand = LEVELS[name]
    got = [_level(fields(values), MIDDLE + x, v, 0.2) for x in PLACES for v in SPEEDS]
    assert got == pytest.approx([by_hand(x, v, 0.2) for x in PLACES for v in SPEEDS], abs=1e-12)
    assert any(got)


def one_mass(y: np.ndarray, force: float, middle: float) -> list[float]:
    """A mass that varies, with drag, a spring and cogging."""
    left = force - 4.0 * y[1] - 50.0 * (y[0] - middle) ** 3 - 2.0 * np.sin(40.0 * y[0])
    varied = 0.5 * 3.0 * 0.3 * 20.0 * np.cos(20.0 * y[0]) * y[1] ** 2
    return [y[1], (left - varied) / (3.0 * (1.0 + 0.3 * np.sin(20.0 * y[0])))]


def two_masses(y: np.ndarray, force: float, middle: float) -> list[float]:
    """A motor of 2 kg and a load of 1 kg that drags, a spring of 80 N/m with damping and 2 cm of play between them."""
    gap = y[0] - y[2]
    pressed = 80.0 * (gap - math.copysign(0.01, gap)) + 0.4 * (y[1] - y[3])
    joint = 0.0 if abs(gap) <= 0.01 else max(pressed, 0.0) if gap > 0 else min(pressed, 0.0)
    return [y[1], (force - joint - 4.0 * y[1]) / 2.0, y[3], joint - 0.7 * y[3]]


def hanging(y: np.ndarray, force: float, middle: float) -> list[float]:
    """A mass of 3 kg and one of 1 kg that hangs on it: 40 N/m and 0.6 N s/m between the places of both."""
    between = 40.0 * (y[0] - y[2]) + 0.6 * (y[1] - y[3])
    return [y[1], (force - 4.0 * y[1] - between) / 3.0, y[3], between]


RUNS = {
    "one mass": (
        one_mass, 1,
        {"mass": 3.0, "viscous": 4.0, "cubic": 50.0, "cogging": 2.0, "cogging_wavenumber": 40.0, "breathing": 0.3,
         "breathing_wavenumber": 20.0}),
    "two masses": (
        two_masses, 2,
        {"mass": 2.0, "load": 1.0, "stiffness": 80.0, "damping": 0.4, "play": 0.02, "viscous": 4.0,
         "load_viscous": 0.7}),
    "hanging": (hanging, 2, {"mass": 3.0, "viscous": 4.0, "swing": 1.0}),
}  # fmt: skip


@pytest.mark.parametrize("name", RUNS)
def test_the_plant_agrees_with_scipy(name: str) -> None:
    """Under the same controller, its force held between its samples. Seed 1."""
    law, masses, values = RUNS[name]
    rate, n = 500.0, 1500
    wanted = 0.2 * reference("sines", n, 2.0, np.random.default_rng(1))
    run = simulate_plant(values, wanted, rate, (9e3, 3e2), steps=400)
    middle = 0.5 * (wanted.min() + wanted.max())
    state = [wanted[0], 0.0] * masses
    for k in range(n):
        found = solve_ivp(
            lambda t, y, force=run.force[k]: law(y, force, middle), (0.0, 1.0 / rate), state,
            t_eval=[0.5 / rate, 1.0 / rate], rtol=1e-9, atol=1e-12,
        ).y  # fmt: skip
        assert abs(found[0, 0] - run.q[k]) < 1e-4
        state = found[:, 1]


def test_a_force_that_comes_late_and_slowly_acts_so() -> None:
    """2 kg under a step of 3 N that acts 40 ms late behind a time constant τ of 0.1 s: x'' = 1.5 (1 - exp(-t/τ))."""
    wanted = np.where(np.arange(400) < 200, 0.0, 1.0)
    run = simulate_plant({"mass": 2.0, "limit": 3.0}, wanted, 1000.0, (1e9, 0.0), delay=40, lag=0.1, steps=20)
    begin = int(np.argmax(run.force != 0.0))
    assert np.all(run.force[begin:] == 3.0)
    t = np.maximum(run.t + 0.0005 - run.t[begin] - 0.04, 0.0)
    place = 1.5 * (0.5 * t**2 - 0.1 * t + 0.01 * (1.0 - np.exp(-t / 0.1)))
    np.testing.assert_allclose(run.q, place, atol=1e-5)


@pytest.mark.parametrize("swing", [0.1, 0.6, 3.0])
def test_a_load_that_swings_adds_its_mass_to_a_slow_drive(swing: float) -> None:
    """At 0.3 Hz the force over the acceleration is m + m_s/(1 - ω²/40), more than both masses."""
    t = np.arange(20_000) / 1000.0
    run = simulate_plant({"mass": 1.0, "swing": swing}, 0.1 * np.sin(0.6 * np.pi * t), 1000.0, (3600.0, 96.0))
    late = slice(10_000, None)
    motion = np.column_stack([np.sin(0.6 * np.pi * t[late]), np.cos(0.6 * np.pi * t[late])])
    # what is left of the swing's own oscillation from the start
    free = np.exp(-0.3 * t[late])[:, None] * np.column_stack([f(6.318 * t[late]) for f in (np.sin, np.cos)])
    place = np.linalg.lstsq(np.hstack([motion, free]), run.q[late], rcond=None)[0][:2]
    force = np.linalg.lstsq(np.hstack([motion, free]), run.force[late], rcond=None)[0][:2]
    apparent = float((force @ place) / (place @ place)) / -((0.6 * np.pi) ** 2)
    assert apparent > 1.0 + swing
    assert apparent == pytest.approx(1.0 + swing / (1.0 - (0.6 * np.pi) ** 2 / 40.0), rel=0.02)


def test_dry_friction_holds_what_is_below_it() -> None:
    """Behind a step that the controller cannot follow against it, the drive stays where it stopped."""
    wanted = np.concatenate([np.linspace(0.0, 0.01, 20), np.full(400, 0.01)])
    run = simulate_plant({"mass": 1.0, "coulomb": 5.0}, wanted, 1000.0, (1.0, 0.0), steps=50)
    assert np.ptp(run.q[-200:]) == 0.0
    assert abs(run.force[-1]) < 5.0


def test_friction_that_grows_at_rest_does_so_in_a_drive_without_other_friction() -> None:
    """Two strokes with a pause of half a second: the second one starts against more; how fine the steps are changes
    nothing. Seed 3."""
    wanted = 0.2 * reference("point_to_point", 6000, 3.0, np.random.default_rng(3))
    plain, grown, finer = (
        simulate_plant({"mass": 1.0, "stick_growth": size}, wanted, 1000.0, (3600.0, 96.0), steps=steps).force
        for size, steps in ((0.0, 20), (0.1, 20), (0.1, 60))
    )
    assert np.abs(grown - plain).max() > 0.15
    assert np.std(finer - grown) < 0.1 * np.std(grown - plain)
