"""The environment's page says what the code does."""

import inspect
import re
from pathlib import Path

import gymnasium
import pytest

from indexer_env import ParameterError
from indexer_env.control import TERMINATION_PENALTY, ControlTask
from indexer_env.env import IndexerEnv
from indexer_env.registration import MAX_EPISODE_STEPS

PAGE = (Path(__file__).parents[3] / "docs" / "reference" / "environments" / "indexer.md").read_text(encoding="utf-8")


def test_it_has_gymnasium_s_headings():
    headings = [
        "Description", "Action Space", "Observation Space", "Rewards", "Starting State", "Episode End", "Arguments",
        "Baselines", "Version History",
    ]  # fmt: skip
    assert re.findall(r"^## (.*)$", PAGE, flags=re.MULTILINE) == headings


def test_every_argument_stands_there_with_its_default():
    section = PAGE.partition("## Arguments")[2]
    rows = {}
    for names, value in re.findall(r"^\| (`.*?`) \| (.*?) \|", section, flags=re.MULTILINE):
        for name, default in zip(names.split(", "), value.split(", "), strict=False):
            rows[name.strip("`")] = default.strip("`")
    own = inspect.signature(IndexerEnv).parameters
    task = inspect.signature(ControlTask).parameters
    assert set(rows) == (set(own) - {"task"}) | set(task)
    for name, parameter in {**own, **task}.items():
        if name == "task":
            continue
        if isinstance(parameter.default, float):
            number = float(rows[name].split()[0]) * (1e-3 if rows[name].endswith("ms") else 1.0)
            assert number == pytest.approx(parameter.default), name
        else:
            assert rows[name].strip('"') == str(parameter.default), name


def test_its_numbers_are_those_of_the_code():
    limits = IndexerEnv().limits
    assert f"{limits.vibration:.2f} rad/s²" in PAGE and f"{limits.acceleration:g} rad/s²" in PAGE
    assert f"r = −{TERMINATION_PENALTY:g}" in PAGE and f"after {MAX_EPISODE_STEPS} periods" in PAGE
    env = gymnasium.make("indexer_env/Indexer-v1")
    assert str(env.action_space) in PAGE and str(env.observation_space) in PAGE


def test_the_least_looseness_that_the_step_resolves():
    assert "less loose than 0.006" in PAGE
    IndexerEnv(faults={"screw_looseness": 0.006}).reset()
    with pytest.raises(ParameterError, match=r"IndexerEnv\.step must be <= "):
        IndexerEnv(faults={"screw_looseness": 0.0057})
