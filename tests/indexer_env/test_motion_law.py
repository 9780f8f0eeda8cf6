"""The four named laws: published peaks, derivatives, dwell, turns, and the pieces the kernel reads."""

import copy
import math
import pickle

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from indexer_env.errors import ParameterError
from indexer_env.motion_law import MOTION_LAWS, LawPieces, MotionLaw, RiseLaw, TableLaw, motion_law

RISES = ["modified_sine", "modified_trapezoid", "cycloidal", "polynomial_345"]
# Cv, Ca, Cj and jerk at mid-point as printed in the project's design page, section 3.
DESIGN = {
    "modified_sine": (1.7596, 5.5280, 69.47, -23.16),
    "modified_trapezoid": (2.0000, 4.8881, 61.43, -61.43),
    "cycloidal": (2.0000, 6.2832, 39.48, -39.48),
    "polynomial_345": (1.8750, 5.7735, 60.0, -30.0),
}
TURN = 2.0 * math.pi


def rise_law(name: str) -> RiseLaw:
    law = motion_law(name)
    assert isinstance(law, RiseLaw)
    return law


@pytest.mark.parametrize("name", RISES)
def test_peaks_are_those_of_the_design_table(name: str) -> None:
    cv, ca, cj, middle = rise_law(name).peaks()
    assert (cv, ca) == pytest.approx(DESIGN[name][:2], abs=1e-4)
    assert (cj, middle) == pytest.approx(DESIGN[name][2:], abs=6e-3)


@pytest.mark.parametrize("name", RISES)
def test_peaks_are_those_of_the_rise(name: str) -> None:
    law = rise_law(name)
    _, v, a, j = law.rise(np.linspace(0.0, 1.0, 160001))
    found = (*(np.abs(x).max() for x in (v, a, j)), law.rise(0.5)[3])
    assert found == pytest.approx(tuple(law.peaks()), rel=1e-9)


@pytest.mark.parametrize("name", RISES)
def test_rise_starts_and_ends_at_rest_and_is_symmetric(name: str) -> None:
    law = rise_law(name)
    s = np.arange(129) / 128
    y, v, a, j = law.rise(s)
    assert (y[0], y[-1], y[64]) == (0.0, 1.0, pytest.approx(0.5, abs=1e-15))
    assert np.abs([v[0], v[-1], a[0], a[-1], a[64]]).max() < 1e-14
    np.testing.assert_array_equal(v, v[::-1])
    assert np.abs(y + y[::-1] - 1.0).max() < 2e-16
    assert np.abs(a + a[::-1]).max() < 1e-14
    np.testing.assert_array_equal(j, j[::-1])


@pytest.mark.parametrize("name", RISES)
def test_rise_derivatives_agree_with_richardson_differences(name: str) -> None:
    law = rise_law(name)
    step = 1e-3
    s = np.linspace(0.0, 1.0, 1601)
    joints = np.array([0.0, *law.junctions, 0.5, 1.0])
    s = s[np.abs(s[:, None] - joints).min(axis=1) > 2.1 * step]  # the stencil stays within one formula
    value = law.rise(s)
    for order in range(3):

        def central(h: float, order: int = order) -> np.ndarray:
            return (law.rise(s + h)[order] - law.rise(s - h)[order]) / (2.0 * h)

        richardson = (4.0 * central(step) - central(2.0 * step)) / 3.0
        assert np.abs(richardson - value[order + 1]).max() < 2e-8 * np.abs(value[order + 1]).max()


@pytest.mark.parametrize("name", RISES)
def test_rise_is_continuous_across_its_junctions(name: str) -> None:
    law = rise_law(name)
    for joint in (*law.junctions, 0.5):
        before, after = law.rise(np.nextafter([joint, joint], [0.0, 1.0]))[0:4], law.rise(joint)
        for order in range(4):
            assert np.abs(before[order] - after[order]).max() < 1e-11


@pytest.mark.parametrize("name", RISES)
@pytest.mark.parametrize("share", [0.25, 1 / 3, 0.5, 1.0])
def test_evaluate_scales_the_rise(name: str, share: float) -> None:
    law = rise_law(name)
    stations = 6
    s = np.linspace(0.0, 0.999, 77)
    y, v, a, _ = law.rise(s)
    advance = TURN / stations
    beta, beta1, beta2 = law.evaluate(TURN * share * s, stations, share)
    np.testing.assert_allclose(beta, advance * y, atol=1e-15)
    np.testing.assert_allclose(beta1, advance * v / (TURN * share), atol=1e-13)
    np.testing.assert_allclose(beta2, advance * a / (TURN * share) ** 2, atol=1e-12)


