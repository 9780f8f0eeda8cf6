"""Bad input: one sentence each, and nothing moves."""

import dataclasses
import math

import gymnasium
import numpy as np
import pytest
from gymnasium.error import ResetNeeded

from indexer_env import OperatingPoint, ParameterError, load_machine, load_sensor, make_effect
from indexer_env.diagnosis_env import IndexerDiagnosisEnv
from indexer_env.diagnosis_task import DiagnosisTask

TWO = {"sound": {}, "worn": {"backlash_deg": 5.0}}


@pytest.mark.parametrize(
    "action",
    [
        -1,
        16,
        1.0,
        True,
        "1",
        None,
        math.nan,
        np.ones(2, dtype=int),
        np.ones(1),
        np.ma.masked,
        np.ma.array(1, mask=True),
    ],
    ids=repr,
)
def test_an_action_that_is_none(action):
    env, twin = IndexerDiagnosisEnv(), IndexerDiagnosisEnv()
    for each in (env, twin):
        each.reset(seed=0)
    with pytest.raises(ParameterError, match=r"IndexerDiagnosisEnv\.action must be a whole number >= 0 and <= 15, got"):
        env.step(action)
    np.testing.assert_array_equal(env.step(np.array(6))[0], twin.step(np.int64(6))[0])
    np.testing.assert_array_equal(env.step(np.array([6]))[0], twin.step(6)[0])  # as some algorithms give it


