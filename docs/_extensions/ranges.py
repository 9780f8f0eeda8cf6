"""The range of a key, read from the checks of the code that refuse a value outside of it.

A check is a call `check_number("Sensor", "gain", ..., low=0.0)`. Calls are found in the sources, in loops over names
written out as well; owner and name lead from a key to its check. What is checked in another way has no range here.
"""

from __future__ import annotations

import ast
import functools
import importlib
import itertools
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

from sources import ROOT, root_packages

from indexer_cli.typed_keys import OWNERS
from indexer_cli.verbs import VERBS
from indexer_env.units import ENDINGS

CHECKS = ("check_number", "check_integer", "check_choice")

GROUP_OWNERS = {
    "machine": ("Machine", "Joint"),
    "operating_point": ("OperatingPoint",),
    "sensor": ("Sensor",),
    "campaign": ("campaign", "split"),
    "features": ("Psd", "Fft"),
    "net": ("Mlp",),
    "faults_law": ("Faults", "Course"),
    "diagnosis": ("DiagnosisTask", "Faults"),
    "size": ("size",),
}
"""Folder of conf/ -> who owns the parameters of its files; those of the training rules are known by their module."""


class Check(NamedTuple):
    """One check: where it stands, whose parameter it is ("" where only the running program knows) and the rule."""

    module: str
    owner: str
    name: str
    rule: str
    low: float | None
    high: float | None


def of(owner: str, key: str) -> str:
    """The rule for a key of a verb or a folder of conf/, "" where no check states one."""
    section, _, name = key.rpartition(".")
    ending = next((ending for ending in ENDINGS if name.endswith(ending)), "")
    found = [
        check for check in checks() if check.name in (name, name.removesuffix(ending)) and _is_of(check, owner, section)
    ]
    own = [check for check in found if check.name == name] or found
    texts = {_told(check, ending if check.name != name else "") for check in own}
    return texts.pop() if len(texts) == 1 else ""


def _is_of(check: Check, owner: str, section: str) -> bool:
    if owner == "trainer":
        return check.module.startswith("classifier.trainers.")
    if owner == "campaign" and section:  # what a campaign draws is the machine's, and each record's own
        return check.owner == section
    if owner in GROUP_OWNERS:
        return check.owner in GROUP_OWNERS[owner]
    if section:
        last = section.rpartition(".")[2]
        return check.owner == last or last in OWNERS.get(check.owner, ())
    return check.owner in (owner, VERBS[owner].module.partition(".")[0], VERBS[owner].module.rpartition(".")[2])


def _told(check: Check, ending: str) -> str:
    factor = ENDINGS[ending].factor if ending else 1.0
    low, high = ("" if bound is None else f"{bound / factor:.6g}" for bound in (check.low, check.high))
    return check.rule.format(low=low, high=high)


@functools.cache
def checks() -> tuple[Check, ...]:
    """All checks of all packages."""
    paths = itertools.chain.from_iterable(sorted((ROOT / root).rglob("*.py")) for root in root_packages())
    return tuple(check for path in paths for check in _checks_in(path))


def _checks_in(path: Path) -> Iterator[Check]:
    text = path.read_text(encoding="utf-8")
    if not any(f"{name}(" in text for name in CHECKS):
        return
    module = ".".join(path.relative_to(ROOT).with_suffix("").parts)
    names = vars(importlib.import_module(module))
    for node, local in _calls(ast.parse(text), [{}]):
        for values in local:
            yield from _check(node, module, names, values)


def _calls(node: ast.AST, local: list[dict[str, Any]]) -> Iterator[tuple[ast.Call, list[dict[str, Any]]]]:
    """Calls of checks, each with what the loops around it give to their variables, round by round."""
    for child in ast.iter_child_nodes(node):
        if isinstance(child, ast.For):
            yield from _calls(child, _rounds(child, local))
            continue
        if isinstance(child, ast.Assign) and isinstance(child.targets[0], ast.Name):
            local = [{**values, child.targets[0].id: _Expression(child.value, values)} for values in local]
        if isinstance(child, ast.Call) and isinstance(child.func, ast.Name) and child.func.id in CHECKS:
            yield child, local
        yield from _calls(child, local)


def _rounds(loop: ast.For, local: list[dict[str, Any]]) -> list[dict[str, Any]]:
    targets = loop.target.elts if isinstance(loop.target, ast.Tuple) else [loop.target]
    if not isinstance(loop.iter, ast.Tuple) or not all(isinstance(target, ast.Name) for target in targets):
        return local
    names = [target.id for target in targets if isinstance(target, ast.Name)]
    rounds = []
    for item in loop.iter.elts:
        parts = item.elts if len(names) > 1 and isinstance(item, ast.Tuple) else [item]
        rounds.append({name: _Expression(part) for name, part in zip(names, parts, strict=False)})
    return [{**outer, **inner} for outer in local for inner in rounds]


class _Expression:
    """An expression that is worked out once its module is known."""

    def __init__(self, node: ast.expr, local: dict[str, _Expression] | None = None) -> None:
        self.node = node
        self.local = local or {}


_UNKNOWN = object()


def _value(node: ast.expr | None, names: dict[str, Any], local: dict[str, Any]) -> Any:
    if node is None:
        return None
    used = {part.id for part in ast.walk(node) if isinstance(part, ast.Name)} & local.keys()
    known = {name: _value(local[name].node, names, local[name].local) for name in used}
    try:
        code = compile(ast.Expression(node), "<check>", "eval")
        return eval(code, {**names, **{name: value for name, value in known.items() if value is not _UNKNOWN}})
    except Exception:  # it names what only the running function has
        return _UNKNOWN


def _check(call: ast.Call, module: str, names: dict[str, Any], local: dict[str, Any]) -> Iterator[Check]:
    owner, name = (_value(node, names, local) for node in call.args[:2])
    if not isinstance(name, str):
        return
    owner = owner if isinstance(owner, str) else ""
    if call.func.id == "check_choice":  # pyright: ignore
        choices = _value(call.args[3] if len(call.args) > 3 else None, names, local)
        if choices is not _UNKNOWN and choices:
            yield Check(module, owner, name, " or ".join(map(str, choices)).replace("{", "{{"), None, None)
        return
    given = {word.arg: _value(word.value, names, local) for word in call.keywords if word.arg}
    whole = "whole" if call.func.id == "check_integer" else ""  # pyright: ignore
    low, high = (given.get(end) if isinstance(given.get(end), (int, float)) else None for end in ("low", "high"))
    parts = [whole] if whole else []
    if low is not None:
        parts.append(("> " if given.get("low_open") is True else "≥ ") + "{low}")
    if high is not None:
        parts.append(("< " if given.get("high_open") is True else "≤ ") + "{high}")
    yield Check(module, owner, name, ", ".join(parts) or "any number", low, high)
