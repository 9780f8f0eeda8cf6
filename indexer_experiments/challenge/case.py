"""One case: records are made and written, the search reads them and answers, the answer is scored."""

from __future__ import annotations

import dataclasses
import math
import tempfile
import time
from pathlib import Path
from typing import Any

from discrepancy.estimates import Estimate
from discrepancy.explain import Explanation, explain
from discrepancy.grades import NAMED
from discrepancy.indexer import IndexerModel
from discrepancy.indexer.parameters import read
from discrepancy.subjects.indexer import IndexerSubject
from indexer_env.effects import Effect
from indexer_env.errors import ParameterError, SignalError
from indexer_env.sensors import Sensor
from indexer_experiments.challenge.draw import HIDDEN, KNOWN_TO, Draw, Order, draw
from indexer_experiments.challenge.records import read_case, write_records

OUTCOMES = ("right", "ambiguous", "refused", "missed", "partly", "wrong")
"""right: what is hidden, and nothing else, is established, "nothing missing" where nothing is, no name where the
library lacks it; ambiguous: it is in a family; refused: no name though the library has one, or a remainder where
nothing is hidden; missed: "nothing missing" though something is; partly: one of two, and no other; wrong: a name of
what is not there."""


def solve_case(order: Order, number: int) -> dict[str, Any]:
    """The scored answer of one case, as it stands in its file."""
    drawn = draw(order, number)
    row = {
        "case": number, "kind": order.kind, "play": order.play, "seed": order.seed, "turns": order.turns,
        "hidden": [_told(effect) for effect in drawn.hidden],
    }  # fmt: skip
    with tempfile.TemporaryDirectory(prefix="challenge-") as folder:
        begin = time.process_time()
        write_records(drawn, order.turns, Path(folder))
        made, wall = time.process_time(), time.perf_counter()
        try:
            given = read_case(Path(folder), drawn.nominal)
        except (SignalError, ParameterError) as error:
            answered = _turned_away(order, str(error))
        else:
            told = {"uncertainty": KNOWN_TO, "without": drawn.removed}
            model, held_out = (IndexerModel(drawn.nominal, part, **told) for part in (given.fitted, given.held_out))
            subject = IndexerSubject(drawn.nominal, Sensor(), given, KNOWN_TO)
            answer = explain(model, held_out, None, subject.forms(), subject.elsewhere)
            answered = _answered(drawn, answer, given.notes)
        spent = {"cpu_s": time.process_time() - made, "wall_s": time.perf_counter() - wall}
    return {**row, **answered, "truth_s": made - begin, **spent}


def _answered(drawn: Draw, answer: Explanation, notes: tuple[str, ...]) -> dict[str, Any]:
    named = _named(answer)
    return {
        "verdict": "named" if named else answer.verdict, "names": list(answer.names),
        "alike": sorted(set().union(*named)) if named else [],
        "reason": " ".join(finding.why for finding in answer.findings), "notes": list(notes),
        "outcome": outcome(drawn, answer), "gap": answer.base.place.level(answer.model),
        "left": answer.best.place.level(answer.model), "before": answer.before, "after": answer.after,
        "closed_share": None if math.isnan(answer.closed_share) else answer.closed_share,
        "intervals": intervals(drawn, answer), "found": [dataclasses.asdict(f) for f in answer.findings],
    }  # fmt: skip


def _named(answer: Explanation) -> list[set[str]]:
    """The names that each finding with a name gives."""
    return [{effect.name for effect in f.effects} for f in answer.findings if f.grade in NAMED]


def _turned_away(order: Order, why: str) -> dict[str, Any]:
    """The answer where the records were refused before any fit; the gap is the least one asked for."""
    unseen = dict.fromkeys(("left", "before", "after", "closed_share"))
    empty = {name: [] for name in ("names", "alike", "notes", "intervals", "found")}
    return {"verdict": "turned away", "reason": why, "outcome": "refused", "gap": order.gap[0], **unseen, **empty}


def _told(effect: Effect) -> dict[str, Any]:
    return {"name": effect.name, **{name: getattr(effect, name) for name in HIDDEN[effect.name]}}


def outcome(drawn: Draw, answer: Explanation) -> str:
    """One of OUTCOMES."""
    hidden = set() if drawn.removed else {effect.name for effect in drawn.hidden}
    named = _named(answer)
    if not named:
        nothing = answer.verdict == "nothing missing"
        if drawn.removed:
            return "missed" if nothing else "right"
        return ("missed" if nothing else "refused") if hidden else ("right" if nothing else "refused")
    if any(not members & hidden for members in named) or len(named) > len(hidden):
        return "wrong"
    if len(named) < len(hidden):
        return "partly"
    return "right" if all(len(members) == 1 for members in named) else "ambiguous"


def intervals(drawn: Draw, answer: Explanation) -> list[list[Any]]:
    """[name, truth, value, low, high] of every parameter of effects rightly named and of the machine, where the answer
    is right."""
    if outcome(drawn, answer) != "right" or drawn.removed:
        return []
    true = {effect.name: effect for effect in drawn.hidden}
    rows = []
    for found in (finding.effects[0] for finding in answer.findings if finding.grade in NAMED):
        for estimate in found.parameters:
            if hasattr(true[found.name], estimate.name):
                value = float(getattr(true[found.name], estimate.name))
                rows.append(_row(f"{found.name}.{estimate.name}", _same_turn(value, estimate), estimate))
    for estimate in answer.calibration.estimates:
        if not any(estimate.name.startswith(f"{name}.") for name in true):
            rows.append(_row(estimate.name, read(drawn.truth, estimate.name), estimate))
    return rows


def _row(name: str, truth: float, estimate: Estimate) -> list[Any]:
    return [name, truth, estimate.value, estimate.low, estimate.high]


def _same_turn(truth: float, estimate: Estimate) -> float:
    """A phase's truth in the turn of its estimate; any other truth as it is."""
    if estimate.name != "phase":
        return truth
    turn = 2.0 * math.pi
    return truth + turn * round((estimate.value - truth) / turn)
