"""Parts of the reference solver: the cam's stretches and the search for edges inside a step."""

import dataclasses
import math

import numpy as np
import pytest

from indexer_env.effects import make_effect
from indexer_env.machine import Machine
from indexer_env.motion_law import (
    Cycloidal,
    LawPieces,
    ModifiedSine,
    ModifiedTrapezoid,
    MotionLaw,
    Peaks,
    Polynomial345,
    TableLaw,
)
from indexer_env.presets import load_machine
from indexer_env.reference.cam import TURN, CamTurn, Stretch, bump
from indexer_env.reference.contact import Contact
from indexer_env.reference.edges import CAM_HIGH, CAM_LOW, JOINT_1, PAST, Guards, first_crossing
from indexer_env.reference.equations import SHEET


@dataclasses.dataclass(frozen=True)
class OwnLaw(MotionLaw):
    """A user's own kind of law: not one of the four, not a table."""

    name = "own"

    def evaluate(self, cam_angle, stations, motion_share):
        return Cycloidal().evaluate(cam_angle, stations, motion_share)

    def pieces(self, stations: int, motion_share: float) -> LawPieces:
        return Cycloidal().pieces(stations, motion_share)

    def peaks(self) -> Peaks:
        return Cycloidal().peaks()


def table_law(lift: float = 0.0) -> TableLaw:
    angles = np.radians(np.arange(361.0))
    beta = Polynomial345().evaluate(angles, 8, 0.5)[0] + lift
    return TableLaw(tuple(angles), tuple(beta))


LAWS = (ModifiedSine(), ModifiedTrapezoid(), Cycloidal(), Polynomial345(), table_law(), OwnLaw())


@pytest.fixture(scope="module")
def machine() -> Machine:
    return load_machine("smooth")


def cam_turn(machine: Machine, *effects) -> CamTurn:
    return CamTurn(machine, {effect.name: effect for effect in effects})


@pytest.mark.parametrize(
    ("law", "share"),
    [(law, 0.5) for law in LAWS] + [(law, 1.0) for law in LAWS if not isinstance(law, TableLaw)],
)
def test_stretches_are_the_law_itself(machine: Machine, law: MotionLaw, share: float) -> None:
    cam = cam_turn(dataclasses.replace(machine, motion_law=law, motion_share=share))
    for alpha in np.linspace(-7.0, 20.0, 400).tolist():
        expected = [float(value) for value in law.evaluate(alpha, 8, share)]
        found = cam.stretch(*cam.place(alpha)).follower(alpha)
        assert found == pytest.approx(expected, abs=1e-12)


@pytest.mark.parametrize("law", LAWS, ids=lambda law: law.name)
def test_edges_are_the_breaks_of_the_law(machine: Machine, law: MotionLaw) -> None:
    cam = cam_turn(dataclasses.replace(machine, motion_law=law))
    pieces = law.pieces(8, 0.5)
    np.testing.assert_allclose(cam.edges, sorted({0.0, 1.0, *pieces.edges[pieces.breaks].tolist()}), atol=1e-12)


def test_a_stretch_goes_on_smoothly_beyond_its_end(machine: Machine) -> None:
    """What the integrator sees of a step that overshoots: no kink of β'' at the edge."""
    cam = cam_turn(machine)
    stretch = cam.stretch(0, 0)  # the first eighth of the motion
    second = [stretch.follower(stretch.high + x)[2] for x in (-2e-4, -1e-4, 0.0, 1e-4, 2e-4)]
    assert np.abs(np.diff(second, 3)).max() < 1e-10


def test_neighbours_over_the_turns_end(machine: Machine) -> None:
    cam = cam_turn(machine)
    last = len(cam.edges) - 2
    assert cam.beside(3, last, 1) == (4, 0)
    assert cam.beside(3, 0, -1) == (2, last)
    assert cam.place(-0.1) == (-1, last)
    assert cam.stretch(4, 0).low == pytest.approx(cam.stretch(3, last).high, abs=1e-14)


@pytest.mark.parametrize("centre", [0.25, 0.02, 0.98, 1.0, 0.5])
def test_bump_and_pulse_act_where_they_should(machine: Machine, centre: float) -> None:
    profile = make_effect("cam.profile_error", {"height": 1e-3, "centre": centre, "half_width": 0.05})
    pulse = make_effect("load.process", {"torque": 7.0, "centre": centre, "half_width": 0.1})
    plain, cam = cam_turn(machine), cam_turn(machine, profile, pulse)
    for alpha in np.linspace(0.001, 2.0 * TURN, 300).tolist():
        offset = (alpha / TURN - centre + 0.5) % 1.0 - 0.5
        y0, y1, y2 = bump(offset / 0.05) if abs(offset) < 0.05 else (0.0, 0.0, 0.0)
        scale = 1.0 / (0.05 * TURN)
        stretch, bare = cam.stretch(*cam.place(alpha)), plain.stretch(*plain.place(alpha))
        found = np.subtract(stretch.follower(alpha), bare.follower(alpha))
        np.testing.assert_allclose(found, [1e-3 * y0, 1e-3 * scale * y1, 1e-3 * scale**2 * y2], atol=1e-11)
        assert stretch.process(alpha) == pytest.approx(bump(offset / 0.1)[0] if abs(offset) < 0.1 else 0.0, abs=1e-11)


