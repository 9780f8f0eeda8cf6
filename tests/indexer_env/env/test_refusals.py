"""Bad input: one sentence each, and nothing is clipped in silence."""

import dataclasses
import math

import gymnasium
import numpy as np
import pytest
from gymnasium.error import ResetNeeded

from indexer_env import OperatingPoint, ParameterError, Run, load_machine, load_sensor, make_effect, simulate
from indexer_env.diagnosis_env import IndexerDiagnosisEnv
from indexer_env.diagnosis_vector_env import IndexerDiagnosisVectorEnv
from indexer_env.env import IndexerEnv
from indexer_env.vector_env import IndexerVectorEnv
from indexer_env.wrappers import DomainRandomisation, TurnWindow


@pytest.fixture
def env() -> IndexerEnv:
    env = IndexerEnv()
    env.reset(seed=0)
    return env


@pytest.mark.parametrize(
    ("action", "said"),
    [
        (
            np.array([1.1]),
            "IndexerEnv.action must be finite and within [-1, 1] (speed), got 1.1; clip it yourself",
        ),
        (np.array([-1.1]), "IndexerEnv.action must be finite and within [-1, 1] (speed), got -1.1"),
        (np.array([math.nan]), "IndexerEnv.action must be finite and within [-1, 1] (speed), got nan"),
        (np.array([math.inf]), "IndexerEnv.action must be finite and within [-1, 1] (speed), got inf"),
        (np.ones(2), "IndexerEnv.action must be of shape (1,), got array([1., 1.])"),
        (np.ones((1, 1)), "IndexerEnv.action must be of shape (1,)"),
        (0.5, "IndexerEnv.action must be of shape (1,), got 0.5"),
        (np.array([True]), "IndexerEnv.action must be an array of floats, got array([ True]); its dtype is bool"),
        (np.array(["1"]), "IndexerEnv.action must be an array of floats"),
        (None, "IndexerEnv.action must be an array of floats, got None"),
        (np.array([1.0 + 0.0j]), "IndexerEnv.action must be an array of floats"),
        (
            np.ma.masked_array([0.5], mask=[True]),
            "IndexerEnv.action must be an array without a mask, got masked_array(",
        ),
    ],
)
def test_an_action_that_is_none(env, action, said):
    twin = IndexerEnv()
    twin.reset(seed=0)
    with pytest.raises(ParameterError) as caught:
        env.step(action)
    assert str(caught.value).startswith(said)
    # the refused step has moved nothing
    np.testing.assert_array_equal(env.step(np.ones(1))[0], twin.step(np.ones(1))[0])


def test_an_item_s_action_is_named():
    env = IndexerVectorEnv(3, brake_torque=10.0)
    env.reset(seed=0)
    actions = np.zeros((3, 2))
    actions[1, 1] = math.nan
    with pytest.raises(
        ParameterError, match=r"IndexerVectorEnv \(item 1\).action must be finite and within \[-1, 1\] \(brake"
    ):
        env.step(actions)
    with pytest.raises(ParameterError, match=r"IndexerVectorEnv.action must be of shape \(3, 2\)"):
        env.step(np.zeros((2, 2)))


def test_an_item_s_machine_is_named(smooth):
    """When it is made, and when a reset draws or is given what it cannot have."""
    slipping = smooth.with_effects(make_effect("drive.slip", {"compliance": 20.0}))
    with pytest.raises(
        ParameterError, match=r"^IndexerVectorEnv item 1: IndexerEnv\.machine must be one that keeps 20%"
    ):
        IndexerVectorEnv(3, machine=[smooth, slipping, smooth], brake_torque=500.0)
    with pytest.raises(ParameterError, match=r"^IndexerVectorEnv item 2: IndexerVectorEnv\.machine must be a Machine"):
        IndexerVectorEnv(3, machine=[smooth, smooth, 3])
    cracked = {"roller_crack": 0.2, "cracked_station": 7}
    few = dataclasses.replace(smooth, stations=6)
    with pytest.raises(ParameterError, match=r"^IndexerVectorEnv item 1: faults\.\w+ can be .*6 stations, got 7"):
        IndexerVectorEnv(2, machine=[smooth, few], faults=cracked)
    env = IndexerVectorEnv(2, machine=[smooth, few])
    with pytest.raises(ParameterError, match=r"^IndexerVectorEnv item 1: .*6 stations, got 7"):
        env.reset(options={"faults": cracked})


