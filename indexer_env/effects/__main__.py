"""Print the effect library as the Markdown table of docs/reference/effects.md: ``python -m indexer_env.effects``."""

from __future__ import annotations

import dataclasses
import itertools
from collections.abc import Mapping

from indexer_env.effects import EFFECTS, TABLES, Effect


def _range(rules: dict) -> str:
    low = "" if rules["low"] is None else f"{'>' if rules['low_open'] else '≥'} {rules['low']:g}"
    high = "" if rules["high"] is None else f"{'<' if rules['high_open'] else '≤'} {rules['high']:g}"
    return ", ".join(bound for bound in (low, high) if bound) or "any"


def _parameters(effect: type[Effect]) -> str:
    """A line for each parameter; parameters side by side that only differ in the name have one line."""
    lines = []
    for rules, alike in itertools.groupby(dataclasses.fields(effect), lambda field: dict(field.metadata)):
        field, *others = alike
        names = f"`{field.name}` … `{others[-1].name}`" if others else f"`{field.name}`"
        given = f"default {field.default:g}" if field.default is not dataclasses.MISSING else "to be given"
        given = given if rules["null"] is None else f"null {rules['null']:g}"
        lines.append(f"{names} {rules['meaning']} [{rules['unit']}], {_range(rules)}, {given}")
    return "<br>".join(lines)


def effects_page() -> str:
    """The page docs/reference/effects.md: one row per effect of the library."""
    head = """# The effect library

Effects by which the model can be extended (`indexer_env.effects`). In YAML they stand under a machine's `effects:` by
name; in Python `make_effect(name, …)` builds one and `machine.with_effects(…)` adds it. At its null value an effect
leaves the machine bit-equal to the machine without it. Effects whose name begins with `sensor.` extend a `Sensor`.
The paper among the sources, and the equations to which effects add, stand in
[physics](../explanation/physics.md). This page is printed by `python -m indexer_env.effects`; a test keeps it so.

"""
    tables = """
## Tables, not laws

What remains after a search can be taken up as a table: a torque on the table, or an error of the cam's motion, as a
cubic spline through values at evenly spaced places, without curvature at its ends and constant beyond them; over a turn
it is closed. Over one variable there are nine places; over two variables five along each, seven along a turn (a tensor
product). The values of the second variable stand side by side: `torque_2_3` stands at the second place of the speed and
the third of the angle. Machines, campaigns and second looks take a table by its name like any effect, one to a machine;
no search proposes one.

"""
    return head + _rows(EFFECTS) + tables + _rows(TABLES)


def _rows(effects: Mapping[str, type[Effect]]) -> str:
    rows = ["| name | what it is | equation | parameters | enters | source |", "| --- | --- | --- | --- | --- | --- |"]
    for name, effect in sorted(effects.items()):
        cells = (f"`{name}`", effect.sentence, effect.equation, _parameters(effect), effect.enters, effect.source)
        rows.append("| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |")
    return "\n".join(rows) + "\n"


if __name__ == "__main__":
    print(effects_page(), end="")
