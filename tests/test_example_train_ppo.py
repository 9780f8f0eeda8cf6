"""The training example reproduces with its seed, and measures what it says it measures."""

import json
import re
from pathlib import Path

import numpy as np
import pytest
import torch

from examples import learning_report, train_ppo
from examples.dwell_vibration import HARMONICS, best_profile, constant, profile, score
from indexer_env import OperatingPoint, Run, load_machine, simulate
from indexer_env.control import ControlTask
from indexer_env.variation import variation_rng, varied

PAGE = Path(__file__).parents[1] / "docs" / "reference" / "environments" / "learning.md"
MARGIN = 2.5
"""What the page states of every pair of seeds, loose screws apart [-]."""

TINY = {"steps": 1000, "fleet": 8, "rollout": 64}
FEW = {"machines": 3, "periods": 300}


def weights(policy: torch.nn.Module) -> list[torch.Tensor]:
    return list(policy.state_dict().values())


@pytest.mark.slow
def test_the_same_seed_gives_the_same_policy_and_another_another(tmp_path):
    first, second, other = (train_ppo.train(seed, **TINY) for seed in (3, 3, 4))
    assert all(map(torch.equal, weights(first), weights(second)))
    assert not all(map(torch.equal, weights(first), weights(other)))
    train_ppo.save(first, tmp_path / "policy.safetensors")
    read = train_ppo.acting(train_ppo.load(tmp_path / "policy.safetensors"))
    seen = np.random.default_rng(0).uniform(-1.0, 1.0, (50, 7)).astype(np.float32)
    np.testing.assert_array_equal(read(seen), train_ppo.acting(first)(seen))
    assert (np.abs(read(seen)) <= 1.0).all()


def test_a_constant_speed_is_scored_as_simulated():
    """Its throughput is its share, its vibration the rms of the simulated record in the dwell."""
    found = score(constant(1.0), {}, [7], machines=1, periods=410)
    machine = varied(load_machine(), 0.1, variation_rng(7))
    start = OperatingPoint(start_angle=np.pi * (1.0 + float(np.random.default_rng(7).random())))
    run = Run(step=ControlTask.step, samples=4101, warmup_turns=0, channels=("table_acceleration", "cam_angle"))
    record = simulate(machine, start, run)
    counted = slice(2051, 4101)
    dwelling = np.mod(record.channels["cam_angle"][counted], 2.0 * np.pi) >= np.pi
    squares = record.table_acceleration[counted][dwelling] ** 2
    assert found.vibration[0] == pytest.approx(np.sqrt(squares.mean()), rel=1e-9)
    assert found.throughput[0] == pytest.approx(1.0, abs=2e-3)
    assert score(constant(0.6), {}, [7], **FEW).throughput[0] == pytest.approx(0.6, abs=2e-3)


def test_scores_belong_to_their_seeds():
    alone, both = (score(constant(0.9), {"backlash_deg": 10.0}, seeds, **FEW) for seeds in ([9], [50, 9]))
    assert both.vibration[1] == alone.vibration[0] != both.vibration[0]


def test_a_profile_is_its_fourier_series():
    numbers = np.zeros(1 + 2 * HARMONICS)
    numbers[[0, 1, 4]] = 0.5, 0.1, 0.2  # a0, a1, b2
    angles = np.linspace(0.0, 6.0, 20)
    seen = np.zeros((20, 7), dtype=np.float32)
    seen[:, 4], seen[:, 5] = np.cos(angles), np.sin(angles)
    expected = 0.5 + 0.1 * np.cos(angles) + 0.2 * np.sin(2.0 * angles)
    np.testing.assert_allclose(profile(numbers)(seen)[:, 0], 2.0 * expected - 1.0, atol=1e-6)
    numbers[0] = 5.0
    np.testing.assert_array_equal(profile(numbers)(seen), 1.0)


def test_the_search_for_a_profile_reproduces():
    found, again, other = (best_profile({}, seed, machines=1, generations=1) for seed in (3, 3, 4))
    np.testing.assert_array_equal(found, again)
    assert (found != other).all()


@pytest.mark.slow
def test_a_searched_profile_is_quieter_than_a_constant_speed_as_fast():
    found = score(profile(best_profile({}, 3, machines=2, generations=25)), {}, [4])
    assert found.vibration[0] < 0.8 * score(constant(float(found.throughput[0])), {}, [4]).vibration[0]


def test_a_rival_is_at_least_as_fast_and_the_quietest(monkeypatch):
    monkeypatch.setattr(learning_report, "SEEDS", (4,))
    curve = {share: score(constant(share), {}, [4], machines=3) for share in (0.85, 0.9, 1.0)}
    rival = learning_report._rival(0.87, {}, curve)
    able = [curve[0.9].vibration[0], curve[1.0].vibration[0], score(constant(0.87), {}, [4]).vibration[0]]
    assert rival["rival_share"] in (0.87, 0.9, 1.0) and rival["rival_vibration"] == [min(able)]
    assert learning_report._rival(0.95, {}, curve)["rival_share"] in (0.95, 1.0)


def test_the_page_holds_the_table_of_the_results():
    """What is committed was written by the command, and PPO beats every constant speed as fast by the margin stated."""
    results = json.loads((PAGE.parent / "learning.json").read_text(encoding="utf-8"))
    assert learning_report.table(results) in PAGE.read_text(encoding="utf-8")
    assert len(results["seeds"]) >= 5
    for name, found in results["faults"].items():
        assert len(found["ppo"]) >= 3
        margin = min(min(np.divide(one["rival_vibration"], one["vibration"])) for one in found["ppo"].values())
        assert name == "loose screws" or margin > MARGIN
    assert f"at least {MARGIN:g} times less" in PAGE.read_text(encoding="utf-8")


def test_a_committed_policy_scores_what_the_results_say():
    """On one of the fifteen fleets; another processor may round the net's sums otherwise, hence the margin."""
    results = json.loads((PAGE.parent / "learning.json").read_text(encoding="utf-8"))
    policy = train_ppo.acting(train_ppo.load(PAGE.parent / "policy_0.safetensors"))
    found = score(policy, {"backlash_deg": 10.0}, results["seeds"][:1])
    said = results["faults"]["10° of play"]["ppo"]["0"]
    assert found.throughput[0] == pytest.approx(said["throughput"][0], rel=1e-3)
    assert found.vibration[0] == pytest.approx(said["vibration"][0], rel=0.1)


def test_the_picture_is_drawn(tmp_path):
    results = json.loads((PAGE.parent / "learning.json").read_text(encoding="utf-8"))
    learning_report.write(results, tmp_path)
    assert json.loads((tmp_path / "learning.json").read_text()) == results
    assert (tmp_path / "learning.png").stat().st_size > 10_000


@pytest.mark.parametrize("place", [0, 1], ids=["training", "recording"])
def test_the_page_s_programs_run(place, tmp_path, monkeypatch):
    monkeypatch.setenv("MINARI_DATASETS_PATH", str(tmp_path))
    programs = re.findall(r"```python\n(.*?)```", PAGE.read_text(encoding="utf-8"), flags=re.DOTALL)
    names: dict = {}
    exec(compile(programs[place], str(PAGE), "exec"), names)  # the text of our own page
    assert len(programs) == 2
    assert names["observation"].shape == (7,) if place == 0 else names["dataset"].total_episodes == 2