def test_steps_out_of_order(env):
    for fresh in (IndexerEnv(), gymnasium.make("indexer_env/Indexer-v1")):
        with pytest.raises(ResetNeeded):
            fresh.step(np.ones(1))
    with pytest.raises(ResetNeeded, match=r"IndexerVectorEnv\.step must follow a reset of all its machines"):
        IndexerVectorEnv(2).step(np.ones((2, 1)))
    some = IndexerVectorEnv(2)
    some.reset(seed=0, options={"reset_mask": np.array([True, False])})
    with pytest.raises(ResetNeeded):
        some.step(np.ones((2, 1)))
    disabled = IndexerVectorEnv(2, autoreset_mode="Disabled", max_episode_steps=1)
    disabled.reset(seed=0)
    disabled.step(np.ones((2, 1)))
    with pytest.raises(ResetNeeded, match=r"Episodes \[0, 1\] have ended"):
        disabled.step(np.ones((2, 1)))


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"fault": {}}, "IndexerEnv.reset has no option 'fault'; did you mean 'faults'."),
        ({"faults": {"roler_crack": 0.1}}, "faults has no parameter 'roler_crack'; did you mean 'roller_crack'."),
        ({"faults": "tabel2"}, "There is no faults_law preset or YAML file 'tabel2'; did you mean 'table2'."),
        ({"machine": 3}, "IndexerEnv.machine must be a Machine or the name of a preset, got 3."),
        (
            {"start_angle": "0"},
            "IndexerEnv.reset.start_angle must be a finite number >= -1e+06 and <= 1e+06 rad, got '0'.",
        ),
    ],
)
def test_an_option_that_cannot_be(env, options, said):
    with pytest.raises(ParameterError) as caught:
        env.reset(options=options)
    assert str(caught.value) == said


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ({"periode": 0.1}, "IndexerEnv has no parameter 'periode'; did you mean 'period'."),
        ({"machin": "smooth"}, "IndexerEnv has no parameter 'machin'; did you mean 'machine'."),
        ({"fault": {}}, "IndexerEnv has no parameter 'fault'; did you mean 'faults'."),
        ({"xyz": 1}, "IndexerEnv has no parameter 'xyz'; its parameters are machine, operating_point, faults, sensor,"),
        ({"period": 0.0105}, "IndexerEnv.period must be a whole number of samples of 0.001 s, got 0.0105; 0.01 s is"),
        (
            {"period": 1e9},
            "IndexerEnv.period must be at most 100000 samples of 0.001 s, got 1000000000.0; set it to 100",
        ),
        ({"step": 1e-320}, "IndexerEnv.step must be >= 5e-09 s, of which a period has 10000000, got 1e-320."),
        ({"sample_rate": 1e300}, "IndexerEnv.sample_rate must be a finite number >= 1 and <= 1e+06 Hz, got 1e+300."),
        ({"sample_rate": 1e-320}, "IndexerEnv.sample_rate must be a finite number >= 1 and <= 1e+06 Hz, got 1e-320."),
        ({"start_angle": 1e300}, "IndexerEnv.start_angle must be a finite number >= -1e+06 and <= 1e+06 rad, got"),
        ({"period": 0.0}, "IndexerEnv.period must be a finite number > 0 s, got 0.0."),
        ({"ramp": 0.0}, "IndexerEnv.ramp must be a finite number > 0 1/s, got 0.0."),
        ({"highest_share": 2.0}, "IndexerEnv.highest_share must be a finite number >= 0.1 and <= 1.5, got 2.0."),
        ({"brake_torque": -1.0}, "IndexerEnv.brake_torque must be a finite number >= 0 and <= 500 N m, got -1.0."),
        ({"vibration_weight": True}, "IndexerEnv.vibration_weight must be a finite number"),
        ({"machine": "referense"}, "There is no machine preset or YAML file 'referense'; did you mean 'reference'."),
        ({"sensor": "ideal"}, "IndexerEnv.sensor must have a range (full_scale)"),
        ({"reveal": 1}, "IndexerEnv.reveal must be True or False, got 1."),
    ],
)
def test_an_argument_that_cannot_be(arguments, said):
    with pytest.raises(ParameterError) as caught:
        IndexerEnv(**arguments)
    assert str(caught.value).startswith(said)


def test_a_step_too_coarse_for_the_machine():
    with pytest.raises(
        ParameterError, match=r"IndexerEnv.step must be <= .* s to resolve the fastest mode of reference"
    ):
        IndexerEnv(step=1e-2, sample_rate=100.0)


