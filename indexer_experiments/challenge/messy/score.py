"""What the messy challenge must show, beside what its rows show: one function a line, all from the neutral answers.

A finding names something where its grade is `established` or `family`; it is right where one of its members is hidden.
Ripple and transmission error of one order are the same motion: right is the one hidden, or a family that holds it.
"""

from __future__ import annotations

import math
import statistics
from collections.abc import Callable, Iterable, Sequence
from typing import Any

import numpy as np

from indexer_experiments.challenge.messy.answer import NAMED, NO_ANSWER
from indexer_experiments.challenge.messy.disturbances import HALVES
from indexer_experiments.tables import share, share_of_groups, table

Row = dict[str, Any]

BINS = 10
"""Bins of equal width in which probabilities are compared with shares, as usual for this error."""

_DRAWS = 2000
"""Draws that show what error chance makes."""

VISIBLE = 1.0
"""What disturbances must leave together, over the noise, for an answer to be asked where it lies."""

MAIN = 0.5
"""A disturbance that leaves this share of the largest one's, or more, may be the one pointed at."""

SHORT = 2.0
"""Table turns up to which all of a case's records show station and time as one thing."""

LARGER = 0.1
"""Gap over the noise by which machine.yaml must be worse to count as worse, beyond the solver's own error."""

_TURN = 2.0 * math.pi


def named(row: Row) -> list[Row]:
    """Findings that name something."""
    return [finding for finding in row["answer"]["findings"] if finding["grade"] in NAMED]


def hidden(row: Row) -> set[str]:
    """Names of the effects hidden."""
    return {effect["name"] for effect in row["hidden"]}


def right(finding: Row, row: Row) -> bool:
    """Whether one of a finding's members is hidden."""
    return bool(hidden(row) & set(finding["members"]))


def answered(row: Row) -> bool:
    """Whether there is an answer."""
    return row["answer"]["verdict"] not in NO_ANSWER


def wrongly_named(row: Row) -> bool:
    """Whether any finding that names something is wrong."""
    return any(not right(finding, row) for finding in named(row))


def all_named(row: Row) -> bool:
    """Whether each hidden effect has a finding of its own among those that name something."""
    return _matched(sorted(hidden(row)), [set(finding["members"]) for finding in named(row)])


def _matched(wanted: Sequence[str], given: Sequence[set[str]]) -> bool:
    if not wanted:
        return True
    first, *rest = wanted
    return any(first in members and _matched(rest, [*given[:k], *given[k + 1 :]]) for k, members in enumerate(given))


def unnamed(row: Row) -> bool:
    """Whether there is an answer, and it names nothing."""
    return answered(row) and not named(row)


def pointed_at(row: Row) -> bool:
    """Whether what remains is said to lie at the joint and kind of one of the main disturbances."""
    said = row["answer"]["remains"]
    if said is None:
        return False
    largest = max(d["level"] for d in row["disturbances"])
    for disturbance in row["disturbances"]:
        kinds = set(disturbance["kinds"])
        if kinds & {"time", "station"} and max(record["turns"] for record in row["records"]) <= SHORT:
            kinds |= {"time", "station"}
        if disturbance["level"] >= MAIN * largest and said["joint"] == disturbance["joint"] and said["kind"] in kinds:
            return True
    return False


def size_intervals(row: Row) -> list[bool]:
    """Of each interval of a hidden effect's parameter in a right finding: whether it holds the truth."""
    true = {f"{e['name']}.{name}": value for e in row["hidden"] for name, value in e["parameters"].items()}
    held = []
    for finding in named(row):
        for interval in finding["intervals"]:
            if interval["name"] in true:
                held.append(_holds(interval, true[interval["name"]]))
    return held


def machine_intervals(row: Row) -> list[bool]:
    """Of each interval of the machine's own parameters, in SI, so that the common scale counts: whether it holds the
    truth."""
    given = [interval for interval in row["answer"]["machine"] if interval["name"] in row["machine"]]
    return [_holds(interval, row["machine"][interval["name"]]) for interval in given]


