"""The environment's pictures: both modes, without a screen."""

import copy

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

from indexer_env import ParameterError
from indexer_env.env import IndexerEnv

ID = "indexer_env/Indexer-v1"
ONE = np.ones(1, dtype=np.float32)


@pytest.fixture(autouse=True)
def no_screen(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")


def test_gymnasium_s_checker_draws_both_modes():
    env = gymnasium.make(ID, render_mode="rgb_array")
    check_env(env.unwrapped)
    env.close()


def test_pictures_follow_the_motion_and_change_none():
    env, blind = IndexerEnv(render_mode="rgb_array", faults="growing"), IndexerEnv(faults="growing")
    for each in (env, blind):
        each.reset(seed=3, options={"start_angle": 0.0})
    first = env.render()
    for _ in range(30):
        np.testing.assert_array_equal(env.step(ONE)[0], blind.step(ONE)[0])
    last = env.render()
    assert first is not None and last is not None
    assert first.shape == (480, 640, 3) and first.dtype == np.uint8
    assert (first != last).any() and not np.shares_memory(first, last)
    np.testing.assert_array_equal(last, env.render())


def test_a_crack_shows_once_it_has_set_in():
    env = IndexerEnv(render_mode="rgb_array", period=0.01, faults={"roller_crack": 0.4, "crack_at": 0.05})
    sound = IndexerEnv(render_mode="rgb_array", period=0.01)
    pictures = []
    for steps in (4, 6):
        for each in (env, sound):
            each.reset(seed=0)
            for _ in range(steps):
                each.step(-np.ones(1))
        pictures.append((env.render(), sound.render()))
    np.testing.assert_array_equal(*pictures[0])
    assert (np.asarray(pictures[1][0]) != np.asarray(pictures[1][1])).sum() > 30


def test_the_window_mode_and_its_copy():
    env = gymnasium.make(ID, render_mode="human")
    env.reset(seed=0)
    env.step(ONE)
    assert env.render() is None
    twin = copy.deepcopy(env)
    np.testing.assert_array_equal(env.step(ONE)[0], twin.step(ONE)[0])
    for each in (env, twin):
        each.close()
        each.close()


def test_frames_are_collected():
    env = gymnasium.wrappers.RenderCollection(gymnasium.make(ID, render_mode="rgb_array"))
    env.reset(seed=0)
    for _ in range(3):
        env.step(ONE)
    frames = env.render()
    assert len(frames) == 4 and frames[0].shape == (480, 640, 3)


def test_what_rendering_refuses():
    with pytest.raises(ParameterError, match=r"IndexerEnv\.render_mode must be one of human, rgb_array, got 'rgb'"):
        IndexerEnv(render_mode="rgb")
    with pytest.raises(gymnasium.error.ResetNeeded, match=r"IndexerEnv\.render must follow a reset"):
        IndexerEnv(render_mode="rgb_array").render()
    env = IndexerEnv()
    env.reset(seed=0)
    with pytest.warns(UserWarning, match="render was called without a render mode"):
        assert env.render() is None


@pytest.mark.filterwarnings("ignore::SyntaxWarning:moviepy", "ignore::DeprecationWarning", "ignore::ResourceWarning")
def test_a_video_is_recorded(tmp_path):
    pytest.importorskip("moviepy", reason="moviepy, by which Gymnasium writes videos, is not installed")
    env = gymnasium.make(ID, render_mode="rgb_array", max_episode_steps=6)
    env = gymnasium.wrappers.RecordVideo(env, str(tmp_path / "videos"), episode_trigger=lambda episode: episode == 1)
    for _ in range(2):
        env.reset(seed=0)
        while not env.step(ONE)[3]:
            pass
    env.close()
    assert [path.name for path in tmp_path.glob("videos/*.mp4")] == ["rl-video-episode-1.mp4"]
    import imageio.v3

    frames = imageio.v3.imread(tmp_path / "videos" / "rl-video-episode-1.mp4", plugin="FFMPEG")
    assert len(frames) >= 7 and frames.shape[1:] == (480, 640, 3)  # a writer may repeat the last
    assert (frames[0] != frames[6]).any()
