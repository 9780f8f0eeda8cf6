from pathlib import Path

import classifier.study
from classifier.study import claims

FOLDER = Path(classifier.study.__file__).parent


def test_the_docstrings_are_maps_of_all_modules():
    for package, folder in ((classifier.study, FOLDER), (claims, FOLDER / "claims")):
        modules = {path.stem for path in folder.glob("*.py")} - {"__init__"}
        assert {word for word in modules if f"\n    {word} " not in (package.__doc__ or "")} == set()
