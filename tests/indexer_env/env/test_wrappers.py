"""Windows, spectra, varied machines and noise around the environment."""

import dataclasses

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env, data_equivalence

from indexer_env import OperatingPoint, ParameterError, Run, load_machine, load_sensor, simulate
from indexer_env.control import ControlTask
from indexer_env.variation import varied
from indexer_env.wrappers import LEVELS, DomainRandomisation, PowerSpectrum, SensorNoise, TurnWindow

ID = "indexer_env/Indexer-v1"
ONE = np.ones(1, dtype=np.float32)
WRAPPERS = {
    "window": TurnWindow,
    "spectrum": PowerSpectrum,
    "machines": DomainRandomisation,
    "noise": lambda env: SensorNoise(env, 0.05),
}


def episode(env: gymnasium.Env, seed: int | None, steps: int) -> list:
    return [env.reset(seed=seed), *(env.step(ONE) for _ in range(steps))]


@pytest.mark.parametrize("name", WRAPPERS)
@pytest.mark.filterwarnings("ignore:.*is different from the unwrapped version")
def test_gymnasium_s_checker_takes_them(name):
    check_env(WRAPPERS[name](gymnasium.make(ID).unwrapped), skip_render_check=True)


@pytest.mark.parametrize("name", WRAPPERS)
def test_a_seed_decides_their_draws_too(name):
    one, other = WRAPPERS[name](gymnasium.make(ID)), WRAPPERS[name](gymnasium.make(ID))
    assert data_equivalence(episode(one, 3, 20), episode(other, 3, 20), exact=True)
    assert data_equivalence(episode(one, None, 20), episode(other, None, 20), exact=True)
    assert not data_equivalence(episode(one, 4, 20), episode(other, 3, 20), exact=True)


@pytest.mark.parametrize("name", WRAPPERS)
def test_they_can_be_made_again_from_their_spec(name):
    env = WRAPPERS[name](gymnasium.make(ID))
    assert env.spec is not None
    again = gymnasium.make(env.spec)
    assert again.spec is not None and again.spec.additional_wrappers == env.spec.additional_wrappers
    assert data_equivalence(episode(env, 3, 5), episode(again, 3, 5), exact=True)


def test_gymnasium_s_wrappers_go_around_them():
    env = gymnasium.wrappers.TimeLimit(TurnWindow(DomainRandomisation(gymnasium.make(ID)), 0.125), 15)
    env = gymnasium.wrappers.RecordEpisodeStatistics(env)
    *_, (_, _, _, truncated, info) = episode(env, 0, 15)
    assert truncated and info["episode"]["l"] == 15
    vector = gymnasium.make_vec(ID, 3, "sync", wrappers=[lambda env: SensorNoise(env, 0.1), TurnWindow])
    assert vector.reset(seed=0)[0].shape == (3, 8200)


def test_a_window_is_the_turn_s_record():
    env = TurnWindow(gymnasium.make(ID))
    window, _ = env.reset(seed=0, options={"start_angle": 0.0})
    assert window.shape == (8200,) and (window == window[0]).all()
    for _ in range(164):
        window = env.step(ONE)[0]
    truth = simulate(load_machine(), run=Run(step=ControlTask.step, samples=8201, warmup_turns=0)).table_acceleration[
        1:
    ]
    np.testing.assert_array_equal(window, (truth / 100.0).astype(np.float32))


def test_a_window_shorter_than_a_period_keeps_its_end():
    env = TurnWindow(gymnasium.make(ID), turns=3.0 / 8200.0)
    env.reset(seed=0)
    window, *_, info = env.step(ONE)
    np.testing.assert_array_equal(window, (info["acceleration"][-3:] / 100.0).astype(np.float32))