def _holds(interval: Row, truth: float) -> bool:
    low, high = interval["low"], interval["high"]
    if interval["name"].endswith(".phase"):
        # a whole turn, or all angles of an effect of which nothing is told, holds any
        if high - low >= _TURN:
            return True
        truth += _TURN * round((0.5 * (low + high) - truth) / _TURN)
    return low <= truth <= high


def worse(row: Row) -> bool:
    """Whether machine.yaml leaves more of the judging record than the nominal machine."""
    return row["answer"]["gap_after"] > row["answer"]["gap_before"] + LARGER


def worse_held_out(row: Row) -> bool:
    """The same of a record that was held out."""
    return any(after > before + LARGER for before, after in row["answer"]["gaps_held_out"])


def calibration_error(rows: Sequence[Row]) -> tuple[float, int]:
    """Σ_b n_b/n |share right - mean probability| over `BINS` bins of equal width, and the number n of findings, of all
    grades (Naeini, Cooper, Hauskrecht, AAAI (2015) 2901)."""
    said, came = _said(rows)
    return (float(_errors(said, came[None])[0]), len(said)) if len(said) else (math.nan, 0)


def error_by_chance(rows: Sequence[Row]) -> float:
    """The mean error of as many findings with the same probabilities, were these exactly right: few findings in a bin
    are never right in the share that their probabilities say."""
    said, _ = _said(rows)
    came = np.random.default_rng(0).random((_DRAWS, len(said))) < said
    return float(_errors(said, came).mean()) if len(said) else math.nan


def _said(rows: Sequence[Row]) -> tuple[np.ndarray, np.ndarray]:
    """Probabilities (n,) of all findings, and whether these were right (n,)."""
    pairs = [(f["probability"], right(f, row)) for row in rows for f in row["answer"]["findings"]]
    said, came = np.array(pairs, dtype=float).reshape(-1, 2).T
    return said, came


def _errors(said: np.ndarray, came: np.ndarray) -> np.ndarray:
    """Calibration errors (d,) of probabilities (n,) and what came of them (d, n)."""
    bins = np.minimum((said * BINS).astype(int), BINS - 1)
    off = [np.abs((came - said)[:, bins == b].sum(axis=1)) for b in range(BINS)]
    return np.sum(off, axis=0) / len(said)


def quantile_95(values: Iterable[float]) -> float:
    """The least value that 95 % do not exceed."""
    ordered = sorted(values)
    return ordered[math.ceil(0.95 * len(ordered)) - 1]


def messy_tables(rows: Sequence[Row]) -> str:
    """The tables of each half, and of each limit of time in it, that there are rows of."""
    texts = []
    for half in HALVES:
        mine = [row for row in rows if row["half"] == half]
        limits = sorted({row.get("limit") or math.inf for row in mine})
        for limit in limits:
            told = f", at most {limit:g} s a case" if math.isfinite(limit) else ""
            some = [row for row in mine if (row.get("limit") or math.inf) == limit]
            texts.append(f"## Messy challenge, half `{half}`{told}\n\n{messy_table(some)}")
    return "\n".join(texts)


