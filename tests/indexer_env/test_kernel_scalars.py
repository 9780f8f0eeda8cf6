"""The kernels' scalar functions against formulas and derivatives worked out here."""

import math

import numpy as np
import pytest

from indexer_env.kernels import dynamics, edges, effects, joints, trigonometry

pytestmark = pytest.mark.unjitted

INFINITY = math.inf


# -------------------------------------------------------------------------------- joints


@pytest.mark.parametrize(
    ("deflection", "rate", "region"),
    [(0.2, 0.0, 1.0), (0.1, 0.0, 1.0), (0.0999, 0.0, 0.0), (0.0, 5.0, 0.0), (-0.1, 0.0, -1.0), (-0.3, 1.0, -1.0)],
)
def test_regions_of_a_joint_with_play(deflection, rate, region):
    shape = (0.1, 0.0, 0.0, 0.0, 0.0)
    assert joints.region_of(deflection, rate, *shape) == region
    assert joints.region_guard(region, deflection, rate, *shape) >= 0.0
    for other in {1.0, 0.0, -1.0} - {region}:
        assert joints.region_guard(other, deflection, rate, *shape) <= 0.0


@pytest.mark.parametrize("cubic", [0.0, 700.0])
@pytest.mark.parametrize("rate", [-1.0, -0.2, 0.0, 1.0])
def test_a_clipped_flank_lets_go_where_it_would_pull(cubic, rate):
    """The depth is what is left of the push over k: x + (k_c/k) x³ + (r/k) δ̇, δ̇ counted on the way out alone."""
    k, r, edge, ratio = 50.0, 3.0, 0.1, 0.6
    for x in (-0.05, 0.01, 0.05, 0.2):
        push = k * x + cubic * x**3 + r * min(rate, 0.0)
        depth = joints.penetration_plus(edge + x, rate, edge, r / k, cubic / k)
        assert depth == pytest.approx(push / k, rel=1e-12)
        push = ratio * k * x + cubic * x**3 + r * min(rate, 0.0)
        depth = joints.penetration_minus(-edge - x, -rate, edge, r / (ratio * k), cubic / (ratio * k))
        assert depth == pytest.approx(push / (ratio * k), rel=1e-12)
    region = joints.region_of(edge + 0.01, rate, edge, r / k, cubic / k, r / (ratio * k), cubic / (ratio * k))
    assert region == (0.0 if k * 0.01 + cubic * 1e-6 + r * min(rate, 0.0) < 0.0 else 1.0)


def test_without_play_contact_passes_from_flank_to_flank():
    assert joints.region_after(1.0, 0.0, 0.0) == -1.0 and joints.region_after(-1.0, 0.0, 0.0) == 1.0
    assert joints.region_after(1.0, 0.1, 0.1) == 0.0 and joints.region_after(-1.0, -0.1, 0.1) == 0.0
    assert joints.region_after(0.0, 0.1, 0.1) == 1.0 and joints.region_after(0.0, -0.1, 0.1) == -1.0


@pytest.mark.parametrize("cubic", [0.0, 700.0])
def test_the_line_of_a_region_is_the_formula(cubic):
    k, r, edge, ratio, v = 50.0, 3.0, 0.1, 0.6, 0.7
    for region, deflection, stiffness, x in ((1.0, 0.25, k, 0.15), (-1.0, -0.3, ratio * k, -0.2)):
        line = joints.region_line(region, k, r, edge, ratio, 0.0)
        expected = stiffness * x + cubic * x**3 + r * v
        assert joints.line_torque(*line, deflection, v, cubic) == pytest.approx(expected, rel=1e-14)
    for free_damping in (0.0, r):
        line = joints.region_line(0.0, k, r, edge, ratio, free_damping)
        assert joints.line_torque(*line, 0.05, v, 0.0) == pytest.approx(free_damping * v)
    assert joints.region_line(1.0, k, r, -INFINITY, 1.0, 0.0) == (k, 0.0, r)


# -------------------------------------------------------------------------------- effects


def slope(function, x: float, step: float = 1e-5) -> float:
    return (function(x + step) - function(x - step)) / (2.0 * step)


