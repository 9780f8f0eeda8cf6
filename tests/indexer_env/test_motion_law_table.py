"""The user's table as a motion law: how well it follows a known law, how it dwells, and what it refuses."""

import copy
import math
import pickle

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from indexer_env.errors import ParameterError
from indexer_env.motion_law import TableLaw, motion_law

TURN = 2.0 * math.pi
STEP = TURN / 8  # one of eight stations


def sampled(u: np.ndarray, name: str = "modified_sine", start: float = 0.0, digits: int | None = None) -> TableLaw:
    """A named law that moves over half a turn from phase `start`, as a table at phases u, rounded in
    degrees."""
    beta = motion_law(name).evaluate(TURN * (u - start), 8, 0.5)[0]
    if digits is not None:
        beta = np.radians(np.round(np.degrees(beta), digits))
    return TableLaw(tuple(TURN * u), tuple(beta))


def shaped(rise, points: int = 361) -> TableLaw:
    u = np.linspace(0.0, 1.0, points)
    return TableLaw(tuple(TURN * u), tuple(STEP * rise(np.minimum(2.0 * u, 1.0))))


def errors(table: TableLaw, name: str, start: float = 0.0) -> list[float]:
    """Largest errors of beta, beta', beta'' over two turns, each over the peak of the true one."""
    angle = np.linspace(-TURN, TURN, 30_011)
    true = motion_law(name).evaluate(angle - TURN * start, 8, 0.5)
    got = table.evaluate(angle, 8)
    return [float(np.abs(a - b).max() / np.abs(b).max()) for a, b in zip(got, true, strict=True)]


# Measured, whatever the start: 2.2e-10, 9.2e-8, 3.4e-5 for the two laws whose fourth derivative jumps; 2e-14,
# 5e-12, 2e-9 for the cycloidal; rounding for the 3-4-5, which one quintic holds.
@pytest.mark.parametrize(
    ("name", "limits"),
    [
        ("modified_sine", (5e-10, 2e-7, 5e-5)),
        ("modified_trapezoid", (5e-10, 2e-7, 5e-5)),
        ("cycloidal", (1e-13, 2e-11, 5e-9)),
        ("polynomial_345", (1e-14, 1e-12, 2e-10)),
    ],
)
@pytest.mark.parametrize("start", [0.0, 0.25, 0.7])
def test_a_table_of_361_points_is_the_law(name: str, limits: tuple[float, ...], start: float) -> None:
    table = sampled(np.linspace(0.0, 1.0, 361), name, start)
    assert table.check(8) == []
    assert all(error < limit for error, limit in zip(errors(table, name, start), limits, strict=True))


def test_more_points_come_nearer() -> None:
    coarse, fine = (errors(sampled(np.linspace(0.0, 1.0, n)), "modified_sine") for n in (91, 721))
    assert all(8.0 * b < a for a, b in zip(coarse, fine, strict=True))


@settings(deadline=None, max_examples=25)
@given(seed=st.integers(0, 2**32 - 1), start=st.floats(0.0, 0.99))
def test_uneven_points_serve_as_well(seed: int, start: float) -> None:
    gaps = np.random.default_rng(seed).uniform(0.4, 1.6, 360)
    inner = np.append(start, start + 0.5) % 1.0  # a table names where its motion meets the dwell
    u = np.unique(np.concatenate([[0.0], np.cumsum(gaps)[:-1] / gaps.sum(), [1.0]]))
    u = u[np.abs(u[:, None] - inner).min(axis=1) > 1e-3]
    u = np.unique(np.concatenate([[0.0], u, inner[inner > 1e-3], [1.0]]))
    error = errors(sampled(u, start=start), "modified_sine", start)
    assert error[0] < 1e-6 and error[1] < 1e-4 and error[2] < 1e-2


@pytest.mark.parametrize("start", [0.0, 0.3, 0.5, 0.75])
def test_the_dwell_does_not_ring(start: float) -> None:
    table = sampled(np.linspace(0.0, 1.0, 361), start=start)
    _, beta1, beta2 = table.evaluate(TURN * (start + np.linspace(0.5, 1.0, 1001)[1:-1]), 8)
    assert not beta1.any() and not beta2.any()
    pieces = table.pieces(8)
    ends = {round(float(u), 12) % 1.0 for u in pieces.edges[pieces.breaks]}
    assert ends == {start, (start + 0.5) % 1.0}


def test_two_points_are_enough_for_a_dwell() -> None:
    u = np.append(np.linspace(0.0, 0.5, 181), 1.0)
    assert errors(sampled(u), "modified_sine")[2] < 5e-5


def test_pieces_are_what_evaluate_gives() -> None:
    table = sampled(np.linspace(0.0, 1.0, 181), start=0.75)
    phase = np.random.default_rng(2).uniform(0.0, 1.0, 1000)
    pieces = table.pieces(8, 0.123)  # a table defines its own dwell and ignores the share
    assert pieces is table.pieces(8, 0.9)
    for order, (got, want) in enumerate(zip(pieces.evaluate(phase), table.evaluate(TURN * phase, 8), strict=True)):
        np.testing.assert_allclose(got, want * TURN**order, rtol=1e-9, atol=1e-9)


