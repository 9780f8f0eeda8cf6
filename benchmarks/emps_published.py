"""Whether a report on the measured EMPS drive holds what is published: ``python -m benchmarks.emps_published REPORT``

REPORT is the report.json of an explanation that began from inertia alone. Published (Janot, Gautier and Brunot,
Data set and reference models of EMPS, 2019): M q̈ + Fv q̇ + Fc sign(q̇) + offset = force. Exits with 1 where a number
is missing or its 95 % interval does not hold it. A member of a family counts: the records cannot tell which it is.
"""

from __future__ import annotations

import argparse
import json
import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from indexer_experiments.tables import table

PUBLISHED = {
    "mass": (95.1, "kg"),
    "friction.viscous.coefficient": (203.5, "N s/m"),
    "friction.coulomb.force": (20.4, "N"),
    "offset.force": (-3.2, "N"),
}
"""Value and unit of each parameter by the report's names."""

NAMED = ("established", "family")
"""Grades under which a finding says what is there."""

Row = tuple[str, float, str, str, bool]
"""Name, published value, interval, grade, and whether the interval holds the value."""


def against_published(report: Mapping[str, Any]) -> list[Row]:
    """The published parameters beside what a report (its JSON) says of them."""
    said: dict[str, tuple[str, list[float]]] = {
        estimate["name"]: ("calibrated", estimate["interval"]) for estimate in report["calibration"]["parameters"]
    }
    for finding in report["findings"]:
        for effect in finding["effects"] if finding["grade"] in NAMED else ():
            for estimate in effect["parameters"]:
                said[f"{effect['name']}.{estimate['name']}"] = (finding["grade"], estimate["interval"])
    rows = []
    for name, (value, unit) in PUBLISHED.items():
        grade, interval = said.get(name, ("not found", None))
        if interval is None:
            rows.append((name, value, "–", grade, False))
        else:
            low, high = interval
            rows.append((name, value, f"{low:.4g} to {high:.4g} {unit}", grade, low <= value <= high))
    return rows


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("report", type=Path)
    rows = against_published(json.loads(parser.parse_args().report.read_text(encoding="utf-8")))
    head = ["parameter", "published", "95 % interval", "grade", "holds it"]
    cells = [[name, f"{value:g}", text, grade, "yes" if ok else "no"] for name, value, text, grade, ok in rows]
    print(table(head, cells))
    sys.exit(0 if all(ok for *_, ok in rows) else 1)


if __name__ == "__main__":
    main()
