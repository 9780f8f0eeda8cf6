"""What is left is what a fit cannot take, and every size leaves what was drawn for it."""

import dataclasses
import math

import numpy as np
import pytest

from indexer_env import OperatingPoint, Sensor, load_machine, make_effect
from indexer_env.errors import ParameterError
from indexer_experiments.challenge.messy.draw import MessyOrder, messy_draw
from indexer_experiments.challenge.messy.leftover import RATE, LinearFit, coarse_run
from indexer_experiments.challenge.messy.sizes import MessyCase, messy_case, read_of, sought
from indexer_experiments.challenge.parameters import changed

MACHINE = dataclasses.replace(load_machine("reference"), stations=4)
POINT = OperatingPoint(150.0, 3.0)
SAMPLES, NOISE = 2600, 0.05


@pytest.fixture(scope="module")
def fit() -> LinearFit:
    return LinearFit(MACHINE, [POINT], [coarse_run(MACHINE, POINT, SAMPLES)], NOISE)


def left(fit: LinearFit, machine, point: OperatingPoint = POINT) -> tuple[float, float]:
    """What the fit leaves of another machine's reading, and what there was, over the noise."""
    motion = coarse_run(machine, point, SAMPLES)
    raw = motion[0] - coarse_run(MACHINE, POINT, SAMPLES)[0]
    return fit.left([motion[0]], [motion]), float(np.sqrt(np.mean(raw**2))) / NOISE


@pytest.mark.parametrize("name", ["output_joint.stiffness", "table_inertia", "cam_inertia"])
def test_what_the_machine_can_take_is_not_left(fit: LinearFit, name: str) -> None:
    """3 % of a parameter, half of what it is known to: less than an eighth of its rms is left."""
    value = {"output_joint.stiffness": MACHINE.output_joint.stiffness}.get(name) or getattr(MACHINE, name)
    after, before = left(fit, changed(MACHINE, {name: 1.03 * value}))
    assert before > 0.5
    assert after < 0.125 * before


def test_a_load_and_a_speed_that_are_misstated_are_not_left(fit: LinearFit) -> None:
    faster = dataclasses.replace(POINT, motor_speed=1.001 * POINT.motor_speed, load_torque=1.05 * POINT.load_torque)
    after, before = left(fit, MACHINE, faster)
    assert after < 0.05 * before


def test_what_no_parameter_is_like_is_left(fit: LinearFit) -> None:
    """A shift of 5 % in the reading at one station of four."""
    motion = coarse_run(MACHINE, POINT, SAMPLES)
    turn = np.floor(motion[1] / (2.0 * math.pi)) % 4
    reading = motion[0] * np.where(turn == 1, 1.05, 1.0)
    raw = float(np.sqrt(np.mean((reading - motion[0]) ** 2))) / NOISE
    assert 0.5 * raw < fit.left([reading], [motion]) < 1.3 * raw
    assert fit.left([motion[0]], [motion]) < 1e-6


def test_a_size_is_found_for_its_level() -> None:
    for power in (0.5, 1.0, 2.0):
        size, level = sought(lambda s, p=power: 3.0 * s**p, 1e-3, 2.0) or (0.0, 0.0)
        assert level == pytest.approx(2.0, rel=0.1)
        assert 3.0 * size**power == level


def test_a_level_that_no_size_reaches_has_none() -> None:
    assert sought(lambda s: min(s, 0.5), 1.0, 2.0) is None
    assert sought(lambda s: s, 0.1, 2.0, most=1.0) is None

    def refusing(size: float) -> float:
        if size > 1.0:
            raise ParameterError("too large")
        return size

    assert sought(refusing, 0.1, 2.0) is None
    assert sought(refusing, 0.1, 0.9) == (pytest.approx(0.9, rel=0.1), pytest.approx(0.9, rel=0.1))


@pytest.fixture(scope="module")
def case() -> MessyCase:
    """Seed 1, the first small case of the judging half with a disturbance and two effects."""
    drawn = [messy_draw(MessyOrder(20, 1, "judge"), k) for k in range(20)]
    chosen = [d for d in drawn if d.disturbances and d.hidden == 2]
    return messy_case(min(chosen, key=lambda d: sum(r.turns * d.machines.truth.stations for r in d.records)))


@pytest.mark.slow
def test_all_sizes_leave_what_was_drawn(case: MessyCase) -> None:
    drawn = case.drawn
    assert case.disturbed == pytest.approx(drawn.disturbed, rel=0.11)
    assert len(case.hidden) == 2
    for hidden in case.hidden:
        assert hidden.level >= 3.0 * max(case.disturbed, 1.0)
        assert hidden.level == pytest.approx(drawn.above * max(case.disturbed, 1.0), rel=0.11)
    names = [hidden.effect.name for hidden in case.hidden]
    assert {effect.name for effect in case.machine.effects} == {n for n in names if not n.startswith("sensor.")}
    record = drawn.records[0]
    assert case.unlisted(record).drift == record.drift
    points = [r.point for r in drawn.records]
    counts = [r.samples(drawn.machines.truth, RATE) for r in drawn.records]
    pairs = list(zip(points, counts, strict=True))
    fit = LinearFit(case.machine, points, [coarse_run(case.machine, p, n) for p, n in pairs], case.noise)
    runs = [
        coarse_run(case.machine, r.point, n, case.unlisted(r)._replace(drift=0.0))
        for r, n in zip(drawn.records, counts, strict=True)
    ]
    read = [read_of(run, case.readers(), Sensor()) for run in runs]
    assert fit.left(read, runs) == pytest.approx(drawn.disturbed, rel=0.11), "beside the hidden effects"


def test_effects_of_the_library_have_one_size_each() -> None:
    """Every effect that may be drawn can be made at its shape and unit size, on machines of any size."""
    from indexer_experiments.challenge.draw import HIDDEN
    from indexer_experiments.challenge.messy.draw import unit_size

    for wanted in messy_draw(MessyOrder(1, 3, "tune"), 0).effects:
        field = next(iter(HIDDEN[wanted.name]))
        for size in (0.01, 100.0):
            shape = {name: int(v) if name == "station" else v for name, v in wanted.shape.items()}
            assert not make_effect(wanted.name, {field: unit_size(wanted.name, size), **shape}).is_null
    assert RATE == 500.0
