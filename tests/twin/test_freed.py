"""What a machine is known to have, as it is fitted anew."""

from __future__ import annotations

import dataclasses

import pytest

from discrepancy.indexer.library import HOUSING, effect_of
from indexer_env import load_machine, make_effect
from twin.freed import freed

MACHINE = load_machine("smooth")


@pytest.mark.parametrize(
    "effect",
    [
        make_effect("cam.station_spacing", station=3, error=1e-3),
        make_effect("roller.crack_single", station=2, stiffness_loss=0.2),
        make_effect("base.looseness", compliance=1e-6, damping_ratio=0.04, backlash=0.01),
        make_effect("friction.coulomb", torque=20.0, smoothing=0.02),
    ],
    ids=lambda effect: effect.name,
)
def test_a_finding_as_yaml_has_it_is_the_same_effect_again(effect):
    """All its numbers floats, those that no search moves among them."""
    row = {"effect": effect.name, "values": {name: float(v) for name, v in dataclasses.asdict(effect).items()}}
    plain, (known,) = freed(MACHINE.with_effects(effect), [row])
    assert plain.effects == ()
    assert effect_of(known, {p.name: p.nominal for p in known.parameters}) == effect
    own = [p for p in known.parameters if p.name == HOUSING]
    assert [p.nominal for p in own] == [MACHINE.housing_inertia] * (effect.name == "base.looseness")
