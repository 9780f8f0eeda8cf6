"""The library of effects is complete, each effect says what it is, and none is there at its null value."""

import copy
import dataclasses
import math
import pickle

import numpy as np
import pytest

from indexer_env.coefficients import coefficients
from indexer_env.effects import EFFECTS, MachineEffect, SensorEffect, make_effect, null_effect
from indexer_env.errors import ParameterError
from indexer_env.operating_point import OperatingPoint
from indexer_env.presets import load_sensor
from indexer_env.simulate import Run, simulate

DESIGN = [
    "friction.coulomb",
    "friction.viscous",
    "friction.stribeck",
    "load.imbalance",
    "load.process",
    "drive.slip",
    "drive.speed_ripple",
    "drive.transmission_error",
    "drive.mesh_stiffness",
    "drive.mesh_friction",
    "cam.profile_error",
    "cam.station_spacing",
    "roller.crack",
    "roller.crack_single",
    "input.backlash",
    "output.backlash",
    "output.cubic_stiffness",
    "base.looseness",
    "sensor.gain",
    "sensor.lowpass",
    "sensor.highpass",
    "sensor.bracket_resonance",
    "sensor.mains_hum",
    "sensor.offset_drift",
]
MACHINE_EFFECTS = [name for name in DESIGN if not name.startswith("sensor.")]
SENSOR_EFFECTS = [name for name in DESIGN if name.startswith("sensor.")]
POINT = OperatingPoint()


def size_of(name: str) -> dataclasses.Field:
    """The parameter that measures the effect's size."""
    (field,) = [f for f in dataclasses.fields(EFFECTS[name]) if f.metadata["null"] is not None]
    return field


# -------------------------------------------------------------------------------- what they say


def test_the_library_is_that_of_the_design():
    assert len(DESIGN) == 24
    assert sorted(EFFECTS) == sorted(DESIGN)


@pytest.mark.parametrize("name", EFFECTS)
def test_an_effect_says_what_it_is(name):
    effect = EFFECTS[name]
    assert effect.name == name and effect.__doc__
    assert issubclass(effect, SensorEffect if name.startswith("sensor.") else MachineEffect)
    for text in (effect.sentence, effect.equation, effect.source, effect.enters):
        assert isinstance(text, str) and len(text) >= 4
    assert effect.sentence.endswith(".") and effect.sentence.count(".") == 1
    for field in dataclasses.fields(effect):
        assert field.metadata["meaning"] and field.metadata["unit"]
    assert size_of(name).metadata["null"] == 0.0


def test_no_two_effects_share_their_words():
    for word in ("sentence", "equation"):
        assert len({getattr(effect, word) for effect in EFFECTS.values()}) == len(EFFECTS)


@pytest.mark.parametrize("name", EFFECTS)
def test_an_effect_is_frozen_hashable_and_survives_copies(visible, name):
    effect = visible(name)
    with pytest.raises(dataclasses.FrozenInstanceError):
        setattr(effect, size_of(name).name, 1.0)
    for twin in (pickle.loads(pickle.dumps(effect)), copy.deepcopy(effect)):
        assert twin == effect and hash(twin) == hash(effect)


# -------------------------------------------------------------------------------- what they refuse


@pytest.mark.parametrize("name", EFFECTS)
@pytest.mark.parametrize("value", [True, "1", None, math.nan, math.inf])
def test_every_parameter_is_checked(visible, name, value):
    for field in dataclasses.fields(EFFECTS[name]):
        kind = "a whole number" if field.metadata["whole"] else "a finite number"
        with pytest.raises(ParameterError) as caught:
            visible(name, **{field.name: value})
        assert str(caught.value).startswith(f"{name}.{field.name} must be {kind}")


@pytest.mark.parametrize("name", EFFECTS)
def test_every_bound_is_kept(visible, name):
    for field in dataclasses.fields(EFFECTS[name]):
        rules = field.metadata
        for bound, way, is_open in (("low", -1, "low_open"), ("high", 1, "high_open")):
            limit = rules[bound]
            if limit is None:
                continue
            beyond = limit + way if rules["whole"] else math.nextafter(limit, way * math.inf)
            outside = limit if rules[is_open] else beyond
            with pytest.raises(ParameterError, match=f"^{name}.{field.name} must be "):
                visible(name, **{field.name: outside})
            if not rules[is_open]:
                visible(name, **{field.name: limit})


