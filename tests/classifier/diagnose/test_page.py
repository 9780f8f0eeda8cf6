"""docs/how-to/diagnosis.md: its program runs, its keys are those of conf/, its numbers those of the code."""

import re
from pathlib import Path

import numpy as np
import pytest
import yaml

from classifier import conditions, model
from classifier.diagnose import attribution
from indexer_env.presets import config_dir
from indexer_records import resample
from indexer_records.measured import RATE_TOLERANCE

PAGE = (Path(__file__).parents[3] / "docs" / "how-to" / "diagnosis.md").read_text(encoding="utf-8")


def test_its_program_runs(result, dataset, monkeypatch, capsys):
    (program,) = re.findall(r"```python\n(.*?)```", PAGE, flags=re.DOTALL)
    monkeypatch.setattr(model, "load_model", lambda path: result.model)
    time = np.arange(round(5.2 * 2560)) / 2560
    samples = np.sin(2 * np.pi * 20 * time) + 1.07 * np.random.default_rng(0).standard_normal(time.size)
    pulse = 5.0 * ((time - 0.3) % 2.0 < 0.1) * (time > 0.3)
    pieces = zip(np.array_split(samples, 50), np.array_split(pulse, 50), strict=True)
    exec(program.replace('"m/s^2"', '"rad/s^2"'), {"logger": pieces})
    assert capsys.readouterr().out.splitlines() == ["0 rings at 20 Hz", "1 rings at 20 Hz"]


@pytest.mark.parametrize("command", ["diagnose", "export", "tune", "train"])
def test_its_keys_are_those_of_the_configurations(command):
    config = yaml.safe_load((config_dir() / f"{command}.yaml").read_text(encoding="utf-8"))
    groups = {"net", "trainer", "features"}
    for line in re.findall(rf"indexer {command} (.*)", PAGE):
        for key in re.findall(r"([\w.]+)=", line):
            head, _, tail = key.partition(".")
            assert head in groups or (head in config and (not tail or tail in config[head])), key


def test_its_numbers_are_those_of_the_code():
    assert f"within {100 * RATE_TOLERANCE:g} % of the model's" in PAGE
    assert f"{100 * conditions.TOLERANCE['sensor_radius']:g} % off is refused" in PAGE
    assert f"The speed may be {100 * conditions.TOLERANCE['motor_speed']:g} % off" in PAGE
    assert f"one value over {100 * conditions.CONSTANT:g} % more" in PAGE
    assert f"({100 * conditions.CLIPPED:g} % more clipped samples)" in PAGE
    assert f"resampled, {resample.REACH} samples" in PAGE.replace("\n", " ")
    assert attribution.COMPLETE == 1e-9 and "(to 1e-9, tested)" in PAGE
    assert attribution.BANDS == 10 and "ten bands" in PAGE
