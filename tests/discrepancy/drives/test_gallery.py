"""The gallery's drives through the search: what is hidden is named, and the pages show programs that run."""

import re
from pathlib import Path

import pytest

from discrepancy.drives.channels import read_drive_records
from discrepancy.drives.description import load_drive
from discrepancy.drives.door import subject_of
from discrepancy.explain import explain
from indexer_experiments.challenge.drives.gallery import GALLERY, write

ROOT = Path(__file__).parents[3]
EXAMPLES = ROOT / "examples" / "drives"


def _lines(file: Path) -> int:
    return len([line for line in file.read_text().splitlines() if line.strip()])


@pytest.mark.parametrize("name", sorted(GALLERY))
def test_a_drive_is_short_and_its_records_are_read(name: str, tmp_path: Path) -> None:
    assert _lines(EXAMPLES / f"{name}.py") <= 16
    if name in ("feed_axis", "robot_joint", "pick_and_place"):
        write(name, tmp_path)
        drive = load_drive(EXAMPLES / f"{name}.py")
        records = read_drive_records(drive, str(tmp_path), None, {}, [])
        assert [record.held_out for record in records].count(True) == 1
        assert set(GALLERY[name][1]) & set(subject_of(drive, records).model.hypotheses())


@pytest.mark.slow
@pytest.mark.parametrize("name", sorted(GALLERY))
def test_what_is_hidden_is_named(name: str, tmp_path: Path) -> None:
    """Seed 0."""
    write(name, tmp_path)
    drive = load_drive(EXAMPLES / f"{name}.py")
    subject = subject_of(drive, read_drive_records(drive, str(tmp_path), None, {}, []))
    answer = explain(subject.model, subject.held_out)
    named = [finding for finding in answer.findings if finding.grade in ("established", "family")]
    right = [f for f in named if {effect.name for effect in f.effects} & set(GALLERY[name][1])]
    assert right and len(named) == len(right), [(f.grade, f.name) for f in answer.findings]
    assert answer.after < 0.25 * answer.before


def _programs(page: str) -> list[str]:
    return re.findall(r"```python\n(.*?)```", (ROOT / "docs" / page).read_text(encoding="utf-8"), re.DOTALL)


def test_the_files_of_the_pages_are_those_that_run(tmp_path: Path) -> None:
    (first,), others = _programs("tutorials/drives.md"), _programs("how-to/own_drive.md")
    assert others
    drive = load_drive(_written(tmp_path / "my_drive.py", first))
    given = load_drive(EXAMPLES / "feed_axis.py")
    assert (drive.parameters, drive.channels, drive.known) == (given.parameters, given.channels, given.known)
    own = load_drive(_written(tmp_path / "own.py", "\n".join([first, *others])))
    assert {effect.name for effect in own.effects} - {effect.name for effect in drive.effects} == {"grease"}


def _written(path: Path, text: str) -> Path:
    path.write_text(text, encoding="utf-8")
    return path