def test_steps_out_of_order():
    for fresh in (IndexerDiagnosisEnv(), gymnasium.make("indexer_env/IndexerDiagnosis-v1")):
        with pytest.raises(ResetNeeded):
            fresh.step(0)
    env = IndexerDiagnosisEnv()
    env.reset()
    env.step(8)
    with pytest.raises(ResetNeeded, match=r"IndexerDiagnosisEnv\.step must follow a reset, at first and after each"):
        env.step(0)
    env.reset()
    with pytest.raises(ParameterError):
        env.reset(options={"hypothesis": "intakt"})
    with pytest.raises(ResetNeeded):
        env.step(0)


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"hypothesis": "intakt"}, "IndexerDiagnosisEnv.reset.hypothesis must be one of intact, small play,"),
        ({"hypothesis": 0}, "IndexerDiagnosisEnv.reset.hypothesis must be one of"),
        ({"faults": {}}, "IndexerDiagnosisEnv.reset has no option 'faults'; its only one is 'hypothesis'."),
        (["hypothesis"], "IndexerDiagnosisEnv.reset.options must be a mapping, got"),
    ],
)
def test_an_option_that_cannot_be(options, said):
    with pytest.raises(ParameterError) as caught:
        IndexerDiagnosisEnv().reset(options=options)
    assert str(caught.value).startswith(said)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ({"budgt": 1.0}, "IndexerDiagnosisEnv has no parameter 'budgt'; did you mean 'budget'."),
        ({"machin": "smooth"}, "IndexerDiagnosisEnv has no parameter 'machin'; did you mean 'machine'."),
        (
            {"xyz": 1},
            "IndexerDiagnosisEnv has no parameter 'xyz'; its parameters are machine, operating_point, sensor, task, "
            "reveal, render_mode, speeds, brakes, hypotheses, machine_spread, budget, time_price, brake_price, right,",
        ),
        ({"budget": 0.0}, "diagnosis.budget must be a finite number > 0 reward, got 0.0."),
        ({"time_price": 0.0}, "diagnosis.time_price must be a finite number > 0 reward per s, got 0.0."),
        ({"wrong": -1.0}, "diagnosis.wrong must be a finite number >= 0 reward, got -1.0."),
        ({"speeds": []}, "diagnosis.speeds must be a list of at least one number, got []."),
        ({"speeds": 1.0}, "diagnosis.speeds must be a list of at least one number, got 1.0."),
        ({"speeds": [2.0]}, "diagnosis.speeds must be a finite number >= 0.1 and <= 1.5 of nominal speed, got 2.0."),
        ({"brakes": [0, 0.0]}, "diagnosis.brakes must be a list of different numbers, got [0, 0.0]."),
        ({"brakes": [-1.0]}, "diagnosis.brakes must be a finite number >= 0 and <= 500 N m, got -1.0."),
        ({"hypotheses": {"sound": {}}}, "diagnosis.hypotheses must be a mapping of at least two names"),
        ({"hypotheses": {**TWO, 3: {}}}, "diagnosis.hypotheses must be a mapping of at least two names"),
        ({"hypotheses": {**TWO, "odd": 1.0}}, "diagnosis.hypotheses.odd must be a mapping of faults to their laws"),
        ({"hypotheses": {**TWO, "odd": {"crak": 1}}}, "diagnosis.hypotheses.odd: faults has no parameter 'crak';"),
        (
            {"hypotheses": {**TWO, "wears": {"backlash_per_joule_deg": {"choice": [0.0, 0.01]}}}},
            "diagnosis.hypotheses.wears.backlash_per_joule must be 0, as a fault does not change during a diagnosis",
        ),
        (
            {"hypotheses": {**TWO, "stiff": {"screw_looseness": {"uniform": [0.001, 0.1]}}}},
            "diagnosis.hypotheses.stiff must be such that a step of 0.25 ms resolves the machine's fastest mode",
        ),
        (
            {"hypotheses": {**TWO, "ninth": {"roller_crack": 0.3, "cracked_station": 8}}},
            "diagnosis.hypotheses.ninth: ",
        ),
        ({"task": "bensh"}, "There is no diagnosis preset or YAML file 'bensh'; did you mean 'bench'."),
        ({"task": 3}, "IndexerDiagnosisEnv.task must be a DiagnosisTask, a mapping of its fields or the name of"),
        ({"sensor": "benhc"}, "There is no sensor preset or YAML file 'benhc'; did you mean 'bench'."),
        ({"machine": 3}, "IndexerDiagnosisEnv.machine must be a Machine or the name of a preset, got 3."),
        ({"reveal": 1}, "IndexerDiagnosisEnv.reveal must be True or False, got 1."),
        ({"render_mode": "human"}, "IndexerDiagnosisEnv.render_mode must be one of rgb_array, got 'human'."),
        (
            {
                "sensor": dataclasses.replace(
                    load_sensor("bench"), sample_rate=125.0, lowpass_hz=40.0, hum_amplitude=0.0
                )
            },
            "IndexerDiagnosisEnv.sensor.sample_rate must be a whole number of Hz and >= 200 Hz, twice the highest band",
        ),
        (
            {"sensor": dataclasses.replace(load_sensor("ideal"), lowpass_hz=700.0)},
            "Sensor.lowpass_hz must be below 500 Hz",
        ),
        (
            {"operating_point": OperatingPoint(motor_speed=1e-9)},
            "IndexerDiagnosisEnv.operating_point must be such that a turn takes 1 to 600 s, got ",
        ),
        (
            {"operating_point": OperatingPoint(motor_speed=1e4)},
            "IndexerDiagnosisEnv.operating_point must be such that a turn takes 1 to 600 s, got ",
        ),
        (
            {"machine": load_machine().with_effects(make_effect("drive.slip", compliance=100.0))},
            "IndexerDiagnosisEnv.machine must be one that keeps 20% of the commanded speed at each setting, got ",
        ),
    ],
    ids=lambda value: value if isinstance(value, str) else "",
)
def test_an_argument_that_cannot_be(arguments, said):
    with pytest.raises(ParameterError) as caught:
        IndexerDiagnosisEnv(**arguments)
    sentence = str(caught.value)
    assert sentence.startswith(said) and sentence.endswith(".") and "\n" not in sentence


def test_a_sound_machine_that_is_too_stiff_has_no_loose_screws():
    machine = load_machine()
    stiff = dataclasses.replace(machine, output_joint=dataclasses.replace(machine.output_joint, stiffness=1e8))
    with pytest.raises(ParameterError, match=r"hypotheses\.sound must be .*soften its stiffest joint\.$"):
        IndexerDiagnosisEnv(machine=stiff, hypotheses=TWO)


def test_a_task_is_taken_in_each_of_its_forms():
    one = IndexerDiagnosisEnv(speeds=[1.0], hypotheses=TWO)
    other = IndexerDiagnosisEnv(task=one.task)
    again = IndexerDiagnosisEnv(
        task=dataclasses.asdict(IndexerDiagnosisEnv().task) | {"hypotheses": TWO, "speeds": (1,)}
    )
    assert one.task == other.task == again.task and isinstance(one.task, DiagnosisTask)
    assert IndexerDiagnosisEnv(task=one.task, budget=0.3).task.budget == 0.3