def messy_table(rows: Sequence[Row]) -> str:
    """The lines of what must be shown, then what came out by disturbance and by effect, in Markdown."""
    none, one, two = ([row for row in rows if len(row["hidden"]) == n] for n in range(3))
    seen = [row for row in rows if row["disturbed"] >= VISIBLE]
    returned = [row for row in rows if row["answer"]["gap_after"] is not None]
    sizes, machine = [size_intervals(row) for row in rows], [machine_intervals(row) for row in rows]
    lines = [
        ("one hidden: right name or its family among the established", "≥ 90 %", *_counted(one, all_named)),
        ("a wrong name among the established, nothing hidden", "≤ 2 %", *_counted(none, wrongly_named)),
        ("a wrong name among the established, something hidden", "≤ 3 %", *_counted([*one, *two], wrongly_named)),
        ("nothing hidden: an answer without a name", "≥ 95 %", *_counted(none, unnamed)),
        ("two hidden: both established", "≥ 75 %", *_counted(two, all_named)),
        ("effects' sizes: 95 % intervals that hold the truth", "90–99 %", *share_of_groups(sizes)),
        ("the machine's parameters, common scale included: the same", "90–99 %", *share_of_groups(machine)),
        ("probabilities: expected calibration error", "≤ 5 %", *_error(rows)),
        ("machine.yaml makes the gap on a record held out larger", "never", *_counted(returned, worse_held_out)),
        ("machine.yaml makes the gap on the judging record larger", "never", *_counted(returned, worse)),
        ("what remains points at the right joint and kind", "≥ 80 %", *_counted(seen, pointed_at)),
        *_times(rows),
    ]
    outcome = table(["must show", "wanted", "got", "95 %"], lines)
    return "\n\n".join([outcome, _verdicts(rows), _by_disturbance(rows), _by_effect(rows)]) + "\n"


def _counted(rows: Sequence[Row], holds: Callable[[Row], bool]) -> tuple[str, str]:
    return share(sum(map(holds, rows)), len(rows))


def _error(rows: Sequence[Row]) -> tuple[str, str]:
    error, n = calibration_error(rows)
    if not n:
        return "no finding", "–"
    return f"{100 * error:.1f} %", f"{n} findings, {BINS} bins; {100 * error_by_chance(rows):.1f} % by chance"


def _times(rows: Sequence[Row]) -> list[tuple[str, str, str, str]]:
    taken = [row["answer"]["cpu_s"] for row in rows]
    middle, most = (f"{statistics.median(taken):.1f} s", f"{quantile_95(taken):.1f} s") if taken else ("–", "–")
    n = f"n = {len(taken)}"
    return [
        ("processor time of a case, median", "≤ 15 s", middle, n),
        ("processor time of a case, 95 %", "≤ 90 s", most, n),
    ]


def _verdicts(rows: Sequence[Row]) -> str:
    said = sorted({row["answer"]["verdict"] for row in rows})
    lines = []
    for verdict in said:
        mine = [row for row in rows if row["answer"]["verdict"] == verdict]
        lines.append([verdict, *(str(sum(len(row["hidden"]) == n for row in mine)) for n in range(3))])
    return table(["verdict", "nothing hidden", "one", "two"], lines)


def _by_disturbance(rows: Sequence[Row]) -> str:
    names = sorted({d["name"] for row in rows for d in row["disturbances"]})
    lines = []
    for name in names or ["none"]:
        mine = [row for row in rows if name in {d["name"] for d in row["disturbances"]}]
        seen = [row for row in mine if row["disturbed"] >= VISIBLE]
        found = [row for row in mine if row["hidden"]]
        lines.append([name, str(len(mine)), *(_of(*pair) for pair in (
            (found, all_named), (mine, wrongly_named), (seen, pointed_at)
        ))])  # fmt: skip
    return table(["disturbance", "cases", "all hidden named", "a wrong name", "pointed at rightly"], lines)


def _by_effect(rows: Sequence[Row]) -> str:
    lines = []
    for name in sorted({name for row in rows for name in hidden(row)}):
        mine = [row for row in rows if name in hidden(row)]
        hits = [row for row in mine if any(name in finding["members"] for finding in named(row))]
        others = sorted({m for row in mine for f in named(row) if not right(f, row) for m in f["members"]})
        lines.append([name, f"{len(hits)} of {len(mine)}", ", ".join(others) or "–"])
    return table(["hidden", "named", "wrong names beside it"], lines)


def _of(rows: Sequence[Row], holds: Callable[[Row], bool]) -> str:
    return f"{sum(map(holds, rows))} of {len(rows)}" if rows else "–"
