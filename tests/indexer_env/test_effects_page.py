from pathlib import Path

from indexer_env.effects import EFFECTS
from indexer_env.effects.__main__ import effects_page

PAGE = Path(__file__).parents[2] / "docs" / "reference" / "effects.md"


def test_the_page_is_what_the_library_prints():
    assert PAGE.read_text(encoding="utf-8") == effects_page(), "run: python -m indexer_env.effects > " + str(PAGE)


def test_every_effect_has_its_row():
    assert all(f"| `{name}` |" in effects_page() for name in EFFECTS)