@pytest.mark.parametrize("name", RISES)
def test_dwell_is_exactly_still_and_the_turn_closes(name: str) -> None:
    law = rise_law(name)
    beta, beta1, beta2 = law.evaluate(TURN * np.linspace(0.5001, 0.9999, 33), 8, 0.5)
    assert (beta == TURN / 8).all()
    assert not beta1.any() and not beta2.any()
    assert law.evaluate(8 * TURN, 8, 0.5)[0] == pytest.approx(TURN, rel=1e-15)


@pytest.mark.parametrize("name", RISES)
@settings(deadline=None)
@given(
    phase=st.floats(0.0, 1.0),
    turns=st.integers(-50, 50),
    stations=st.integers(1, 36),
    share=st.floats(0.05, 1.0),
)
def test_every_turn_repeats_one_station_further(
    name: str, phase: float, turns: int, stations: int, share: float
) -> None:
    law = rise_law(name)
    first = law.evaluate(TURN * phase, stations, share)
    later = law.evaluate(TURN * (phase + turns), stations, share)
    scale = law.peaks()
    rounding = 1e-13 / share  # of s, from a cam angle of fifty turns
    assert later[0] - first[0] == pytest.approx(TURN / stations * turns, abs=1e-13 + TURN * 2 * rounding)
    assert later[1] == pytest.approx(first[1], abs=scale.acceleration * rounding / share)
    assert later[2] == pytest.approx(first[2], abs=scale.jerk * rounding / share**2)


@pytest.mark.parametrize("name", RISES)
def test_negative_angles_and_the_turn_end_are_continuous(name: str) -> None:
    law = rise_law(name)
    for whole in (-3, -1, 0, 2):
        around = TURN * whole + np.array([-1e-9, -1e-300, 0.0, 1e-9])
        beta, beta1, _ = law.evaluate(around, 8, 1.0)
        assert np.abs(beta - TURN / 8 * whole).max() < 1e-14
        assert np.abs(beta1).max() < 1e-14
    assert law.evaluate(-0.75 * TURN, 8, 0.5)[0] == pytest.approx(-TURN / 16, abs=1e-15)


def test_shapes_follow_the_cam_angle() -> None:
    law = motion_law("modified_sine")
    for angle in (1.0, np.zeros(3), np.zeros((2, 5))):
        assert {np.shape(part) for part in law.evaluate(angle, 8, 0.5)} == {np.shape(angle)}


@pytest.mark.parametrize("name", RISES)
@pytest.mark.parametrize(("stations", "share"), [(8, 0.5), (6, 1 / 3), (12, 0.9), (4, 1.0)])
def test_pieces_are_the_law(name: str, stations: int, share: float) -> None:
    law = rise_law(name)
    phase = np.random.default_rng(4).uniform(0.0, 1.0, 20_000)
    beta, beta1, beta2 = law.evaluate(TURN * phase, stations, share)
    got, got1, got2 = law.pieces(stations, share).evaluate(phase)
    assert np.abs(got - beta).max() < 1e-11 * np.abs(beta).max()
    assert np.abs(got1 / TURN - beta1).max() < 1e-9 * np.abs(beta1).max()
    assert np.abs(got2 / TURN**2 - beta2).max() < 1e-7 * np.abs(beta2).max()


@pytest.mark.parametrize("name", RISES)
@pytest.mark.parametrize("share", [0.5, 1 / 3, 1.0])
def test_pieces_join_up_to_the_second_derivative(name: str, share: float) -> None:
    pieces = rise_law(name).pieces(8, share)
    left, width = pieces.coefficients, np.diff(pieces.edges)
    right = np.roll(left, -1, axis=0)
    right[-1, 0] += TURN / 8
    powers = width[:, None] ** np.arange(6)
    end = (left * powers).sum(axis=1)
    end1 = (left[:, 1:] * np.arange(1, 6) * powers[:, :5]).sum(axis=1)
    end2 = (left[:, 2:] * np.array([2, 6, 12, 20]) * powers[:, :4]).sum(axis=1)
    assert np.abs(end - right[:, 0]).max() < 1e-14
    assert np.abs(end1 - right[:, 1]).max() < 1e-12
    assert np.abs(end2 - 2.0 * right[:, 2]).max() < 1e-8