@pytest.mark.parametrize("phase", [0.20, 0.25, 0.27, 0.299])
def test_a_bump_and_its_derivatives(phase):
    centre, width = 0.25, 0.05
    y = (phase - centre) / width
    height, first, second = effects.bump(phase, centre, width)
    assert height == pytest.approx((1.0 - y**2) ** 4, rel=1e-9, abs=1e-15)
    assert first == pytest.approx(width * slope(lambda p: effects.bump(p, centre, width)[0], phase), abs=1e-6)
    assert second == pytest.approx(width * slope(lambda p: effects.bump(p, centre, width)[1], phase), abs=1e-4)


def test_a_bump_is_periodic_and_ends():
    assert effects.bump(0.31, 0.25, 0.05) == (0.0, 0.0, 0.0)
    for turns in (1.0, -1.0, 7.0):
        np.testing.assert_allclose(effects.bump(0.98 + turns, 0.01, 0.05), effects.bump(0.98, 0.01, 0.05), atol=1e-10)
    assert effects.bump(0.98, 0.01, 0.05)[0] > 0.1


def test_a_harmonic_and_its_time_derivatives():
    """Of a shaft that speeds up: γ = 1.3 + 157 t + 40 t²."""
    amplitude, order, phase = 0.02, 3.0, 0.4

    def at(t: float) -> tuple[float, float, float]:
        return effects.harmonic(1.3 + 157.0 * t + 40.0 * t * t, 157.0 + 80.0 * t, 80.0, amplitude, order, phase)

    angle, rate, acceleration = at(0.01)
    assert angle == pytest.approx(amplitude * math.sin(order * (1.3 + 1.57 + 0.004) + phase), rel=1e-13)
    assert rate == pytest.approx(slope(lambda t: at(t)[0], 0.01, 1e-6), rel=1e-6)
    assert acceleration == pytest.approx(slope(lambda t: at(t)[1], 0.01, 1e-6), rel=1e-6)


@pytest.mark.parametrize("rate", [-2.0, -1e-3, 0.0, 1e-3, 0.1, 2.0])
def test_friction_s_parts_are_their_formulas_and_odd(rate):
    s, q = rate / 0.005, rate / 0.01
    coulomb = 20.0 * s / math.hypot(1.0, s)
    assert effects.coulomb_torque(rate, 20.0, 0.005) == pytest.approx(coulomb, rel=1e-13, abs=1e-300)
    stribeck = 10.0 / (1.0 + (rate / 0.1) ** 2) * q / math.hypot(1.0, q)
    assert effects.stribeck_torque(rate, 10.0, 0.1, 0.01) == pytest.approx(stribeck, rel=1e-13, abs=1e-300)
    assert effects.coulomb_torque(-rate, 20.0, 0.005) == -effects.coulomb_torque(rate, 20.0, 0.005)
    assert effects.stribeck_torque(-rate, 5.0, 0.1, 0.01) == -effects.stribeck_torque(rate, 5.0, 0.1, 0.01)


@pytest.mark.parametrize("scale", [1.0, 1e3, 1.5e6])
def test_sine_and_cosine_are_the_true_ones(scale):
    """Against extended precision, at random angles (seed 3) and at quarter turns, where one all but vanishes."""
    quarters = np.round(np.linspace(-scale, scale, 41)) * math.pi / 2.0
    for angle in (*np.random.default_rng(3).uniform(-scale, scale, 500).tolist(), *quarters.tolist()):
        sine, cosine = trigonometry.sine_and_cosine(angle)
        exact = np.longdouble(angle)
        assert abs(sine - np.sin(exact)) < 2e-16 and abs(cosine - np.cos(exact)) < 2e-16


def test_a_sine_is_odd_and_its_square_is_the_cosine_s_complement():
    for angle in np.random.default_rng(4).uniform(-4e3, 4e3, 300).tolist():
        sine, cosine = trigonometry.sine_and_cosine(angle)
        assert trigonometry.sine_and_cosine(-angle) == (-sine, cosine)
        assert sine * sine + cosine * cosine == pytest.approx(1.0, abs=5e-16)
    assert trigonometry.sine_and_cosine(0.0) == (0.0, 1.0)


def test_an_imbalance_acts_once_a_turn():
    assert effects.imbalance_torque(1.1, 30.0, 0.4) == pytest.approx(30.0 * math.sin(1.5), rel=1e-14)