def test_noise_by_ratio_needs_a_whole_record():
    sensor = dataclasses.replace(load_sensor("environment"), noise_snr_db=20.0)
    with pytest.raises(ParameterError, match=r"Sensor\.noise_snr_db must be null where a record is read as it grows"):
        IndexerEnv(sensor=sensor)


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        ({"num_envs": 0}, "IndexerVectorEnv.num_envs must be a whole number >= 1 and <= 1e+06, got 0."),
        ({"num_envs": 10**9}, "IndexerVectorEnv.num_envs must be a whole number >= 1 and <= 1e+06, got 1000000000."),
        (
            {"num_envs": 30_000, "period": 1.0},
            "IndexerVectorEnv.num_envs must be at most 20000 with 1000 samples in a period, got 30000; make",
        ),
        ({"half_width": 0.6}, "IndexerVectorEnv.half_width must be a finite number >= 0 and <= 0.5, got 0.6."),
        ({"max_episode_steps": 0}, "IndexerVectorEnv.max_episode_steps must be a whole number >= 1, got 0."),
        ({"autoreset": "Disabled"}, "IndexerEnv has no parameter 'autoreset'; did you mean 'autoreset_mode'."),
        ({"autoreset_mode": "never"}, "IndexerVectorEnv.autoreset_mode must be one of NextStep, SameStep, Disabled"),
        (
            {"num_envs": 2, "machine": [load_machine()]},
            "IndexerVectorEnv.machine must be one, or a sequence of num_envs",
        ),
    ],
)
def test_an_argument_of_many_that_cannot_be(arguments, said):
    with pytest.raises(ParameterError) as caught:
        IndexerVectorEnv(**arguments)
    assert str(caught.value).startswith(said)


@pytest.mark.parametrize(
    "mask", [[True, False], np.array([1, 0]), np.zeros(2, dtype=bool), np.ones(3, dtype=bool)], ids=str
)
def test_a_mask_that_cannot_be(mask):
    with pytest.raises(ParameterError, match=r"IndexerVectorEnv\.reset\.reset_mask must be a bool array of shape"):
        IndexerVectorEnv(2).reset(options={"reset_mask": mask})


def test_after_a_refused_reset_the_vector_asks_for_another():
    """Its generators were seeded anew by then, so that no old episode can go on with them."""
    env, twin = IndexerVectorEnv(2, sensor="bench"), IndexerVectorEnv(2, sensor="bench")
    env.reset(seed=3)
    with pytest.raises(ParameterError):
        env.reset(seed=9, options={"faults": {"roller_crack": 2.0}})
    with pytest.raises(ResetNeeded):
        env.step(np.ones((2, 1)))
    np.testing.assert_array_equal(env.reset(seed=3)[0], twin.reset(seed=3)[0])
    np.testing.assert_array_equal(env.step(np.ones((2, 1)))[0], twin.step(np.ones((2, 1)))[0])
    with pytest.raises(ParameterError, match=r"IndexerVectorEnv.reset.seed must be one or 2 whole numbers"):
        env.reset(seed=[1, 2, 3])


@pytest.mark.parametrize("seed", [1.5, np.int64(3), "ab", {1, 2}], ids=repr)
def test_a_seed_that_cannot_be(seed):
    with pytest.raises(ParameterError, match=r"IndexerVectorEnv\.reset\.seed must be one or 2 whole numbers, got "):
        IndexerVectorEnv(2).reset(seed=seed)


@pytest.mark.parametrize("options", [3, "faults", ["faults"]], ids=repr)
def test_options_that_are_no_mapping(options):
    for env in (IndexerEnv(), IndexerVectorEnv(2), DomainRandomisation(IndexerEnv())):
        with pytest.raises(ParameterError, match=r"\.reset\.options must be a mapping, got "):
            env.reset(options=options)


@pytest.mark.parametrize("turns", [2000.0, 1e300])
def test_a_window_that_no_memory_holds(turns):
    with pytest.raises(ParameterError, match=r"TurnWindow\.turns must be at most 1\.22e\+03, 10000000 samples, got "):
        TurnWindow(IndexerEnv(), turns)


def test_a_motor_that_cannot_turn_its_load_is_refused():
    """What counts is the static share of the speed where the cam is steepest."""
    slipping = load_machine("reference").with_effects(make_effect("drive.slip", {"compliance": 10.0}))
    peak = 10.0 * 1.7596 / 8 / 0.5 / 25.625 * (2.0 + 500.0) / (50.0 * math.pi)
    IndexerEnv(machine=slipping, brake_torque=500.0)
    said = f"must be one that keeps 20% of the commanded speed .* got 'reference with {1.0 - 2.0 * peak:.0%}"
    weaker = load_machine("reference").with_effects(make_effect("drive.slip", {"compliance": 20.0}))
    for make in (IndexerEnv, lambda **given: IndexerVectorEnv(2, **given)):
        with pytest.raises(ParameterError, match=said):
            make(machine=weaker, brake_torque=500.0)
    env = IndexerEnv(brake_torque=500.0)
    with pytest.raises(ParameterError, match=said):
        env.reset(options={"machine": weaker})


