"""One case: records are made and written, the search reads them and answers, the answer is scored."""

from __future__ import annotations

import dataclasses
import math
import tempfile
import time
from pathlib import Path
from typing import Any

from discrepancy.challenge.draw import HIDDEN, KNOWN_TO, Draw, Order, draw
from discrepancy.challenge.records import read_case, write_records
from discrepancy.explain import Explanation, explain
from discrepancy.findings import Estimate
from discrepancy.indexer import IndexerModel
from discrepancy.indexer.parameters import read
from indexer_env.effects import Effect
from indexer_env.errors import ParameterError, SignalError

OUTCOMES = ("right", "ambiguous", "refused", "missed", "partly", "wrong")
"""right: what is hidden, and nothing else, is named, `none` where nothing is, `unexplained` where the library lacks it;
ambiguous: it is among those that could not be told apart; refused: no name though the library has one, or no fit;
missed: "none" though something is hidden; partly: one of two, and no other; wrong: a name of what is not there."""


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
            answered = _answered(drawn, explain(model, held_out), given.notes)
        spent = {"cpu_s": time.process_time() - made, "wall_s": time.perf_counter() - wall}
    return {**row, **answered, "truth_s": made - begin, **spent}


def _answered(drawn: Draw, answer: Explanation, notes: tuple[str, ...]) -> dict[str, Any]:
    return {
        "verdict": answer.verdict, "names": list(answer.names), "alike": list(answer.rounds[-1].names),
        "reason": answer.reason, "notes": list(notes), "outcome": outcome(drawn, answer),
        "gap": answer.base.level, "left": answer.best.level,
        "before": answer.before, "after": answer.after, "black_box": answer.first.black_box,
        "closed_share": None if math.isnan(answer.closed_share) else answer.closed_share,
        "ranking": [[r.name, r.probability, r.heldout_gap, r.score] for r in answer.ranking],
        "intervals": intervals(drawn, answer), "found": [dataclasses.asdict(f) for f in answer.found],
        "rounds": [[_row_of(c) for c in naming.candidates] for naming in answer.rounds],
    }  # fmt: skip


def _turned_away(order: Order, why: str) -> dict[str, Any]:
    """The answer where the records were refused before any fit; the gap is the least one asked for."""
    unseen = dict.fromkeys(("left", "before", "after", "black_box", "closed_share"))
    empty = {name: [] for name in ("names", "alike", "notes", "ranking", "intervals", "found", "rounds")}
    return {"verdict": "turned away", "reason": why, "outcome": "refused", "gap": order.gap[0], **unseen, **empty}


def _row_of(c: Candidate) -> list[Any]:
    return [c.name, c.score, c.level, c.held_out, c.typical, c.converged]


def _told(effect: Effect) -> dict[str, Any]:
    return {"name": effect.name, **{name: getattr(effect, name) for name in HIDDEN[effect.name]}}


def outcome(drawn: Draw, answer: Explanation) -> str:
    """One of OUTCOMES."""
    hidden, found = {effect.name for effect in drawn.hidden}, set(answer.names)
    named = answer.verdict in ("named", "ambiguous")
    if not hidden:
        return "right" if answer.verdict == "none" else "wrong" if named else "refused"
    if drawn.removed:
        return {"unexplained": "right", "not_converged": "refused", "none": "missed"}.get(answer.verdict, "wrong")
    if not named:
        return "missed" if answer.verdict == "none" else "refused"
    if answer.verdict == "ambiguous":
        earlier, alike = set(answer.names[:-1]), set(answer.rounds[-1].names)
        left = hidden - earlier
        return "ambiguous" if earlier <= hidden and len(left) == 1 and left <= alike else "wrong"
    if found == hidden:
        return "right"
    return "partly" if found < hidden else "wrong"


def intervals(drawn: Draw, answer: Explanation) -> list[list[Any]]:
    """[name, truth, value, low, high] of every parameter of effects rightly named and of the machine, where the answer
    is right."""
    if outcome(drawn, answer) != "right" or answer.verdict == "unexplained":
        return []
    true = {effect.name: effect for effect in drawn.hidden}
    rows = []
    for found in answer.found:
        for estimate in found.parameters:
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
