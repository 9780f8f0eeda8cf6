"""The effect library as hypotheses of one machine and its records."""

import dataclasses
import itertools

import numpy as np
import pytest

from discrepancy.estimates import FoundEffect
from discrepancy.estimates import _estimate as estimate
from discrepancy.indexer.advance import FINEST
from discrepancy.indexer.library import Seen, library
from discrepancy.indexer.machines import Machines
from discrepancy.indexer.parameters import base_parameters
from indexer_env import EFFECTS, OperatingPoint, Sensor, load_machine
from indexer_env.coefficients import coefficients
from indexer_env.effects.measures import measures


def choices(effect: str, **seen: tuple[float, ...]) -> list[dict[str, float]]:
    machine = load_machine("reference")
    found = library(machine, (), Seen(measures(machine, 157.0, None), 1000.0, **seen))
    return [dict(hypothesis.fixed) for hypothesis in found[effect]]


def test_a_mesh_is_looked_for_at_every_order() -> None:
    assert choices("drive.mesh_stiffness", orders=(4.5,)) == [{"order": order} for order in (1.0, 2.0, 3.0, 4.5)]


def test_what_shakes_the_machine_at_another_frequency_is_no_hum_and_takes_no_place_of_one() -> None:
    """The strongest lines come first; two near mains are looked at."""
    found = choices("sensor.mains_hum", hums=(17.2, 41.0, 50.2, 55.0, 60.1, 49.7))
    assert [choice["frequency"] for choice in found] == [50.0, 50.2, 60.0, 60.1]


def test_sizes_begin_at_a_ninth_of_an_effects_own_list() -> None:
    """A crack of 2 % promises nothing at 15 %, and everything at 1.7 %."""
    machine = load_machine("reference")
    found = library(machine, (), Seen(measures(machine, 157.0, None), 1000.0))
    for name in ("roller.crack", "roller.crack_single"):
        sizes = sorted({start[0] for start in found[name][0].starts})
        assert sizes[:3] == pytest.approx([0.05 / 9.0, 0.05 / 3.0, 0.05])


def test_a_deep_crack_is_begun_from_half_or_twice_what_is_left_of_the_stiffness() -> None:
    """What is left decides how the table rings: from a loss of 70 % a fit to one of 90 % ends beside it."""
    machine = load_machine("reference")
    found = library(machine, (), Seen(measures(machine, 157.0, None), 1000.0))
    for name in ("roller.crack", "roller.crack_single"):
        left = sorted(1.0 - start[0] for start in found[name][0].starts)
        assert left[0] < 0.1 and all(more / less <= 2.15 for less, more in itertools.pairwise(left))


def test_a_station_is_one_of_the_machine() -> None:
    assert [choice["station"] for choice in choices("cam.station_spacing")] == list(range(8))


@pytest.mark.parametrize(
    ("effect", "measure", "largest"),
    [
        ("base.looseness", "base compliance", 20.0),
        ("sensor.lowpass", "period", 2.0),
        ("drive.mesh_friction", "-", 0.42),
    ],
)
def test_large_sizes_are_begun_from_within_a_factor_of_two(effect: str, measure: str, largest: float) -> None:
    """Screws that are nearly out are softer than the table's joint, a filter may be slower than the table rings, and a
    worm may lose four tenths of the torque."""
    machine = load_machine("reference")
    size = largest * measures(machine, 157.0, None).get(measure, 1.0)
    (hypothesis,) = library(machine, (), Seen(measures(machine, 157.0, None), 1000.0))[effect]
    assert hypothesis.parameters[0].low <= size <= hypothesis.parameters[0].high
    assert any(0.5 < start[0] / size < 2.0 for start in hypothesis.starts)