@pytest.mark.parametrize("make", [IndexerEnv, lambda: IndexerVectorEnv(3)])
def test_a_step_that_is_broken_off_asks_for_a_reset(make, monkeypatch):
    env = make()
    env.reset(seed=0)
    action = np.ones(env.action_space.shape)

    def broken(*_):
        raise KeyboardInterrupt

    with monkeypatch.context() as patch:
        patch.setattr("indexer_env.fleet.Fleet.step", broken)
        with pytest.raises(KeyboardInterrupt):
            env.step(action)
    with pytest.raises(ResetNeeded):
        env.step(action)
    first = env.reset(seed=0)[0]
    np.testing.assert_array_equal(first, make().reset(seed=0)[0])
    env.step(action)


def test_a_motor_that_cannot_turn_its_load_by_the_mesh_that_rubs_is_refused():
    """It keeps 33 % of its speed without a loss in the mesh, and stood still with one of 45 %, unrefused."""
    slip, point = make_effect("drive.slip", {"compliance": 18.0}), OperatingPoint(load_torque=380.0)
    machine = load_machine("reference").with_effects(slip)
    IndexerEnv(machine=machine, operating_point=point)
    rubbing = machine.with_effects(make_effect("drive.mesh_friction", {"loss": 0.45}))
    with pytest.raises(ParameterError, match="must be one that keeps 20% of the commanded speed"):
        IndexerEnv(machine=rubbing, operating_point=point)


@pytest.mark.parametrize(
    "make",
    [
        IndexerEnv, IndexerDiagnosisEnv, lambda: IndexerVectorEnv(2), lambda: IndexerDiagnosisVectorEnv(2),
    ],
)  # fmt: skip
@pytest.mark.parametrize("refused", [{"options": {"machin": 1}}, {"options": 3}, {"seed": "one"}])
def test_a_reset_that_is_refused_asks_for_another_in_every_environment(make, refused):
    env = make()
    env.reset(seed=1)
    with pytest.raises((ParameterError, gymnasium.error.Error)):
        env.reset(**refused)
    with pytest.raises(ResetNeeded):
        env.step(np.zeros(env.action_space.shape, dtype=env.action_space.dtype))
    env.reset(seed=1)
    env.step(np.zeros(env.action_space.shape, dtype=env.action_space.dtype))


@pytest.mark.parametrize("make", [IndexerVectorEnv, IndexerDiagnosisVectorEnv])
def test_machines_that_a_refused_reset_did_not_ask_for_go_on(make):
    env = make(2, autoreset_mode="Disabled")
    env.reset(seed=1)
    with pytest.raises(ParameterError):
        env.reset(options={"reset_mask": np.array([True, False]), "machin": 1})
    env.reset(options={"reset_mask": np.array([True, False])})
    env.step(np.zeros(env.action_space.shape, dtype=env.action_space.dtype))


def test_a_step_that_does_not_resolve_a_decay_says_so(reference):
    """Dry friction of a smoothing of 1e-4 rad/s is what limits it; the fastest mode was named."""
    sticky = reference.with_effects(make_effect("friction.coulomb", {"torque": 10.0, "smoothing": 1e-4}))
    said = (
        r"must be <= 5e-05 s to resolve the fastest decay of reference \(step over its time constant <= 1\), "
        r"got 0\.00025 s; set step to 4\.5e-05\."
    )
    with pytest.raises(ParameterError, match=rf"IndexerEnv\.step {said}"):
        IndexerEnv(machine=sticky)
    with pytest.raises(ParameterError, match=rf"Run\.step {said}"):
        simulate(sticky, run=Run(samples=10, warmup_turns=0))


def test_a_seed_that_is_refused_leaves_no_item_half_seeded():
    env = IndexerVectorEnv(3, half_width=0.1)
    with pytest.raises(gymnasium.error.Error):
        env.reset(seed=[1, -1, 2])
    first, _ = env.reset(seed=[1, 4, 2])
    assert len({id(rng) for rng in env.np_random}) == 3
    again, _ = IndexerVectorEnv(3, half_width=0.1).reset(seed=[1, 4, 2])
    np.testing.assert_array_equal(first, again)
