"""The environment's page says what the code does."""

import inspect
import re
from pathlib import Path

import gymnasium

from benchmarks.diagnosis import page
from indexer_env.diagnosis import BAND_HZ, BANDS, LEVELS
from indexer_env.diagnosis_env import IndexerDiagnosisEnv
from indexer_env.diagnosis_task import TURNS, DiagnosisTask

PAGE = page.PAGE.read_text(encoding="utf-8")


def test_it_has_gymnasium_s_headings():
    headings = [
        "Description", "Action Space", "Observation Space", "Rewards", "Starting State", "Episode End", "Arguments",
        "Baselines", "Version History",
    ]  # fmt: skip
    assert re.findall(r"^## (.*)$", PAGE, flags=re.MULTILINE) == headings


def test_every_argument_stands_there_with_its_default():
    section = PAGE.partition("## Arguments")[2].partition("## Baselines")[0]
    rows = dict(re.findall(r"^\| `(\w+)` \| `(.*?)` \|", section, flags=re.MULTILINE))
    parameters = dict(inspect.signature(IndexerDiagnosisEnv).parameters)
    parameters.pop("changes")
    assert {name: value.strip('"') for name, value in rows.items()} == {
        name: str(parameter.default) for name, parameter in parameters.items()
    }
    for field in inspect.signature(DiagnosisTask).parameters:
        assert f"`{field}`" in section or f"{field}:" in section


def test_its_numbers_are_those_of_the_code():
    env = gymnasium.make("indexer_env/IndexerDiagnosis-v1")
    assert str(env.action_space) in PAGE and str(env.observation_space) in PAGE
    own = env.unwrapped
    assert isinstance(own, IndexerDiagnosisEnv)
    assert f"from {own.costs.min():.3f} (1.3" in PAGE and f"to {own.costs.max():.3f} (0.4" in PAGE
    assert f"({own.task.time_price:g} per s)" in PAGE and f"({own.task.brake_price:g} per kJ)" in PAGE
    assert f"`right` ({own.task.right:g})" in PAGE and f"`wrong` ({own.task.wrong:g})" in PAGE
    assert f"c = {TURNS} (" in PAGE and f"97–{BANDS * BAND_HZ} Hz" in PAGE
    assert f"−{-LEVELS[0]:g} dB is −1, {LEVELS[1]:g} dB is 1" in PAGE
    for names in re.findall(r"name: (.*?) \|", PAGE):
        for name in names.split(", "):
            assert name in own.names
    assert [name for name in own.names if name not in PAGE] == []


def test_the_defaults_of_the_task_are_those_of_its_preset():
    preset = IndexerDiagnosisEnv().task
    for name, parameter in inspect.signature(DiagnosisTask).parameters.items():
        if parameter.default is not inspect.Parameter.empty:
            assert getattr(preset, name) == parameter.default, name


def test_its_tables_and_picture_are_those_of_the_results():
    """What is committed was written by one run of the command."""
    import json

    from benchmarks.report import with_table

    results = json.loads(page.RESULTS.read_text(encoding="utf-8"))
    assert with_table(PAGE, page.tables(results)) == PAGE
    assert results["names"] == list(IndexerDiagnosisEnv().names)
    assert Path(page.PICTURE).is_file()
