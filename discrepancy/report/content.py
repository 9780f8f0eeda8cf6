"""report.json: the outcome in numbers."""

from __future__ import annotations

import dataclasses
import math
from typing import Any

from datagen.versions import versions_of
from discrepancy.chain import Outcome
from discrepancy.findings import Estimate, FoundEffect
from discrepancy.gap import Gap, Share
from discrepancy.locate import Cell, Spot, Where
from discrepancy.report.words import headline

_DISTRIBUTION = "indexer-diagnosis"


def content(outcome: Outcome) -> dict[str, Any]:
    """What report.json holds; docs/discrepancy.md tells each key."""
    answer = outcome.answer
    accepted = answer.found if outcome.effects else ()
    whole = {
        "verdict": answer.verdict,
        "headline": headline(outcome),
        "reason": answer.reason,
        "effects": [_effect(effect) for effect in accepted],
        "ranking": [
            {"name": r.name, "probability": r.probability, "heldout_gap": r.heldout_gap, "score": r.score}
            for r in answer.ranking
        ],
        "ranking_beside": list(answer.names[:-1]),
        "ambiguous": list(answer.rounds[-1].names) if answer.verdict == "ambiguous" else [],
        "gap": _gap(outcome.gap),
        "where": [_one(one) for one in outcome.where.significant],
        "where_after": [_one(one) for one in outcome.where_after.significant],
        "where_in_words": list(outcome.where.sentences),
        "test": _test(outcome.where),
        "calibration": {
            "converged": answer.believed.converged,
            "parameters": [_estimate(e) for e in answer.calibration.estimates],
            "bounds_hit": list(answer.calibration.bounds_hit),
            "undetermined": list(answer.calibration.undetermined),
        },
        "next": [dataclasses.asdict(one) for one in outcome.next],
        "notes": list(outcome.subject.notes),
        "records": {"fitted": _names(outcome, held=False), "held_out": _names(outcome, held=True)},
        "seed": outcome.seed,
        "version": versions_of([_DISTRIBUTION])[_DISTRIBUTION],
    }
    return _finite(whole)


def _names(outcome: Outcome, held: bool) -> list[str]:
    subject = outcome.subject
    return list(subject.view(subject.held_out if held else subject.model).names)


def _effect(effect: FoundEffect) -> dict[str, Any]:
    return {
        "name": effect.name,
        "parameters": [_estimate(e) for e in effect.parameters],
        "choices": dict(effect.choices),
        "possible": effect.possible,
        "why": effect.why,
    }


def _estimate(e: Estimate) -> dict[str, Any]:
    return {
        "name": e.name, "value": e.value, "unit": e.unit, "interval": [e.low, e.high], "nominal": e.nominal,
        "moved": e.moved,
    }  # fmt: skip


def _gap(gap: Gap) -> dict[str, Any]:
    parts = {name: getattr(gap, name) for name in ("noise_floor", "before", "after", "closed_share")}
    values = {name: None if share is None else share.value for name, share in parts.items()}
    return {"metric": gap.metric, **values, "intervals": {name: _interval(share) for name, share in parts.items()}}


def _interval(share: Share | None) -> list[float] | None:
    return None if share is None else [share.low, share.high]


def _one(one: Cell | Spot) -> dict[str, Any]:
    if isinstance(one, Cell):
        return {"axis": one.axis, "cell": one.label, "level": one.level, "expected": one.expected, "p": one.p}
    return {
        "axis": one.kind, "cell": one.name, "frequency": list(one.frequency), "prominence": one.prominence, "p": one.p,
    }  # fmt: skip


def _test(where: Where) -> dict[str, Any]:
    return {
        "false_alarms": where.alarms, "draws": where.draws, "cells": len(where.cells) + where.map.levels.size,
        "lines": len(where.spots), "level": where.level, "between_repeats": where.repeats,
    }  # fmt: skip


def _finite(value: Any) -> Any:
    """JSON has no NaN and no infinity: null stands for both."""
    if isinstance(value, dict):
        return {key: _finite(below) for key, below in value.items()}
    if isinstance(value, list | tuple):
        return [_finite(below) for below in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