def test_pulse_over_the_whole_turn(machine: Machine) -> None:
    pulse = make_effect("load.process", {"torque": 7.0, "centre": 0.75, "half_width": 0.5})
    cam = cam_turn(machine, pulse)
    for phase in (0.0, 0.1, 0.2499, 0.2501, 0.6, 0.75, 0.99):
        offset = (phase - 0.75 + 0.5) % 1.0 - 0.5
        found = cam.stretch(*cam.place(TURN * phase)).process(TURN * phase)
        assert found == pytest.approx((1.0 - 4.0 * offset**2) ** 4, abs=1e-12)


@pytest.mark.parametrize("lift", [0.0, 0.1])
@pytest.mark.parametrize("station", [0, 3])
def test_station_off_its_place(machine: Machine, station: int, lift: float) -> None:
    """β at every turn's start is the law's, only the one station stands off; β is continuous over the turn's end."""
    one = dataclasses.replace(machine, motion_law=table_law(lift))
    cam = cam_turn(one, make_effect("cam.station_spacing", {"error": 1e-3, "station": station}))
    for turn in range(-2, 11):
        off = 1e-3 if turn % 8 == station else 0.0
        begin = cam.stretch(turn, 0).follower(TURN * turn)
        assert begin == pytest.approx((lift + turn * one.advance + off, 0.0, 0.0), abs=1e-12)
        end = cam.stretch(turn - 1, len(cam.edges) - 2).follower(TURN * turn)
        assert end == pytest.approx(begin, abs=1e-12)


def sheet(delta: float, rate: float) -> tuple[float, ...]:
    values = dict.fromkeys(SHEET, 0.0) | {"cam_angle": 1.0, "deflection_1": delta, "deflection_rate_1": rate}
    return tuple(values[name] for name in SHEET)


def joint_guards(region: int, law: str = "kelvin_voigt") -> Guards:
    contact = Contact(stiffness=100.0, damping=1.0, backlash=0.2, ratio=0.5, law=law, edged=True)
    stretch = Stretch(0.0, 2.0, lambda alpha: (0.0, 0.0, 0.0), lambda alpha: 0.0)
    return Guards(stretch, (contact, contact, contact), (region, 1, 1), (0,))


def crossing_of(guards: Guards, delta, rate, step: float) -> tuple[float, int] | None:
    def at(times: np.ndarray) -> list[tuple[float, ...]]:
        return [sheet(delta(s), rate(s)) for s in times.tolist()]

    (before, after) = at(np.array([0.0, step]))
    return first_crossing(guards, before, after, step, at)


@pytest.mark.parametrize("depth", [1e-5, 1e-7, 1e-10])
@pytest.mark.parametrize("moment", [0.2e-3, 0.51e-3, 0.93e-3])
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_a_touch_within_a_step_is_seen(depth: float, moment: float, side: float) -> None:
    """Free at both ends of the step, in contact for a part of it."""
    bend = 2000.0  # rad/s²

    def delta(s: float) -> float:
        return side * (0.1 + depth - 0.5 * bend * (s - moment) ** 2)

    found = crossing_of(joint_guards(0), delta, lambda s: -side * bend * (s - moment), 1e-3)
    entry = moment - math.sqrt(2.0 * (depth + PAST) / bend)
    assert found is not None
    assert found[1] == JOINT_1
    assert found[0] == pytest.approx(entry, abs=1e-8)


def test_a_near_miss_is_no_touch() -> None:
    found = crossing_of(
        joint_guards(0), lambda s: 0.1 - 1e-9 - 1000.0 * (s - 4.3e-4) ** 2, lambda s: -2000.0 * (s - 4.3e-4), 1e-3
    )
    assert found is None


def test_clipped_contact_ends_where_the_push_ends() -> None:
    """k x + r v = 0 before x = 0 on the way out."""
    found = crossing_of(joint_guards(1, "clipped"), lambda s: 0.1 + 0.02 - s, lambda s: -1.0, 0.03)
    assert found == (pytest.approx(0.01, abs=1e-9), JOINT_1)
    found = crossing_of(joint_guards(1), lambda s: 0.1 + 0.02 - s, lambda s: -1.0, 0.03)
    assert found == (pytest.approx(0.02, abs=1e-9), JOINT_1)


def test_the_softer_flank_lets_go_earlier() -> None:
    found = crossing_of(joint_guards(-1, "clipped"), lambda s: -0.1 - 0.03 + s, lambda s: 1.0, 0.05)
    assert found == (pytest.approx(0.01, abs=1e-9), JOINT_1)


@pytest.mark.parametrize(("speed", "name", "time"), [(1e4, CAM_HIGH, 1e-4), (-1e4, CAM_LOW, 1e-4)])
def test_the_ends_of_a_stretch_are_edges(speed: float, name: int, time: float) -> None:
    def at(times: np.ndarray) -> list[tuple[float, ...]]:
        return [(1.0 + speed * s, *sheet(0.0, 0.0)[1:]) for s in times.tolist()]

    before, after = at(np.array([0.0, 2e-4]))
    found = first_crossing(joint_guards(0), before, after, 2e-4, at)
    assert found == (pytest.approx(time, rel=1e-9), name)


def test_the_first_of_two_edges_counts() -> None:
    def at(times: np.ndarray) -> list[tuple[float, ...]]:
        return [(1.0 + 2e3 * s, *sheet(300.0 * s, 300.0)[1:]) for s in times.tolist()]

    before, after = at(np.array([0.0, 1e-3]))
    found = first_crossing(joint_guards(0), before, after, 1e-3, at)
    assert found == (pytest.approx(1e-1 / 300.0, rel=1e-9), JOINT_1)