def test_a_spectrum_shows_the_lines_of_a_signal():
    """Parseval on a sine that a hum puts on the reading: 50 Hz, amplitude 1, on a machine that hardly moves."""
    sensor = dataclasses.replace(load_sensor("environment"), hum_amplitude=1.0)
    slow = OperatingPoint(motor_speed=0.5, load_torque=0.0)
    env = PowerSpectrum(
        gymnasium.make(ID, sensor=sensor, operating_point=slow, machine="smooth", period=0.1), turns=4100 / 2.575e6
    )
    env.reset(seed=0)
    for _ in range(42):
        level = env.step(-np.ones(1, dtype=np.float32))[0]
    power = 10.0 ** (level.astype(float) / 10.0)
    assert level.argmax() == 50 and level.shape == (101,)
    assert power[48:53].sum() == pytest.approx(0.5, rel=1e-3)  # rms² of the sine, bins of 1 Hz
    assert level.min() >= LEVELS[0]


def test_machines_vary_within_their_width(reference):
    rng = np.random.default_rng(0)
    drawn = [varied(reference, 0.1, rng) for _ in range(300)]
    for joint in ("input_joint", "output_joint"):
        for name in ("stiffness", "damping"):
            ratio = np.array([getattr(getattr(m, joint), name) for m in drawn]) / getattr(
                getattr(reference, joint), name
            )
            assert 0.9 <= ratio.min() < 0.91 and 1.09 < ratio.max() < 1.1
    assert varied(reference, 0.0, rng) == reference


def test_each_episode_has_a_machine_of_its_own():
    env, records = DomainRandomisation(gymnasium.make(ID)), []
    for seed in (0, None, 0):
        env.reset(seed=seed, options={"start_angle": 0.0})
        records.append(np.concatenate([env.step(ONE)[4]["acceleration"] for _ in range(20)]))
    assert not np.array_equal(records[0], records[1])
    np.testing.assert_array_equal(records[0], records[2])


def test_a_machine_given_by_name_is_varied_too():
    env, accelerations = DomainRandomisation(gymnasium.make(ID)), []
    for machine in ("smooth", load_machine("smooth")):
        env.reset(seed=0, options={"machine": machine, "start_angle": 0.0})
        accelerations.append(env.step(ONE)[4]["acceleration"])
    np.testing.assert_array_equal(*accelerations)


def test_noise_has_its_density_and_respects_the_range():
    env, quiet = SensorNoise(gymnasium.make(ID), 0.2), gymnasium.make(ID)
    noisy = np.concatenate([step[-1]["acceleration"] for step in episode(env, 2, 400)[1:]])
    clean = np.concatenate([step[-1]["acceleration"] for step in episode(quiet, 2, 400)[1:]])
    assert np.std(noisy - clean) == pytest.approx(0.2 * np.sqrt(500.0), rel=0.05)
    loud = SensorNoise(gymnasium.make(ID), 100.0)
    for observation, *_ in episode(loud, 2, 50):
        assert observation in loud.observation_space


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (lambda env: TurnWindow(env, 0.0), r"TurnWindow\.turns must be a finite number > 0, got 0\.0"),
        (lambda env: PowerSpectrum(env, 50.7), r"PowerSpectrum\.highest_hz must be a whole number"),
        (lambda env: PowerSpectrum(env, 600), r"PowerSpectrum\.highest_hz must be a whole number >= 1 and <= 500"),
        (lambda env: PowerSpectrum(env, turns=0.1), r"PowerSpectrum\.turns must be long enough for a window of 1 s"),
        (lambda env: DomainRandomisation(env, 0.7), r"DomainRandomisation\.half_width must be a finite number >= 0"),
        (lambda env: SensorNoise(env, -1.0), r"SensorNoise\.density must be a finite number >= 0"),
        (lambda env: SensorNoise(TurnWindow(env), 0.1), r"SensorNoise\.env must be one whose observation is still"),
        (lambda env: TurnWindow(gymnasium.make("CartPole-v1")), r"TurnWindow\.env must be an IndexerEnv or a wrapper"),
    ],
)
def test_what_they_refuse(make, said):
    with pytest.raises(ParameterError, match=said):
        make(gymnasium.make(ID))
