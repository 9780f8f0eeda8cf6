"""Where commands read and write: paths, file:// and URLs, alone and in a sweep."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace

import pytest

from indexer_cli import job_paths
from indexer_cli.job_paths import job_place, path_given


def test_a_file_url_is_the_path_on_this_machine(tmp_path: Path) -> None:
    assert path_given("simulate", "out", f"file://{tmp_path}/x") == tmp_path / "x"
    assert job_place("generate", f"file://{tmp_path}/x") == str(tmp_path / "x")


@pytest.mark.parametrize("out", ["s3://bucket/sweep", "s3://bucket/sweep/"])
def test_each_job_of_a_sweep_has_a_folder_in_the_url(out: str, monkeypatch: pytest.MonkeyPatch) -> None:
    """A store takes "sweep//3" for another folder than "sweep/3"."""
    monkeypatch.setattr(job_paths, "in_sweep", lambda: True)
    monkeypatch.setattr(job_paths.HydraConfig, "get", lambda: SimpleNamespace(job=SimpleNamespace(num=3)))
    assert job_place("generate", out) == "s3://bucket/sweep/3"
