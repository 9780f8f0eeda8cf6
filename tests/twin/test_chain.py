"""From CSV files of a machine that nobody knows to a twin and its answers; slow."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest
import yaml

ROOT = Path(__file__).parents[2]


def indexer(*arguments: str) -> subprocess.CompletedProcess[str]:
    return subprocess.run(
        [sys.executable, "-m", "indexer_cli", *arguments], cwd=ROOT, capture_output=True, text=True, check=False
    )


@pytest.mark.slow
def test_a_bench_becomes_a_twin_that_names_what_came_on_which_day(tmp_path):
    from examples.twin_bench import make_bench

    make_bench(tmp_path)
    few = ["faults=[crack,loose_base,reducer_play,friction]", "simulated=3000", "epochs=16"]
    made = indexer("twin", f"healthy={tmp_path / 'healthy'}", f"out={tmp_path / 'twin'}", *few)
    assert made.returncode == 0, made.stderr
    about = yaml.safe_load((tmp_path / "twin" / "twin.yaml").read_text(encoding="utf-8"))
    assert [found["effect"] for found in about["calibration"]["findings"]] == ["friction.coulomb"]
    assert about["check"]["trusted"] and not (tmp_path / "twin" / "data").exists()
    again = indexer("twin", f"healthy={tmp_path / 'healthy'}", f"out={tmp_path / 'twin'}", *few)
    assert again.returncode == 0 and "learning" not in again.stderr + again.stdout
    wanted = {"monday": "Healthy", "tuesday": "Faulty: cracked rollers", "wednesday": "Faulty: play in the reducer"}
    for day, headline in wanted.items():
        out = tmp_path / day
        said = indexer("twin-diagnose", f"twin={tmp_path / 'twin'}", f"signal={tmp_path / 'days' / day}", f"out={out}")
        assert said.returncode == 0 and headline in said.stdout, (day, said.stdout, said.stderr)
        assert headline in (out / "answer.html").read_text(encoding="utf-8")
    june = tmp_path / "june"
    said = indexer("twin-update", f"twin={tmp_path / 'twin'}", f"healthy={tmp_path / 'healthy'}", f"out={june}")
    assert said.returncode == 0 and "has not moved since; the networks are kept" in said.stdout, said.stderr
