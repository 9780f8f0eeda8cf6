from pathlib import Path

import pytest

import classifier.compare
import classifier.compare.methods
import classifier.tasks


@pytest.mark.parametrize("package", [classifier.compare, classifier.compare.methods, classifier.tasks])
def test_the_docstring_is_a_map_of_all_modules(package):
    text = package.__doc__ or ""
    modules = {path.stem for path in Path(package.__file__).parent.glob("*.py")} - {"__init__"}
    assert {word for word in modules if f"\n    {word} " not in text} == set()
