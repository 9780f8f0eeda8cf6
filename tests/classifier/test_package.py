import ast
import subprocess
import sys
from pathlib import Path

import pytest

import classifier
import classifier.tasks

FOLDER = Path(classifier.__file__).parent


def test_the_package_itself_loads_nothing_heavy():
    heavy = ("torch", "matplotlib", "scipy", "numba")
    code = f"import sys, classifier; print([name for name in {heavy} if name in sys.modules])"
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True, cwd=FOLDER.parent)
    assert done.stdout.strip() == "[]"


@pytest.mark.parametrize("package", [classifier, classifier.tasks])
def test_the_docstring_is_a_map_of_all_modules(package):
    folder = Path(package.__file__).parent
    modules = {path.stem for path in folder.glob("*.py")} - {"__init__"}
    rooms = {f"{path.parent.name}/" for path in folder.glob("*/__init__.py")}
    assert {word for word in modules | rooms if f"\n    {word} " not in (package.__doc__ or "")} == set()


def test_nothing_is_unpickled():
    for path in FOLDER.rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text())):
            names = [alias.name for alias in node.names] if isinstance(node, ast.Import | ast.ImportFrom) else []
            assert "pickle" not in names
            if isinstance(node, ast.Call) and isinstance(node.func, ast.Attribute):
                assert ast.unparse(node.func) not in {
                    "torch.load",
                    "np.load",
                    "yaml.load",
                    "yaml.unsafe_load",
                }, path
