"""The packages keep to their import directions, to their declared dependencies, and do no work at import."""

import json
import os
import shutil
import subprocess
import sys
import tomllib
from importlib.metadata import packages_distributions
from pathlib import Path

import grimp
import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

ROOT = Path(__file__).parent.parent
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())
PACKAGES = PROJECT["tool"]["importlinter"]["root_packages"]
EXTRAS = {
    "pygame": {"indexer_env.render"},
    "stable_baselines3": {"indexer_env.stable_baselines"},
    "minari": {"indexer_env.minari_export"},
    "ray": {"datagen.executors.ray"},
    "sklearn": {"classifier.estimators", "indexer_experiments.compare"},
    "onnx": {"classifier.export"},
    "optuna": {"classifier.tune"},
    "amqtt": {"monitor"},
    "paho": {"monitor"},
    "prometheus_client": {"monitor"},
    "sqlalchemy": {"monitor"},
    "starlette": {"monitor"},
    "uvicorn": {"monitor"},
    "asyncua": {"monitor"},
    "cryptography": {"monitor"},
}
"""What only an extra installs, and the modules or packages that import it."""

LINT_IMPORTS = "from importlinter.cli import lint_imports_command; lint_imports_command()"

# Runs in a fresh interpreter: compilations are recorded from before the import, as are files opened to write.
IMPORT_PROBE = """
import json, sys, threading
from numba.core import event

written = []
sys.addaudithook(
    lambda name, args: written.append(str(args[0]))
    if name == "open" and isinstance(args[1], str) and set(args[1]) & set("wax+")
    else None
)
with event.install_recorder("numba:compile") as compilations:
    __import__(sys.argv[1])
json.dump(
    {
        "modules": sorted(sys.modules),
        "compilations": len(compilations.buffer),
        "threads": threading.active_count(),
        "written": written,
    },
    sys.stdout,
)
"""


def lint_imports(folder: Path) -> subprocess.CompletedProcess[str]:
    """Run import-linter on the packages of a folder."""
    return subprocess.run(
        [sys.executable, "-c", LINT_IMPORTS, "--no-logo", "--no-cache"],
        cwd=folder,
        env=os.environ | {"PYTHONPATH": str(folder), "PYTHONSAFEPATH": "1", "COLUMNS": "200"},
        capture_output=True,
        text=True,
        check=False,
    )


def test_import_contracts_hold() -> None:
    result = lint_imports(ROOT)
    assert result.returncode == 0, result.stdout + result.stderr


@pytest.mark.parametrize(
    ("importer", "line", "said"),
    [
        ("indexer_env/__init__.py", "import datagen", "indexer_env -> datagen"),
        ("datagen/__init__.py", "import classifier", "datagen -> classifier"),
        ("classifier/__init__.py", "import indexer_experiments", "classifier -> indexer_experiments"),
        ("indexer_env/kernels/__init__.py", "import scipy", "indexer_env.kernels imports scipy"),
        ("indexer_env/kernels/__init__.py", "import indexer_env", "indexer_env.kernels imports indexer_env"),
    ],
)
def test_import_contracts_catch_a_breach(tmp_path: Path, importer: str, line: str, said: str) -> None:
    """A project of empty packages under the same contracts passes, and fails with one wrong import."""
    shutil.copy(ROOT / "pyproject.toml", tmp_path)
    for folder in ["tests", "indexer_env/kernels", *PACKAGES]:
        (tmp_path / folder).mkdir(parents=True, exist_ok=True)
        (tmp_path / folder / "__init__.py").touch()
    shutil.copy(ROOT / "tests" / "contracts.py", tmp_path / "tests")
    kernels = tmp_path / "indexer_env" / "kernels" / "__init__.py"
    kernels.write_text("import math\nimport numba.cuda\nimport numpy\n")
    assert lint_imports(tmp_path).returncode == 0

    (tmp_path / importer).write_text(line + "\n")
    result = lint_imports(tmp_path)
    assert result.returncode == 1
    assert said in result.stdout


def test_third_party_imports_are_declared() -> None:
    """An installation without the extras has everything that the packages import, but for the modules of the extras."""
    graph = grimp.build_graph(*PACKAGES, include_external_packages=True, cache_dir=None)
    imported = {
        module
        for module in graph.modules
        if graph.is_module_squashed(module) and module.split(".")[0] not in sys.stdlib_module_names
    }
    for package, places in EXTRAS.items():
        below = set().union(*(graph.find_descendants(place) for place in places))
        assert graph.find_modules_that_directly_import(package) <= places | below
        imported.remove(package)
    declared = {canonicalize_name(Requirement(line).name) for line in PROJECT["project"]["dependencies"]}
    distributions = packages_distributions()
    undeclared = {
        module
        for module in imported
        if declared.isdisjoint(map(canonicalize_name, distributions.get(module.split(".")[0], [])))
    }
    assert "numba" in imported
    assert undeclared == set()


@pytest.mark.parametrize("package", PACKAGES)
def test_import_does_no_work(package: str, tmp_path: Path) -> None:
    """Importing a package compiles, prints, starts and writes nothing and loads no heavy library."""
    result = subprocess.run(
        [sys.executable, "-B", "-c", IMPORT_PROBE, package],
        cwd=tmp_path,
        env=os.environ | {"PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        check=False,
    )
    assert result.returncode == 0, result.stderr
    assert result.stderr == ""
    seen = json.loads(result.stdout)
    assert package in seen["modules"]
    assert {"torch", "matplotlib", "pandas", "hydra", "jax", *EXTRAS}.isdisjoint(seen["modules"])
    assert (seen["compilations"], seen["threads"], seen["written"]) == (0, 1, [])
    assert list(tmp_path.iterdir()) == []


def test_the_page_s_picture_is_the_contract():
    """docs/explanation/architecture.md: the picture's rows are the contract's layers; its table has every package."""
    page = (ROOT / "docs" / "explanation" / "architecture.md").read_text(encoding="utf-8")
    picture = page.split("```text\n")[1].split("```")[0]
    rows = [line.strip() for line in picture.splitlines() if line.strip() not in ("", "↑")]
    (layers,) = [c["layers"] for c in PROJECT["tool"]["importlinter"]["contracts"] if c["id"] == "layers"]
    assert rows == layers
    for package in PACKAGES:
        (row,) = [line for line in page.splitlines() if line.startswith(f"| `{package}` |")]
        assert (ROOT / row.split("`")[-2]).is_file() and row.split("`")[-2].startswith(package)
