"""Reports of diagnosed signals: in words, as JSON and as the rows of a table."""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from classifier.diagnose.diagnosis import UNGUARDED_WORDS, Diagnosis
from classifier.diagnose.incremental import TurnReport
from classifier.parts import GUARDS

STRONGEST = 3
"""Bands named in words; JSON holds all."""

COLUMN = 13
"""Width of the names in front of words."""

_INTERVAL = ("_low", "_high")


@dataclass(frozen=True)
class CaseReport:
    """What became of one signal.

    name        as in `Case`
    true_class  the name of its class, where its data set says; None: not known
    turns       of the table, in their order
    problem     the sentence for which no turn of it was diagnosed; "" where one was
    subset      as in `Case`
    """

    name: str
    true_class: str | None
    turns: tuple[TurnReport, ...]
    problem: str = ""
    subset: str | None = None

    @classmethod
    def of(
        cls, name: str, true_class: str | None, turns: Sequence[TurnReport], subset: str | None = None
    ) -> CaseReport:
        """Report of a signal whose turns were looked at."""
        problem = "" if any(turn.diagnosis for turn in turns) else f"{name}: {_refused(turns[0])}"
        return cls(name, true_class, tuple(turns), problem, subset)

    @property
    def taught(self) -> bool:
        """Whether the training had a use for it, so that its being right says little of records to come."""
        return self.subset not in (None, "validation")

    @property
    def diagnosed(self) -> list[Diagnosis]:
        """The diagnoses of its turns that have one."""
        return [turn.diagnosis for turn in self.turns if turn.diagnosis is not None]

    @property
    def verdict(self) -> str:
        """The verdict on most of its turns; of two equally frequent ones that which comes first."""
        names = Counter(diagnosis.verdict for diagnosis in self.diagnosed)
        return names.most_common(1)[0][0] if names else ""

    def to_dict(self) -> dict[str, Any]:
        """Plain values for JSON."""
        return {
            "signal": self.name,
            "verdict": self.verdict,
            "problem": self.problem,
            **({} if self.true_class is None else {"true_class": self.true_class}),
            **({} if self.subset is None else {"subset": self.subset}),
            "turns": [turn.to_dict() for turn in self.turns],
        }

    def rows(self) -> list[dict[str, Any]]:
        """One row a turn: plain numbers and texts by column name; a single one for a signal without a turn."""
        common = {"signal": self.name, "true_class": self.true_class or "", "subset": self.subset or ""}
        if not self.turns:
            return [{**common, "problem": self.problem}]
        return [{**common, **_row(turn)} for turn in self.turns]


def _row(turn: TurnReport) -> dict[str, Any]:
    row: dict[str, Any] = {name: getattr(turn, name) for name in ("turn", "start", "duration", "verdict", "problem")}
    diagnosis = turn.diagnosis
    if diagnosis is None:
        return row
    row |= {name: getattr(diagnosis, name) for name in ("class_label", "class_name", "code", "distance", "margin")}
    row |= {f"output_{node}": value for node, value in enumerate(diagnosis.outputs, start=1)}
    row |= {name: value for name, value in diagnosis.assessment.items() if not isinstance(value, list)}
    left_out = "; ".join(f"{name}: {reason}" for name, reason in diagnosis.left_out.items())
    return row | {"is_novel": diagnosis.is_novel, "guarded": diagnosis.guarded, "left_out": left_out}


def summary(reports: Sequence[CaseReport]) -> dict[str, Any]:
    """Counts over many signals: turns by verdict, what was not diagnosed, and where the true classes are known the
    share that is right [%] of the turns that the training had no use for."""
    diagnoses = [(report, diagnosis) for report in reports for diagnosis in report.diagnosed]
    counts = {
        "signals": len(reports),
        "signals_not_diagnosed": sum(bool(report.problem) for report in reports),
        "turns": sum(len(report.turns) for report in reports),
        "turns_not_diagnosed": sum(bool(turn.problem) for report in reports for turn in report.turns),
        "turns_unguarded": sum(not diagnosis.guarded for _, diagnosis in diagnoses),
        "verdicts": dict(Counter(diagnosis.verdict for _, diagnosis in diagnoses).most_common()),
    }
    known = [
        (report.taught, diagnosis.is_right(report.true_class))
        for report, diagnosis in diagnoses
        if report.true_class is not None
    ]
    right = [is_right for taught, is_right in known if not taught]
    if taught := len(known) - len(right):
        counts["turns_of_the_training"] = taught
    if right:
        counts |= {"turns_compared": len(right), "right_percent": 100.0 * sum(right) / len(right)}
    return counts