@pytest.mark.parametrize("share", [0.3, 0.75])
def test_a_bump_on_the_cam_is_looked_for_where_the_table_moves(share: float) -> None:
    machine = dataclasses.replace(load_machine("reference"), motion_share=share)
    (bump,) = library(machine, (), Seen(measures(machine, 157.0, None), 1000.0))["cam.profile_error"]
    centre = next(p for p in bump.parameters if p.name.endswith("centre"))
    places = sorted({start[1] / share for start in bump.starts})
    assert 0.05 < places[0] < 0.15 and 0.85 < places[-1] < 1.0 and np.diff(places).max() < 0.1
    assert (centre.low, centre.high) == (0.0, pytest.approx(share))


@pytest.mark.parametrize("name", sorted(EFFECTS))
def test_coefficients_are_those_of_the_machine_that_a_point_stands_for(name: str) -> None:
    """Built without the machine, they are the same bit for bit. Seed 3."""
    machine = load_machine("reference")
    parameters = base_parameters(machine, {})
    seen = Seen(measures(machine, 157.0, None), 1000.0)
    hypothesis = library(machine, (), seen)[name][0]
    machines = Machines(machine, Sensor(), parameters, ())
    random = np.random.default_rng(3)
    sizes = hypothesis.coordinates(hypothesis.starts[0])
    points = np.array([np.concatenate([random.normal(size=len(parameters)), sizes]) for _ in range(3)])
    for point, (item, sensor) in zip(points, machines.coefficients(hypothesis, points), strict=True):
        expected, read = machines.at(hypothesis, point)
        whole = coefficients(expected, OperatingPoint(load_torque=1.0))
        assert item.row.tobytes() == whole.row.tobytes()
        assert (item.model, item.features, sensor) == (whole.model, whole.features, read)


def test_hum_that_a_rate_cannot_show_is_not_looked_for() -> None:
    machine = load_machine("reference")
    found = library(machine, (), Seen(measures(machine, 157.0, None), 110.0))["sensor.mains_hum"]
    assert [dict(one.fixed)["frequency"] for one in found] == [50.0]
    assert "sensor.mains_hum" not in library(machine, (), Seen(measures(machine, 157.0, None), 100.0))


def test_a_resonance_that_a_rate_cannot_show_is_not_looked_for() -> None:
    """At 100 Hz none lies below the table's own of 150 Hz."""
    machine = load_machine("reference")
    joint = dataclasses.replace(machine.output_joint, stiffness=machine.table_inertia * (2.0 * np.pi * 150.0) ** 2)
    stiff = dataclasses.replace(machine, output_joint=joint)
    assert "sensor.bracket_resonance" not in library(stiff, (), Seen(measures(stiff, 157.0, None), 100.0))


def test_no_slip_is_looked_for_that_is_too_fast_to_simulate() -> None:
    """A light motor comes back to its speed within J_m c, which the shortest step must resolve."""
    for inertia in (0.01, 1e-3):
        machine = dataclasses.replace(load_machine("reference"), motor_inertia=inertia)
        (slip,) = library(machine, (), Seen(measures(machine, 157.0, None), 1000.0))["drive.slip"]
        assert slip.parameters[0].low == pytest.approx(FINEST / (2.0 * inertia))
        assert all(start >= slip.parameters[0].low for (start,) in slip.starts)


def test_how_well_a_size_is_known_is_taken_from_no_effect_beyond_the_bounds() -> None:
    """A low-pass of 1.5 ms, 1.2 to 1.8, at 400 Hz, where none faster than 0.9 ms can be looked for."""
    machine = load_machine("reference")
    (lowpass,) = library(machine, (), Seen(measures(machine, 157.0, None), 400.0))["sensor.lowpass"]
    (own,) = lowpass.parameters
    assert own.low > 8e-4 and own.null == 0.0
    z = [own.coordinate(value) for value in (1.2e-3, 1.5e-3, 1.8e-3)]
    size = estimate(own, *z)
    found = FoundEffect("sensor.lowpass", (size,), (), "")
    assert found.span == pytest.approx(1.5) and found.shown and size.none == 0.0
    reaching = FoundEffect("sensor.lowpass", (estimate(own, own.coordinate(own.low), *z[1:]),), (), "")
    assert not reaching.shown, "an interval down to the bound leaves nothing shown"