def test_mesh_and_slip():
    assert effects.mesh_factor(1.3, 0.2, 2.0, 0.5) == pytest.approx(1.0 + 0.2 * math.cos(3.1), rel=1e-14)
    assert effects.slip_acceleration(157.0, 155.0, 4.0, 0.3, 0.01) == pytest.approx((0.5 - 0.3) / 0.01, rel=1e-12)


# -------------------------------------------------------------------------------- dynamics


def test_a_law_piece_and_its_derivatives():
    coefficients = (0.3, -0.7, 1.1, 0.4, -0.2, 0.05)
    value, first, second = dynamics.follower_law(0.6, *coefficients)
    polynomial = np.polynomial.Polynomial(coefficients)
    np.testing.assert_allclose(
        (value, first, second), [polynomial(0.6), polynomial.deriv()(0.6), polynomial.deriv(2)(0.6)], rtol=1e-14
    )


def test_accelerations_obey_the_equations_of_motion():
    """docs/explanation/physics.md, section The machine, each row put together here."""
    J_C, J_F, J_b, b1, b2, w, M1, M2, M3 = 0.5, 0.3, 20.0, 0.44, -0.9, 6.1, 55.0, -230.0, 410.0
    assert dynamics.table_acceleration(5.0, 2.0, -100.0) == pytest.approx(98.0 / 5.0, rel=1e-15)

    a = dynamics.cam_acceleration(J_C, J_F, b1, b2, w, M1, M2)
    assert (J_C + J_F * b1**2) * a == pytest.approx(M1 + b1 * (M2 - J_F * b2 * w**2), rel=1e-13)

    a, h = dynamics.cam_and_housing_acceleration(J_C, J_F, J_b, b1, b2, w, M1, M2, M3)
    row_1 = (J_C + J_F * b1**2) * a + J_F * b1 * h - (M1 + b1 * M2 - J_F * b1 * b2 * w**2)
    row_2 = J_F * b1 * a + (J_F + J_b) * h - (M2 - M3 - J_F * b2 * w**2)
    assert abs(row_1) < 1e-11 and abs(row_2) < 1e-11


def test_a_heavy_base_stands_still():
    """J_b → ∞ is Model B."""
    arguments = (0.44, -0.9, 6.1, 55.0, -230.0)
    b = dynamics.cam_acceleration(0.5, 0.3, *arguments)
    on_base, housing = dynamics.cam_and_housing_acceleration(0.5, 0.3, 1e12, *arguments, 410.0)
    assert on_base == pytest.approx(b, rel=1e-9) and abs(housing) < 1e-8


# -------------------------------------------------------------------------------- edges


def test_the_interpolant_meets_values_rates_and_accelerations_and_quintics_exactly():
    quintic = np.polynomial.Polynomial((0.2, -1.0, 3.0, 0.7, -5.0, 2.0))
    rate, acceleration = quintic.deriv(), quintic.deriv(2)
    h = 0.3
    ends = [float(each(time)) for time in (0.0, h) for each in (quintic, rate, acceleration)]
    c = edges.hermite(h, *ends)
    for share in (0.0, 0.21, 0.5, 1.0):
        assert edges.value(share, ends[0], *c) == pytest.approx(quintic(share * h), rel=1e-12)
        assert edges.slope(share, *c) / h == pytest.approx(rate(share * h), rel=1e-12)


def test_the_bracket_always_holds_the_root_and_closes():
    def guard(s: float) -> float:
        return math.expm1(-30.0 * (s - 0.87))  # steep on one side: plain false position would creep

    s0, g0, s1, g1, side = 0.0, guard(0.0), 1.0, guard(1.0), 0.0
    for _ in range(edges._SEARCHES):
        s = edges.false_position(s0, g0, s1, g1)
        assert s0 < s < s1
        s0, g0, s1, g1, side = edges.narrow(s0, g0, s1, g1, s, guard(s), side)
        assert s0 <= 0.87 <= s1
        if abs(guard(s)) < 1e-12:
            break
    assert s == pytest.approx(0.87, abs=1e-10)


def test_the_sine_alone_is_the_sine():
    """Angles drawn with seed 5, up to 1e6 rad."""
    rng = np.random.default_rng(5)
    for angle in (rng.uniform(-1.0, 1.0, 2000) * 10.0 ** rng.uniform(-3.0, 6.0, 2000)).tolist():
        assert trigonometry.sine_alone(angle) == pytest.approx(math.sin(angle), rel=0, abs=4e-16)
