import math

import numpy as np
import pyarrow as pa
import pytest

from classifier.conditions import Conditions, RecordConditions
from indexer_env.errors import ParameterError, SignalError

TRAINED = Conditions((0.4, 0.5), (100.0, 150.0), ("bench", "twin"), clipped_share=0.01, constant_share=0.1)


def known(**changes):
    return RecordConditions(**{"sensor_radius": 0.45, "motor_speed": 120.0, "machine": "twin", **changes})


def test_conditions_of_a_data_set_are_the_ranges_of_its_rows():
    table = pa.table(
        {
            "sensor_radius": [0.4, 0.5, 0.45, 0.6],
            "motor_speed": [100.0, 150.0, 120.0, 180.0],
            "machine_name": ["twin", "bench", "twin", "other"],
            "clipped_share": [0.01, 0.0, 0.9, 0.9],
            "constant_share": [0.0, 0.1, 0.9, 0.9],
        }
    )
    # what a model is only judged on tells nothing of what it knows
    subsets = np.array(["calibration", "calibration", "control", "validation"])
    assert Conditions.of_rows(table, np.zeros((4, 500)), subsets) == TRAINED


def test_what_one_row_leaves_open_is_not_known():
    table = pa.table(
        {
            "sensor_radius": [0.4, None],
            "motor_speed": pa.nulls(2, pa.float64()),
            "machine_name": [None, "bench"],
            "clipped_share": [0.0, 0.0],
            "constant_share": [0.0, 0.0],
        }
    )
    assert Conditions.of_rows(table, np.zeros((2, 500)), np.array(["calibration"] * 2)) == Conditions()


def test_they_come_back_from_plain_values():
    assert Conditions.from_dict(TRAINED.to_dict()) == TRAINED
    assert Conditions.from_dict(Conditions().to_dict()) == Conditions()


def test_a_record_of_the_same_kind_fits():
    TRAINED.check(known(), "a.csv")
    TRAINED.check(known(sensor_radius=0.404, motor_speed=98.5), "a.csv")
    TRAINED.check(known(sensor_radius=0.504, motor_speed=152.5), "a.csv")
    TRAINED.check(known(motor_speed=None, machine=None), "a.csv")
    Conditions().check(known(), "a.csv")


def test_what_could_not_be_compared_is_told():
    assert TRAINED.not_compared(known(motor_speed=None, machine=None)) == ("motor_speed_rpm", "machine")
    assert TRAINED.not_compared(known()) == ()
    assert Conditions().not_compared(RecordConditions()) == ()
    assert Conditions().not_known(known()) == ("motor_speed_rpm", "machine", "sensor_radius")
    assert TRAINED.not_known(known()) == Conditions().not_known(RecordConditions()) == ()


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        (
            {"sensor_radius": 0.6},
            r"a\.csv: the radius of the accelerometer must be 0\.4 to 0\.5 m within 1 % .* got 0\.6 m; correct "
            r"known\.sensor_radius",
        ),
        ({"motor_speed": 200.0 * math.pi}, r"motor shaft must be 954\.93 to 1432\.39 rpm within 2 % .* got 6000 rpm"),
        ({"machine": "other"}, r"machine must be one that the model was trained on \(bench, twin\), got 'other'"),
        ({"sensor_radius": None}, r"radius of the accelerometer must be known .* at 0\.4 to 0\.5 m, got none"),
    ],
)
def test_a_record_of_another_kind_is_refused_in_one_sentence(changes, words):
    with pytest.raises(SignalError, match=words) as caught:
        TRAINED.check(known(**changes), "a.csv")
    assert "\n" not in str(caught.value) and str(caught.value).endswith(".")


@pytest.mark.parametrize("changes", [{"sensor_radius": 0.0}, {"motor_speed": math.inf}, {"machine": 5}])
def test_conditions_of_a_record_check_themselves(changes):
    with pytest.raises(ParameterError, match=f"known.{next(iter(changes))} must be"):
        known(**changes)


@pytest.mark.parametrize(
    ("clipped", "constant", "words"),
    [
        (0.0, 0.0, ""),
        (0.014, 0.14, ""),
        (0.02, 0.0, "got 2 % clipped samples"),
        (0.0, 0.16, "got one value over 16 % of it"),
        (1.0, 1.0, "got one value over 100 %"),
        (0.39, 0.2, "got 39 % clipped samples"),
        (0.01, 0.16, "got one value over 16 % of it"),
    ],
)
def test_a_flaw_is_more_than_the_training_records_have(clipped, constant, words):
    assert words in TRAINED.flaw(clipped, constant)
    assert bool(TRAINED.flaw(clipped, constant)) == bool(words)


def bench(records):
    """Conditions of these records; of one that shows no indexing they leave it open."""
    count = len(records)
    table = pa.table(
        {
            "sensor_radius": np.full(count, 0.4),
            "motor_speed": np.full(count, 157.0),
            "machine_name": np.full(count, "bench"),
            "clipped_share": np.zeros(count),
            "constant_share": np.zeros(count),
        }
    )
    return Conditions.of_rows(table, np.asarray(records), np.array(["calibration"] * count))


def test_the_indexing_of_the_training_records_is_kept(machines):
    found = bench(machines.records)
    assert found.sense == 1 and found.stations == pytest.approx((8.0, 8.0), abs=0.2)
    assert found.left_out() == {} and Conditions.from_dict(found.to_dict()) == found
    assert bench(-machines.records).sense == -1


def test_what_is_not_compared_of_the_indexing_is_told(machines):
    records = machines.records[:4].astype(float)
    both = bench([*records[:3], -records[3]])
    assert both.left_out() == {"sign": "not compared, as it is not the same in all calibration records"}
    assert both.indexing_flaw(records[0]) == both.indexing_flaw(-records[0]) == ""
    noise = np.random.default_rng(0).standard_normal(8200)
    none = bench([*records[:3], noise])
    assert none.left_out()["sign"] == "cannot be told, 25 % of the calibration records do not show the table's indexing"
    assert none.indexing_flaw(noise) == none.indexing_flaw(-records[0]) == ""


def test_a_record_must_show_the_indexing_of_the_training(machines):
    trained, record = bench(machines.records), machines.records[7].astype(float)
    assert trained.indexing_flaw(record) == ""
    assert "the deceleration first: its sign is reversed; is the sensor" in trained.indexing_flaw(-record)
    assert "got the acceleration first: its sign" in bench(-machines.records).indexing_flaw(record)
    # A turn cut a tenth too short, filled up with what follows it.
    short = np.interp(np.arange(8200) * 0.9, np.arange(8200), record)
    assert "must hold 7.88 to 8 indexes of the table within 5 %" in trained.indexing_flaw(short)
    for strange in (np.random.default_rng(0).standard_normal(8200), np.zeros(8200)):
        assert "must show the indexing of the table" in trained.indexing_flaw(strange)
