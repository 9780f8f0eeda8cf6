"""Print the effect library as the Markdown table of docs/reference/effects.md: ``python -m indexer_env.effects``."""

from __future__ import annotations

import dataclasses

from indexer_env.effects import EFFECTS, Effect


def _range(rules: dict) -> str:
    low = "" if rules["low"] is None else f"{'>' if rules['low_open'] else '≥'} {rules['low']:g}"
    high = "" if rules["high"] is None else f"{'<' if rules['high_open'] else '≤'} {rules['high']:g}"
    return ", ".join(bound for bound in (low, high) if bound) or "any"


def _parameters(effect: type[Effect]) -> str:
    lines = []
    for field in dataclasses.fields(effect):
        rules = dict(field.metadata)
        given = f"null {rules['null']:g}" if rules["null"] is not None else f"default {field.default:g}"
        lines.append(f"`{field.name}` {rules['meaning']} [{rules['unit']}], {_range(rules)}, {given}")
    return "<br>".join(lines)


def effects_page() -> str:
    """The page docs/reference/effects.md: one row per effect of the library."""
    head = """# The effect library

Effects by which the model can be extended (`indexer_env.effects`). In YAML they stand under a machine's `effects:` by
name; in Python `make_effect(name, …)` builds one and `machine.with_effects(…)` adds it. At its null value an effect
leaves the machine bit-equal to the machine without it. Effects whose name begins with `sensor.` extend a `Sensor`.
The paper among the sources, and the equations to which effects add, stand in
[physics](../explanation/physics.md). This page is printed by `python -m indexer_env.effects`; a test keeps it so.

| name | what it is | equation | parameters | enters | source |
| --- | --- | --- | --- | --- | --- |
"""
    rows = []
    for name, effect in sorted(EFFECTS.items()):
        cells = (f"`{name}`", effect.sentence, effect.equation, _parameters(effect), effect.enters, effect.source)
        rows.append("| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |")
    return head + "\n".join(rows) + "\n"


if __name__ == "__main__":
    print(effects_page(), end="")