def test_a_motion_without_dwell_is_periodic_and_smooth() -> None:
    u = np.linspace(0.0, 1.0, 181)
    table = TableLaw(tuple(TURN * u), tuple(STEP * (u + 0.1 * np.sin(TURN * u))))
    assert table.check(8) == []
    assert not table.pieces(8).breaks.any()
    angle = np.linspace(-9.0, 9.0, 5001)
    beta, beta1, beta2 = table.evaluate(angle, 8)
    np.testing.assert_allclose(beta, STEP * (angle / TURN + 0.1 * np.sin(angle)), atol=1e-11)
    np.testing.assert_allclose(beta1, STEP * (1 / TURN + 0.1 * np.cos(angle)), atol=1e-9)
    np.testing.assert_allclose(beta2, -STEP * 0.1 * np.sin(angle), atol=1e-6)


def test_two_equal_points_beside_a_turning_point_are_no_dwell() -> None:
    turning = math.acos(-1.0 / (0.3 * TURN)) / TURN  # where u + 0.3 sin(2 pi u) is highest
    low, high = turning + 0.01, turning + 0.03
    level = turning - 0.02 + 0.3 * math.sin(TURN * (turning - 0.02))
    for _ in range(60):
        middle = 0.5 * (low + high)
        low, high = (middle, high) if middle + 0.3 * math.sin(TURN * middle) > level else (low, middle)
    u = np.linspace(0.0, 1.0, 73)
    u = u[np.abs(u - turning) > 0.025]
    u = np.sort(np.append(u, [turning - 0.02, high]))
    rise = u + 0.3 * np.sin(TURN * u)
    rise[u == high] = level
    table = TableLaw(tuple(TURN * u), tuple(STEP * rise))
    assert not table.pieces(8).breaks.any()
    peak = table.evaluate(TURN * turning, 8)[0]
    assert peak == pytest.approx(STEP * (turning + 0.3 * math.sin(TURN * turning)), abs=1e-6)


def test_two_motions_in_one_turn() -> None:
    u = np.linspace(0.0, 1.0, 361)
    law = motion_law("cycloidal")
    beta = law.evaluate(2.0 * TURN * u, 16, 0.5)[0]  # two half steps, each followed by a dwell
    table = TableLaw(tuple(TURN * u), tuple(beta))
    assert table.check(8) == []
    angle = np.linspace(0.0, TURN, 4001)
    np.testing.assert_allclose(table.evaluate(angle, 8)[0], law.evaluate(2.0 * angle, 16, 0.5)[0], atol=1e-9)
    assert table.pieces(8).breaks.sum() == 5


def test_peaks_are_those_of_the_sampled_law() -> None:
    for start in (0.0, 0.75):
        got = sampled(np.linspace(0.0, 1.0, 721), start=start).peaks()
        assert tuple(got) == pytest.approx(tuple(motion_law("modified_sine").peaks()), rel=1e-4)


def test_an_offset_stays_and_an_advance_rounded_to_two_digits_closes() -> None:
    u = np.linspace(0.0, 1.0, 181)
    rise = motion_law("modified_sine").evaluate(TURN * u, 1, 0.5)[0] / TURN
    table = TableLaw(tuple(TURN * u), tuple(np.radians(30.0 + 51.43 * rise)))
    beta = table.evaluate(np.array([0.0, TURN, 7 * TURN]), 7)[0]
    np.testing.assert_allclose(np.degrees(beta), 30.0 + np.array([0.0, 360.0 / 7.0, 360.0]), rtol=1e-14)


def test_a_table_is_a_value() -> None:
    table = sampled(np.linspace(0.0, 1.0, 49))
    for twin in (copy.deepcopy(table), pickle.loads(pickle.dumps(table)), sampled(np.linspace(0.0, 1.0, 49))):
        assert twin == table and hash(twin) == hash(table)
    assert table != sampled(np.linspace(0.0, 1.0, 50))


U = np.linspace(0.0, 1.0, 13)
GOOD = tuple(TURN * U), tuple(STEP * np.clip(2.0 * U, 0.0, 1.0))


