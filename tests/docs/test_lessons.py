"""Tutorials and the guides for extending run as they stand, and print what they show."""

from pathlib import Path

import pytest

from tests.docs import lessons


@pytest.mark.parametrize("page", ["new_effect", "new_motion_law", "new_campaign"])
def test_a_guide_for_extending_runs(page: str, tmp_path: Path) -> None:
    assert lessons.run(f"how-to/{page}.md", tmp_path)


def test_the_first_record(tmp_path: Path) -> None:
    lessons.run("tutorials/first_record.md", tmp_path)
    assert (tmp_path / "tour" / "two_machines.png").is_file()


@pytest.mark.slow
@pytest.mark.parametrize("page", ["data_and_network", "policy", "missing_effect", "drives"])
def test_a_tutorial(page: str, tmp_path: Path) -> None:
    lessons.run(f"tutorials/{page}.md", tmp_path)


@pytest.mark.slow
def test_the_twin_s_tutorial(tmp_path: Path) -> None:
    lessons.run("tutorials/twin.md", tmp_path)
    assert (tmp_path / "demo" / "twin" / "report.html").is_file()
    assert (tmp_path / "demo" / "answer" / "answer.html").is_file()


def test_a_text_that_is_not_printed_is_found(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    page = tmp_path / "page.md"
    page.write_text("```sh\necho 3 apples\n```\n\n```text\n4 apples\n```\n", encoding="utf-8")
    monkeypatch.setattr(lessons, "DOCS", tmp_path)
    (tmp_path / "run").mkdir()
    assert "3 apples" in lessons.run("page.md", tmp_path / "run")
    page.write_text(page.read_text().replace("4 apples", "4 pears"), encoding="utf-8")
    (tmp_path / "again").mkdir()
    with pytest.raises(AssertionError, match="pears"):
        lessons.run("page.md", tmp_path / "again")


def test_a_command_that_fails_is_found(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "page.md").write_text("```sh\nfalse\ntrue\n```\n", encoding="utf-8")
    monkeypatch.setattr(lessons, "DOCS", tmp_path)
    (tmp_path / "run").mkdir()
    with pytest.raises(AssertionError, match="false"):
        lessons.run("page.md", tmp_path / "run")
