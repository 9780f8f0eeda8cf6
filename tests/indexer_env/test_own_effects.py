"""Effects of a third party: what they write into the coefficients acts, or they are refused."""

import dataclasses
import math
from collections.abc import Callable, Iterator, MutableMapping
from typing import Any

import numpy as np
import pytest

from indexer_env.coefficients import coefficients, numbers_of
from indexer_env.effects import EFFECTS, MachineEffect, make_effect
from indexer_env.effects.base import parameter, register
from indexer_env.env import IndexerEnv
from indexer_env.errors import ParameterError
from indexer_env.machine import Machine
from indexer_env.operating_point import OperatingPoint
from indexer_env.simulate import Run, simulate, simulate_batch

RUN = Run(samples=600, warmup_turns=0, step=0.25e-3)


@pytest.fixture(autouse=True)
def _library_as_it_was() -> Iterator[None]:
    before = dict(EFFECTS)
    yield
    EFFECTS.clear()
    EFFECTS.update(before)


def own_effect(
    write: Callable[[MutableMapping[str, float], float], None], name: str = "own.effect", null: float | None = 0.0
) -> type[MachineEffect]:
    """An effect of one size that writes what `write(coefficients, size)` does."""

    @dataclasses.dataclass(frozen=True)
    class Own(MachineEffect):
        """Of a third party."""

        sentence = "It acts."
        equation = "as written"
        source = "this test"
        enters = "somewhere"

        size: float = parameter("size", "-", null=null)

        def extend(self, coefficients: MutableMapping[str, float], machine: Machine) -> None:
            write(coefficients, self.size)

    Own.name = name
    return Own


def added(coefficient: str) -> Any:
    def write(found: MutableMapping[str, float], size: float) -> None:
        found[coefficient] += size

    return own_effect(write)


def test_a_drag_of_ones_own_is_the_librarys_drag_alone_and_in_a_batch(smooth):
    """It acted in the dwell alone, and in the motion only beside a neighbour with friction."""
    drag = smooth.with_effects(added("viscous")(size=20.0))
    expected = simulate(smooth.with_effects(make_effect("friction.viscous", coefficient=20.0)), run=RUN)
    np.testing.assert_array_equal(simulate(drag, run=RUN).table_acceleration, expected.table_acceleration)
    beside = smooth.with_effects(make_effect("friction.viscous", coefficient=1.0))
    batch = simulate_batch([drag, beside], run=RUN)
    np.testing.assert_array_equal(batch.table_acceleration[0], expected.table_acceleration)


def test_two_drags_add_in_either_order(smooth):
    own, library = added("viscous")(size=20.0), make_effect("friction.viscous", coefficient=5.0)
    for order in ((own, library), (library, own)):
        assert coefficients(smooth.with_effects(*order), OperatingPoint())["viscous"] == 25.0


def test_a_seal_of_ones_own_adds_to_the_librarys_friction_in_either_order(smooth):
    """The library's friction set the torque, so that the seal went where it stood first."""
    seal, library = added("coulomb_torque")(size=10.0), make_effect("friction.coulomb", torque=3.0)
    for order in ((seal, library), (library, seal)):
        assert coefficients(smooth.with_effects(*order), OperatingPoint())["coulomb_torque"] == 13.0


def test_a_load_of_ones_own_acts_beside_a_brake(smooth):
    """Released all the time, the brake leaves what the effect adds to the load."""
    rows = []
    for brake, own in ((0.0, 50.0), (100.0, 50.0), (100.0, 0.0)):
        machine = smooth.with_effects(added("load_torque")(size=own)) if own else smooth
        env = IndexerEnv(machine=machine, brake_torque=brake)
        env.reset(seed=0)
        action = np.zeros(env.action_space.shape, np.float32)
        action[1:] = -1.0
        rows.append(np.array([env.step(action)[0] for _ in range(4)]))
        env.close()
    width = min(row.shape[1] for row in rows)
    np.testing.assert_allclose(rows[1][:, :width], rows[0][:, :width], rtol=1e-6)
    assert np.abs(rows[1][:, :width] - rows[2][:, :width]).max() > 1e-3


@pytest.mark.parametrize(
    ("library", "size", "coefficient"),
    [
        ("friction.coulomb", "torque", "coulomb_torque"), ("friction.viscous", "coefficient", "viscous"),
        ("friction.stribeck", "torque", "stribeck_torque"), ("load.imbalance", "torque", "imbalance_torque"),
        ("load.process", "torque", "process_torque"), ("drive.slip", "compliance", "slip_compliance"),
        ("drive.transmission_error", "amplitude", "transmission_amplitude"),
        ("drive.mesh_stiffness", "depth", "mesh_depth"), ("cam.profile_error", "height", "bump_height"),
    ],
)  # fmt: skip
def test_what_is_written_switches_on_what_reads_it(smooth, library, size, coefficient):
    theirs = coefficients(smooth.with_effects(make_effect(library, {size: 1e-3})), OperatingPoint())
    own = coefficients(smooth.with_effects(added(coefficient)(size=1e-3)), OperatingPoint())
    assert own.features == theirs.features != coefficients(smooth, OperatingPoint()).features
    assert own[coefficient] == theirs[coefficient]


@pytest.mark.parametrize(
    ("name", "remedy"), [("dampng_2", "did you mean 'damping_2'"), ("edge_2", "it is worked out .* from backlash_1,")]
)
def test_a_coefficient_that_no_machine_has_is_refused(smooth, name, remedy):
    def write(found: MutableMapping[str, float], size: float) -> None:
        found[name] = size

    machine = smooth.with_effects(own_effect(write)(size=0.1))
    with pytest.raises(ParameterError, match=rf"^own\.effect\.extend must be .* got '{name}'; .*{remedy}"):
        simulate(machine, run=RUN)


def test_every_number_of_a_machine_may_be_written(smooth):
    for name in numbers_of(smooth):
        assert math.isfinite(coefficients(smooth.with_effects(added(name)(size=1e-6)), OperatingPoint())["stiffness_1"])


def test_an_effect_without_a_size_is_refused_and_acts_where_it_is_not_registered(smooth):
    """Without a size it counted as null and did nothing."""

    def write(found: MutableMapping[str, float], size: float) -> None:
        found["damping_2"] *= size

    sizeless = own_effect(write, null=None)
    with pytest.raises(ParameterError, match=r"^Own\.parameters must be .* got \['size'\]; give that one null="):
        register(sizeless)
    assert "own.effect" not in EFFECTS
    item = coefficients(smooth.with_effects(sizeless(size=0.5)), OperatingPoint())
    assert item["damping_2"] == 0.5 * smooth.output_joint.damping


def test_the_name_of_another_effect_is_refused_and_a_second_definition_replaces_the_first():
    """A cell of a notebook that is run again defines its effect again."""
    with pytest.raises(ParameterError, match=r"^Own\.name must be .* got 'friction\.coulomb'; CoulombFriction has it"):
        register(own_effect(lambda found, size: None, "friction.coulomb"))
    assert EFFECTS["friction.coulomb"].__name__ == "CoulombFriction"
    register(own_effect(lambda found, size: None))
    again = register(own_effect(lambda found, size: None))
    assert EFFECTS["own.effect"] is again
