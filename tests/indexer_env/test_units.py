"""A number refused is told under the key and in the unit that it was typed in."""

import pickle

import pytest

from indexer_env.build import from_mapping
from indexer_env.effects import make_effect
from indexer_env.errors import OutOfRange, ParameterError
from indexer_env.fault_law import fault_law
from indexer_env.faults import faults_from_mapping
from indexer_env.operating_point import OperatingPoint

BACKLASH = "faults.backlash_deg must be a finite number >= 0 and <= 114.592 deg at the motor shaft, got"


@pytest.mark.parametrize(
    ("build", "said"),
    [
        (lambda: faults_from_mapping({"backlash_deg": 200}), f"{BACKLASH} 200."),
        (
            lambda: faults_from_mapping({"backlash": 3.0}),
            "faults.backlash must be a finite number >= 0 and <= 2 rad at",
        ),
        (lambda: fault_law({"backlash_deg": {"uniform": [-0.5, 10]}}), f"{BACKLASH} -0.5."),
        (
            lambda: fault_law({"backlash_per_joule_deg": -1}),
            "faults.backlash_per_joule_deg must be a finite number >= 0 deg/J",
        ),
        (
            lambda: from_mapping(OperatingPoint, {"motor_speed_rpm": -1500}),
            "OperatingPoint.motor_speed_rpm must be a finite number > 0 rpm, got -1500.",
        ),
        (
            lambda: make_effect("input.backlash", backlash_deg=50),
            "input.backlash.backlash_deg must be a finite number >= 0 and <= 11.4592 deg, got 50.",
        ),
    ],
)
def test_a_refusal_speaks_the_unit_of_its_key(build, said):
    with pytest.raises(ParameterError) as caught:
        build()
    assert str(caught.value).startswith(said)


def test_a_refusal_survives_the_way_to_another_process():
    error = OutOfRange("Faults", "backlash", 3.0, high=2.0, unit="rad").error()
    assert pickle.loads(pickle.dumps(error)).out_of_range == error.out_of_range


@pytest.mark.parametrize(
    "given", [{"cracked_station": 3}, {"cracked_station": {"choice": [None, 3]}, "roller": "intact"}]
)
def test_the_station_of_no_crack_is_refused(given):
    with pytest.raises(ParameterError, match=r"faults\.cracked_station must be left out where no roller is cracked"):
        fault_law(given)
    assert fault_law({"cracked_station": 3, "roller": "cracked"}).cracked_station.value == 3


@pytest.mark.parametrize(
    ("given", "said"),
    [
        (
            {"crack_at": 3.0},
            r"faults\.crack_at must be left out where no roller is cracked, .*; add faults\.roller=cracked",
        ),
        ({"loose_at": 3.0, "screws": "tight"}, r"faults\.loose_at must be left out where .*; add faults\.screws=loose"),
    ],
)
def test_the_time_of_no_fault_is_refused(given, said):
    with pytest.raises(ParameterError, match=said):
        fault_law(given)
    law = fault_law({**given, "screws": {"choice": ["tight", "loose"]}, "roller": "cracked", "loose_at": 0})
    assert law.loose_at.value == 0


def test_a_fault_given_twice_is_told_by_both_keys():
    with pytest.raises(ParameterError, match=r"faults\.roller_crack must be left out where faults\.roller is given"):
        faults_from_mapping({"roller": "cracked", "roller_crack": 0.3})
