"""What README shows must run as it stands."""

import re
from pathlib import Path

README = Path(__file__).parents[1] / "README.md"


SNIPPETS = re.findall(r"```python\n(.*?)```", README.read_text(encoding="utf-8"), flags=re.DOTALL)


def run(snippet: str) -> dict:
    names: dict = {}
    exec(compile(snippet, str(README), "exec"), names)  # the text of our own README
    return names


def test_the_environment_snippet_runs():
    names = run(SNIPPETS[1])
    assert names["observation"] in names["env"].observation_space and len(SNIPPETS) == 2


def test_the_simulation_snippet_runs(capsys):
    names = run(SNIPPETS[0])
    assert names["batch"].rejected == {} and names["batch"].table_acceleration.shape == (3, 8200)
    assert names["record"].std() > 1.0
    assert "15." in capsys.readouterr().out


def test_every_file_it_names_exists():
    text = README.read_text(encoding="utf-8")
    named = re.findall(r"`((?:docs|datagen|conf|benchmarks|examples)/[\w./]+)`|\]\(([\w./]+)\)", text)
    missing = [name for pair in named for name in pair if name and not (README.parent / name).exists()]
    assert not missing