@pytest.mark.parametrize("name", EFFECTS)
def test_misspellings_get_a_hint(name):
    size = size_of(name).name
    with pytest.raises(ParameterError) as caught:
        make_effect(name, {size[:-1]: 0.1})
    assert str(caught.value) == f"{name} has no parameter {size[:-1]!r}; did you mean {size!r}."
    with pytest.raises(ParameterError) as caught:
        make_effect(name[:-1], {size: 0.1})
    assert str(caught.value) == f"There is no effect {name[:-1]!r}; did you mean {name!r}."


@pytest.mark.parametrize("name", EFFECTS)
def test_the_size_must_be_given(name):
    with pytest.raises(ParameterError) as caught:
        make_effect(name)
    assert str(caught.value) == f"{name} lacks {size_of(name).name}; give a value for each."


def test_parameters_come_as_mapping_or_keywords():
    assert make_effect("drive.speed_ripple", {"depth": 0.1}, order=3.0) == make_effect(
        "drive.speed_ripple", depth=0.1, order=3
    )
    assert make_effect("load.imbalance", torque=1.0, phase_deg=180.0).phase == pytest.approx(math.pi)


# -------------------------------------------------------------------------------- null


@pytest.mark.parametrize("name", EFFECTS)
def test_null_is_null_and_visible_is_not(visible, name):
    assert null_effect(name).is_null
    assert not visible(name).is_null


@pytest.mark.parametrize("name", MACHINE_EFFECTS)
@pytest.mark.parametrize("base", ["smooth", "reference"])
def test_an_effect_at_its_null_value_changes_no_bit(request, visible, name, base):
    machine = request.getfixturevalue(base)
    null = visible(name, **{size_of(name).name: 0.0})
    assert null.is_null
    plain, extended = coefficients(machine, POINT), coefficients(machine.with_effects(null), POINT)
    assert extended.row.tobytes() == plain.row.tobytes()
    assert (extended.features, extended.model) == (plain.features, plain.model)
    run = Run(samples=120, warmup_turns=0, channels=("table_acceleration", "cam_angle"))
    records = [simulate(m, POINT, run).channels for m in (machine, machine.with_effects(null))]
    for channel in run.channels:
        assert records[0][channel].tobytes() == records[1][channel].tobytes()


@pytest.mark.parametrize("name", MACHINE_EFFECTS)
def test_an_effect_at_a_visible_size_changes_coefficients_and_record(smooth, visible, name):
    machine = smooth.with_effects(visible(name))
    assert coefficients(machine, POINT).row.tobytes() != coefficients(smooth, POINT).row.tobytes()
    run = Run(samples=900, warmup_turns=0)
    plain, extended = (simulate(m, POINT, run).table_acceleration for m in (smooth, machine))
    assert np.abs(extended - plain).max() > 1e-2 * np.abs(plain).max()


@pytest.mark.parametrize("name", SENSOR_EFFECTS)
@pytest.mark.parametrize("preset", ["ideal", "bench"])
def test_a_sensor_effect_at_its_null_value_leaves_the_sensor(name, preset):
    assert null_effect(name).extend_sensor(load_sensor(preset)) == load_sensor(preset)


@pytest.mark.parametrize("name", SENSOR_EFFECTS)
def test_a_sensor_effect_goes_into_the_sensor_alone(visible, name):
    sensor = load_sensor("ideal")
    extended = visible(name).extend_sensor(sensor)
    assert extended != sensor and sensor == load_sensor("ideal")
    assert not hasattr(visible(name), "extend")


def test_a_station_that_is_off_by_more_than_the_pitch_is_refused(smooth):
    """Two hundred stations stand 31 mrad apart."""
    machine = dataclasses.replace(smooth, stations=200)
    coefficients(machine.with_effects(make_effect("cam.station_spacing", error=-0.031)), POINT)
    for error in (0.05, -0.05):
        with pytest.raises(ParameterError, match=r"^cam\.station_spacing\.error must be smaller, .* 0\.03142 rad, got"):
            coefficients(machine.with_effects(make_effect("cam.station_spacing", error=error)), POINT)


@pytest.mark.parametrize("angle", [1.1e6, -1e10])
def test_a_start_that_no_double_resolves_is_refused(angle):
    with pytest.raises(
        ParameterError, match=r"^OperatingPoint\.start_angle must be .* >= -1e\+06 and <= 1e\+06 rad, got"
    ):
        OperatingPoint(start_angle=angle)
