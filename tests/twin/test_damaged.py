"""A twin whose folder is damaged ends in a sentence that names the file and why it cannot be read."""

from __future__ import annotations

import errno
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest
import yaml

from indexer_env.errors import ParameterError
from tests.monitor.twins import twin_folder
from twin.twin import Twin


@pytest.fixture(scope="module")
def sound(tmp_path_factory) -> Path:
    folder = twin_folder(tmp_path_factory.mktemp("twin") / "twin")
    Twin.load(folder)
    return folder


def short(path: Path) -> None:
    path.write_bytes(path.read_bytes()[: path.stat().st_size // 2])


def without(key: str, below: str | None = None) -> Callable[[Path], None]:
    def damage(path: Path) -> None:
        about = yaml.safe_load(path.read_text())
        del (about if below is None else about[key])[below or key]
        path.write_text(yaml.safe_dump(about))

    return damage


def holding(text: str) -> Callable[[Path], None]:
    def damage(path: Path) -> None:
        path.write_text(text)

    return damage


def of_another(path: Path) -> None:
    shutil.copy(path.with_name("synthesis.safetensors"), path)


@pytest.mark.parametrize(
    ("file", "damage", "said"),
    [
        *((f"{name}.safetensors", short, "") for name in ("modes_0", "remains", "synthesis")),
        ("modes_0.safetensors", of_another, "its arrays are not this network's"),
        ("remains.safetensors", of_another, "it lacks remains.points"),
        ("posterior.parquet", short, ""),
        ("posterior.parquet", Path.unlink, "No such file or directory"),
        ("posterior.parquet", holding(""), ""),
        ("machine.yaml", holding("reduction: ["), "expected"),
        ("machine.yaml", Path.unlink, "No such file or directory"),
        ("sensor.yaml", holding("gain: ["), "expected"),
        ("sensor.yaml", holding(""), "it holds no mapping"),
        ("sensor.yaml", holding("gain: much"), "sensor.gain must be"),
        ("twin.yaml", holding("format: ["), "expected"),
        ("twin.yaml", without("check"), "it lacks check"),
        ("twin.yaml", without("judge", "alarm"), "it lacks judge.alarm"),
        ("twin.yaml", without("settings", "faults"), "it lacks settings.faults"),
    ],
)
def test_a_damaged_file_is_named_with_the_reason(sound, tmp_path, file, damage, said):
    folder = shutil.copytree(sound, tmp_path / "twin")
    damage(folder / file)
    with pytest.raises(ParameterError) as error:
        Twin.load(folder)
    sentence = str(error.value)
    assert sentence.startswith(f"{folder / file} cannot be read (") and sentence.endswith("); make the twin anew.")
    assert said in sentence and "()" not in sentence and "\n" not in sentence


def test_a_file_of_another_user_is_no_damage(sound, monkeypatch):
    def refused(path: Path, *given: object) -> None:
        raise PermissionError(errno.EACCES, "Permission denied", str(path))

    monkeypatch.setattr(Path, "open", refused)
    with pytest.raises(ParameterError, match=r"cannot be read \(Permission denied\); let this user read it\."):
        Twin.load(sound)


def test_a_head_that_ends_too_early_is_never_taken_for_whole(sound, tmp_path):
    """Wherever it ends before the check, which is written last."""
    folder = shutil.copytree(sound, tmp_path / "twin")
    about = yaml.safe_load((sound / "twin.yaml").read_text())
    text = yaml.safe_dump(
        {**{k: v for k, v in about.items() if k != "check"}, "check": about["check"]}, sort_keys=False
    )
    whole = text.index("check:")
    for end in range(1, whole, 37):
        (folder / "twin.yaml").write_text(text[:end])
        with pytest.raises(ParameterError):
            Twin.load(folder)