def test_breaks_are_the_ends_of_the_motion_and_the_junctions() -> None:
    def places(name: str, share: float) -> list[float]:
        pieces = motion_law(name).pieces(8, share)
        return list(pieces.edges[pieces.breaks])

    assert places("modified_sine", 0.5) == [0.0, 1 / 16, 7 / 16, 0.5, 1.0]
    assert places("modified_trapezoid", 1.0) == [0.0, 1 / 8, 3 / 8, 5 / 8, 7 / 8, 1.0]
    assert places("cycloidal", 0.25) == [0.0, 0.25, 1.0]
    assert places("polynomial_345", 1.0) == [0.0, 1.0]


def test_the_dwell_is_one_constant_piece() -> None:
    pieces = motion_law("cycloidal").pieces(8, 0.4)
    assert list(pieces.edges[-2:]) == [0.4, 1.0]
    assert list(pieces.coefficients[-1]) == [TURN / 8, 0.0, 0.0, 0.0, 0.0, 0.0]


def test_pieces_are_cached_and_read_only() -> None:
    pieces = motion_law("modified_sine").pieces(8, 0.5)
    assert motion_law("modified_sine").pieces(8, 0.5) is pieces
    for own in (pieces, copy.deepcopy(pieces), pickle.loads(pickle.dumps(pieces))):
        for array in (own.edges, own.coefficients, own.breaks):
            with pytest.raises(ValueError, match="read-only"):
                array[0] = 0


def test_pieces_that_do_not_fit_together_are_refused() -> None:
    edges, row, breaks = np.array([0.0, 0.5, 1.0]), np.zeros((2, 6)), np.ones(3, dtype=bool)
    LawPieces(edges, row, breaks)
    for bad in (
        (edges[:2], row, breaks),
        (edges[[0, 2, 1]], row, breaks),
        (np.array([0.0, 0.0, 1.0]), row, breaks),
        (edges, row[:1], breaks),
        (edges, np.full((2, 6), math.nan), breaks),
        (edges, row, breaks[:2]),
    ):
        with pytest.raises(ParameterError, match=r"^LawPieces\.\w+ must be .+\.$"):
            LawPieces(*bad)


@pytest.mark.parametrize("name", RISES)
def test_laws_are_values(name: str) -> None:
    law = motion_law(name)
    assert law.name == name
    for twin in (motion_law({"name": name}), copy.deepcopy(law), pickle.loads(pickle.dumps(law))):
        assert twin == law and hash(twin) == hash(law)
    assert len({motion_law(other) for other in RISES}) == len(RISES)


def test_registry_holds_every_law() -> None:
    assert list(MOTION_LAWS) == [*RISES, "table"]
    assert MOTION_LAWS["table"] is TableLaw
    assert all(issubclass(law, MotionLaw) for law in MOTION_LAWS.values())


@pytest.mark.parametrize(
    ("stations", "share", "angle", "word"),
    [
        (0, 0.5, 0.0, "stations"),
        (8.0, 0.5, 0.0, "stations"),
        (True, 0.5, 0.0, "stations"),
        (8, 0.0, 0.0, "motion_share"),
        (8, 1.01, 0.0, "motion_share"),
        (8, math.nan, 0.0, "motion_share"),
        (8, 0.5, math.nan, "cam_angle"),
        (8, 0.5, [0.0, math.inf], "cam_angle"),
    ],
)
def test_bad_use_is_refused_in_one_sentence(stations: int, share: float, angle: float, word: str) -> None:
    with pytest.raises(ParameterError, match=rf"^ModifiedSine\.{word} must be .+, got .+\.$"):
        motion_law("modified_sine").evaluate(angle, stations, share)
    if word != "cam_angle":
        with pytest.raises(ParameterError, match=rf"^ModifiedSine\.{word} must be .+, got .+\.$"):
            motion_law("modified_sine").pieces(stations, share)


@pytest.mark.parametrize("s", [-1e-9, 1.0 + 1e-9, math.nan])
def test_rise_outside_the_motion_is_refused(s: float) -> None:
    with pytest.raises(ParameterError, match=r"^Cycloidal\.s must be within \[0, 1\]"):
        rise_law("cycloidal").rise([0.5, s])
