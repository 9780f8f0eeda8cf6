"""What is kept is made anew when a source, the test or a compiler has changed, and only then."""

from pathlib import Path

import pytest

from tests import kept as module
from tests.kept import kept


def test_a_text_is_made_once_for_sources_that_are_as_they_were(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    test, source, made = tmp_path / "test_a.py", tmp_path / "a.py", []
    test.write_text("test")
    source.write_text("one")

    def make() -> str:
        made.append(source.read_text())
        return f"{source.read_text()}\n\ncompiled"

    def texts() -> list[str]:
        return [kept("a", test, [source], make) for _ in range(2)]

    assert texts() == ["one\n\ncompiled"] * 2 and made == ["one"]
    source.write_text("two")
    assert texts() == ["two\n\ncompiled"] * 2 and made == ["one", "two"]
    test.write_text("another test")
    assert texts()[0] == "two\n\ncompiled" and len(made) == 3
    monkeypatch.setattr(module, "_COMPILERS", ("pytest",))
    assert texts()[0] == "two\n\ncompiled" and len(made) == 4
