"""The API's pages: one a package, with its map and all its public modules, written from docstrings by autodoc."""

from __future__ import annotations

from collections.abc import Iterator

from sources import ROOT, root_packages

SKIPPED = ("__init__", "__main__")


def pages() -> dict[str, str]:
    """File name -> text."""
    found = {f"{package}.md": _page(package) for root in root_packages() for package in packages(root)}
    toctree = "\n".join(sorted(name.removesuffix(".md") for name in found if name.count(".") == 1))
    found["index.md"] = _INDEX.format(toctree=toctree)
    return found


_INDEX = """# API

Every public module, class and function, from its docstring. Each package's page begins with its map: its modules in
reading order. Numbers are in SI units and radians unless a name ends in a unit (`_deg`, `_rpm`, `_hz`, `_percent`).

```{{toctree}}
:maxdepth: 2

{toctree}
```
"""


def packages(root: str) -> Iterator[str]:
    """A package and the packages in it, by dotted name."""
    folder = ROOT / root
    for path in sorted(folder.rglob("__init__.py")):
        parts = path.parent.relative_to(ROOT).parts
        if not any(part.startswith(("_", ".")) for part in parts):
            yield ".".join(parts)


def modules(package: str) -> list[str]:
    """Public modules that lie in a package, by dotted name."""
    files = sorted((ROOT / package.replace(".", "/")).glob("*.py"))
    return [f"{package}.{path.stem}" for path in files if path.stem not in SKIPPED and not path.stem.startswith("_")]


def _page(package: str) -> str:
    inner = sorted(name for name in packages(package.replace(".", "/")) if name.count(".") == package.count(".") + 1)
    lines = [f"# {package}", "", *_automodule(package, members=False)]
    if inner:
        lines += ["```{toctree}", ":maxdepth: 1", "", *inner, "```", ""]
    for module in modules(package):
        lines += [f"## {module}", "", *_automodule(module)]
    return "\n".join(lines)


def _automodule(name: str, *, members: bool = True) -> list[str]:
    options = ["   :members:"] if members else []
    return ["```{eval-rst}", f".. automodule:: {name}", *options, "```", ""]