def summary_lines(counts: dict[str, Any]) -> list[str]:
    """The counts of `summary` in words."""
    text = [
        f"{what:<{COLUMN}}{counts[what]}, {counts[f'{what}_not_diagnosed']} not diagnosed"
        for what in ("signals", "turns")
    ]
    if counts["turns_unguarded"]:
        text.append(
            f"{'unguarded':<{COLUMN}}{counts['turns_unguarded']} turns, by a model that gives any record a name"
        )
    if "turns_of_the_training" in counts:
        text.append(f"{'taught':<{COLUMN}}{counts['turns_of_the_training']} turns that the training used: not compared")
    if "right_percent" in counts:
        unseen = f"{counts['turns_compared']} turns that the model did not see"
        which = unseen if "turns_of_the_training" in counts else "the turns that were diagnosed"
        text.append(f"{'right':<{COLUMN}}{counts['right_percent']:.4g} % of {which}")
    return text + [f"{number:>{COLUMN - 2}}  {name}" for name, number in counts["verdicts"].items()]


def line(report: CaseReport) -> str:
    """A signal in one line."""
    if report.problem:
        return f"{report.name}  not diagnosed: {report.problem.removeprefix(f'{report.name}: ')}"
    named = [diagnosis.verdict for diagnosis in report.diagnosed]
    share = f"  ({named.count(report.verdict)} of {len(report.turns)} turns)" if len(report.turns) > 1 else ""
    wrong = report.true_class is not None and report.verdict.removeprefix(UNGUARDED_WORDS) != report.true_class
    true = f"  (is: {report.true_class})" if wrong else ""
    return f"{report.name}  {report.verdict}{share}{true}"


def lines(report: CaseReport) -> list[str]:
    """A signal in words: every turn, with all that the model says of it."""
    text = [f"{'record':<{COLUMN}}{report.name}"]
    for turn in report.turns:
        place = f"{turn.turn}, {turn.duration:.6g} s from {turn.start:.6g} s on"
        if turn.diagnosis is None:
            text += [f"{'turn':<{COLUMN}}{place}", f"{'refused':<{COLUMN}}{_refused(turn)}"]
        else:
            text += [f"{'turn':<{COLUMN}}{place}", *_words(turn.diagnosis)]
    return text


def _words(diagnosis: Diagnosis) -> list[str]:
    outputs = "  ".join(f"{value:.4f}" for value in diagnosis.outputs)
    strongest = sorted(diagnosis.bands, key=lambda band: -abs(band.contribution))[:STRONGEST]
    spoke = ", ".join(f"{band.low_hz:g} to {band.high_hz:g} Hz {band.contribution:+.3f}" for band in strongest)
    entries = {
        "verdict": diagnosis.verdict,
        "nearest": f"{diagnosis.class_label}: {diagnosis.class_name}",
        "code": "  ".join(f"{bit:6s}" for bit in diagnosis.code).rstrip(),
        "outputs": outputs,
        "distance": f"{diagnosis.distance:.4f} from this code",
        "margin": f"{diagnosis.margin:.4f} to the next: {diagnosis.second_name}",
        **assessed(diagnosis.assessment),
        "spoke": spoke,
    }
    return [f"{name:<{COLUMN - 1}} {value}" for name, value in entries.items()]


def assessed(assessment: dict[str, Any]) -> dict[str, str]:
    """What the parts of a model say, in words by name: an interval stands in brackets behind its value; lists are left
    to JSON."""
    words = {}
    for name, value in assessment.items():
        if name in GUARDS.values() or name.endswith(_INTERVAL) or isinstance(value, list):
            continue
        low, high = (assessment.get(f"{name}{end}") for end in _INTERVAL)
        interval = "" if low is None or high is None else f" ({low:.3g} to {high:.3g})"
        words[name.replace("_", " ")] = f"{_number(value)}{interval}"
    return words


def _number(value: Any) -> str:
    return str(value) if isinstance(value, bool | str) else f"{value:.3g}"


def _refused(turn: TurnReport) -> str:
    return f"the turn that begins at {turn.start:.6g} s {turn.problem}."