@pytest.mark.parametrize(
    ("cam", "follower", "says"),
    [
        (GOOD[0][:-1], GOOD[1], r"follower_angle must be as long as cam_angle, 12 points, got 13"),
        (GOOD[0][::2], GOOD[1][::2], r"cam_angle must be given at 8 points or more, got 7; one point per"),
        (
            (*GOOD[0][:5], math.nan, *GOOD[0][6:]),
            GOOD[1],
            r"cam_angle\[5\] must be a finite number rad, got nan",
        ),
        (GOOD[0], (*GOOD[1][:-1], "x"), r"follower_angle\[12\] must be a finite number rad, got 'x'"),
        (GOOD[0], 3.0, r"follower_angle must be a row of numbers in rad, got 3\.0"),
        (
            (*GOOD[0][:5], GOOD[0][4], *GOOD[0][6:]),
            GOOD[1],
            r"cam_angle must be strictly ascending, in deg, got \[",
        ),
        (GOOD[1], GOOD[0], r"strictly ascending.*columns are not swapped"),
        (
            tuple(np.degrees(GOOD[0])),
            GOOD[1],
            r"cam_angle must be from 0 to 360 deg, got .*degrees are not taken",
        ),
        (tuple(np.array(GOOD[0]) + 0.1), GOOD[1], r"cam_angle must be from 0 to 360 deg, got \[5\.72"),
        (
            GOOD[0],
            tuple(-np.array(GOOD[1])),
            r"higher at the end .* in deg, got \[-0\.0, -45\.0\]; change all signs",
        ),
    ],
)
def test_a_malformed_table_is_refused_in_one_sentence(cam, follower, says: str) -> None:
    with pytest.raises(ParameterError, match=rf"^TableLaw\.(?=.*{says}).*\.$"):
        TableLaw(cam, follower)


def test_a_table_that_does_not_close_is_refused_with_both_angles() -> None:
    table = sampled(np.linspace(0.0, 1.0, 181))
    sentence = r"^TableLaw\.follower_angle must be advancing 60 deg per cam turn \(6 stations\), got 45\.0; .+\.$"
    for call in (table.check, table.pieces, lambda stations: table.evaluate(0.0, stations)):
        with pytest.raises(ParameterError, match=sentence):
            call(6)
    for stations in (0, 8.0):
        with pytest.raises(ParameterError, match=r"^TableLaw\.stations must be a whole number >= 1"):
            table.pieces(stations)
    with pytest.raises(ParameterError, match=r"^TableLaw\.cam_angle must be finite"):
        table.evaluate(math.nan, 8)


def test_a_jump_of_velocity_is_refused() -> None:
    for points in (17, 49, 361):
        with pytest.raises(ParameterError, match=r"jump of the velocity at the edge of the dwell, 0 deg .*100 %"):
            shaped(lambda s: s, points).check(8)


def test_a_jump_of_acceleration_is_reported_at_both_ends() -> None:
    said = shaped(lambda s: 0.5 - 0.5 * np.cos(math.pi * s)).check(8)
    assert len(said) == 2
    assert "jump of the acceleration at the edge of the dwell, 0 deg" in said[0]
    assert "180 deg" in said[1]


def test_rounding_is_measured_reported_and_refused_when_it_dominates() -> None:
    u = np.linspace(0.0, 1.0, 361)
    assert sampled(u, digits=6).check(8) == []
    (said,) = sampled(u, digits=4).check(8)
    assert "smooth to 1 %" in said and "noise near 6 %" in said and "more digits" in said
    assert 0.02 < errors(sampled(u, digits=4), "modified_sine")[2] < 0.1  # what the sentence claims
    with pytest.raises(ParameterError, match=r"noise near 100 % of the peak acceleration"):
        sampled(u, digits=2).pieces(8)
    for name in ("modified_sine", "cycloidal"):
        with pytest.raises(ParameterError, match=r"noise near 100 % of the peak acceleration"):
            sampled(np.linspace(0.0, 1.0, 3601), name, digits=3).pieces(8)


@pytest.mark.parametrize("at", [43, 90, 144])
def test_a_stray_point_is_named(at: int) -> None:
    law = sampled(np.linspace(0.0, 1.0, 361))
    for degrees, refused in ((0.001, False), (0.1, True)):
        beta = list(law.follower_angle)
        beta[at] += math.radians(degrees)
        table = TableLaw(law.cam_angle, tuple(beta))
        if refused:
            with pytest.raises(ParameterError, match=rf"stray point at {at} deg of the cam"):
                table.check(8)
        else:
            (said,) = table.check(8)
            assert f"stray point at {at} deg" in said


def test_few_points_and_a_follower_that_turns_back_are_reported() -> None:
    (said,) = sampled(np.linspace(0.0, 1.0, 17)).check(8)
    assert "12 intervals or more in the motion from 0 to 180 deg of the cam, got 8" in said
    u = np.linspace(0.0, 1.0, 181)
    (said,) = TableLaw(tuple(TURN * u), tuple(STEP * (u + 0.3 * np.sin(TURN * u)))).check(8)
    assert "rising throughout" in said and "falling steps" in said


def test_an_overshoot_between_points_is_reported_and_refused() -> None:
    beta = np.radians([0, 0, 0, 0, 0, 0, 1, 22, 44, 45, 45, 45, 45, 45, 45, 45, 45])
    (coarse, said) = TableLaw(tuple(np.linspace(0.0, TURN, 17)), tuple(beta)).check(8)
    assert "12 intervals" in coarse and "to keep between its points" in said
    beta = np.radians([0, 0, 0, 0, 0, 0, 1, 3, 43, 45, 45, 45, 45, 45, 45, 45, 45])
    with pytest.raises(ParameterError, match=r"keep between its points, got 'an overshoot of"):
        TableLaw(tuple(np.linspace(0.0, TURN, 17)), tuple(beta)).pieces(8)
