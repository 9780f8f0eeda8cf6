"""Rows with their verdicts, results.json, and the table between the markers of README.md."""

from __future__ import annotations

import dataclasses
import json
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

FOLDER = Path(__file__).parent
RESULTS = FOLDER / "results.json"
README = FOLDER / "README.md"
BEGIN, END = "<!-- table: written by python -m benchmarks -->", "<!-- end of table -->"

SECTIONS = (
    "accuracy",
    "speed",
    "kernel",
    "growth",
    "environment",
    "gpu",
    "datagen",
    "parquet",
    "reading",
    "training",
    "diagnosing",
    "peers",
)


@dataclass(frozen=True)
class Row:
    """One line of the table.

    Attributes
    ----------
    what, required, measured : str
        `required` is empty where a number stands for comparison only.
    met : bool or None
        None where nothing is required or nothing could be measured.
    numbers : dict
        The measured numbers behind the sentence, SI units unless a name says otherwise.
    session : dict or None
        When and where it was measured; None: with its section.
    """

    what: str
    required: str
    measured: str
    met: bool | None = None
    numbers: dict[str, Any] = field(default_factory=dict)
    session: dict[str, str] | None = None

    @property
    def verdict(self) -> str:
        """Word of the last column."""
        if self.met is None:
            return "not measured" if self.required else ""
        return "met" if self.met else "**missed**"

    def plain(self) -> dict[str, Any]:
        """As results.json has it."""
        return {key: value for key, value in dataclasses.asdict(self).items() if key != "session" or value is not None}


def number(value: float) -> str:
    """A number in few digits, powers of ten as the requirements are written."""
    if value == 0.0:
        return "0"
    if 1e-2 <= abs(value) < 1e5:
        return f"{value:,.0f}".replace(",", "\u2009") if abs(value) >= 100.0 else f"{value:.3g}"
    mantissa, exponent = f"{value:.1e}".split("e")
    return f"{mantissa}e{int(exponent)}"


def store(section: str, rows: list[Row], session: dict[str, str], *, part: bool = False) -> None:
    """Replace a section of results.json, or a part of it: the rows that bear the same names and are of this session
    then, while the others stay as they were measured. Write the README's table anew."""
    results = json.loads(RESULTS.read_text(encoding="utf-8")) if RESULTS.is_file() else {}
    if part and section in results:
        new = {row.what: dataclasses.replace(row, session=session).plain() for row in rows}
        held = results[section]
        named = {row["what"]: row for row in held["rows"]} | new
        results[section] = {"session": held["session"], "rows": list(named.values())}
    else:
        results[section] = {"session": session, "rows": [row.plain() for row in rows]}
    results = {name: results[name] for name in SECTIONS if name in results}
    RESULTS.write_text(json.dumps(results, indent=1, ensure_ascii=False) + "\n", encoding="utf-8")
    text = README.read_text(encoding="utf-8")
    README.write_text(with_table(text, markdown(results)), encoding="utf-8")


def with_table(text: str, table: str) -> str:
    """The text with what stands between its markers replaced."""
    before, begin, rest = text.partition(BEGIN)
    _, end, after = rest.partition(END)
    if not begin or not end:
        raise ValueError(f"benchmarks/README.md must hold the markers {BEGIN!r} and {END!r}.")
    return f"{before}{BEGIN}\n{table}\n{END}{after}"


def markdown(results: dict[str, Any]) -> str:
    """Header and table of the stored results."""
    lines = []
    for name, section in results.items():
        lines.append(f"- {name}: {_told(section['session'])}")
        alone: dict[str, list[str]] = {}
        for values in section["rows"]:
            if "session" in values:
                alone.setdefault(_told(values["session"]), []).append(values["what"])
        lines += [f"- of {name}, {'; '.join(rows)}: {told}" for told, rows in alone.items()]
    lines += ["", "| what | required | measured | verdict |", "|---|---|---|---|"]
    for section in results.values():
        for values in section["rows"]:
            row = Row(**values)
            lines.append(f"| {row.what} | {row.required} | {row.measured} | {row.verdict} |")
    return "\n".join(lines)


def _told(session: dict[str, str]) -> str:
    """A session in a line."""
    return (
        f"{session['date']}, {session['processor']}, {session['cores']}, load at the start {session['load']}; "
        f"{session['versions']}"
    )
