from importlib import import_module
from pathlib import Path

import pytest

import indexer_experiments

FOLDER = Path(indexer_experiments.__file__).parent
PACKAGES = sorted(".".join(path.parent.relative_to(FOLDER.parent).parts) for path in FOLDER.rglob("__init__.py"))


def test_the_packages_are_found():
    assert {"indexer_experiments", "indexer_experiments.study.claims"} <= set(PACKAGES)


@pytest.mark.parametrize("name", PACKAGES)
def test_the_docstring_is_a_map_of_all_modules(name):
    package = import_module(name)
    folder = Path(str(package.__file__)).parent
    modules = {path.stem for path in folder.glob("*.py")} - {"__init__"}
    rooms = {f"{path.parent.name}/" for path in folder.glob("*/__init__.py")}
    assert {word for word in modules | rooms if f"\n    {word} " not in (package.__doc__ or "")} == set()
