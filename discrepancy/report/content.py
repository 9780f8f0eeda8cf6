"""report.json: the outcome in numbers."""

from __future__ import annotations

import dataclasses
from typing import Any

import numpy as np

from datagen.versions import versions_of
from discrepancy.chain import Outcome
from discrepancy.criteria import Criteria
from discrepancy.estimates import Estimate, FoundEffect
from discrepancy.finding import Finding
from discrepancy.gap import Gap, Share
from discrepancy.grades import NAMED, RULES
from discrepancy.locate import Cell, Spot, Where
from discrepancy.origin import Origin
from discrepancy.report.ranking import rankings
from discrepancy.report.words import comes_from, headline, where_in_short
from discrepancy.subjects.base import Subject
from discrepancy.table import Table
from indexer_cli.json_values import finite

_DISTRIBUTION = "indexer-diagnosis"


def content(outcome: Outcome) -> dict[str, Any]:
    """What report.json holds; docs/how-to/explain.md tells each key."""
    answer, subject = outcome.answer, outcome.subject
    accepted = [f.effects[0] for f in answer.findings if f.grade in NAMED]
    whole = {
        "verdict": answer.verdict,
        "headline": headline(outcome),
        "findings": [_finding(finding, subject) for finding in answer.findings],
        "effects": [_effect(effect, subject) for effect in accepted],
        "remains": _remains(outcome),
        "table": None if outcome.table is None else _table(outcome.table),
        "ranking": [dataclasses.asdict(ranking) for ranking in rankings(answer)],
        "gap": None if outcome.gap is None else _gap(outcome.gap),
        "where": _significant(outcome.where),
        "where_after": _significant(outcome.left),
        "where_in_words": [] if outcome.where is None else list(outcome.where.sentences),
        "test": None if outcome.where is None else _test(outcome.where),
        "calibration": {
            "parameters": [_estimate(e, subject, e.name) for e in answer.calibration.estimates],
            "bounds_hit": list(answer.calibration.bounds_hit),
            "undetermined": list(answer.calibration.undetermined),
            "held_back": answer.written.held_back,
            "remarks": list(answer.written.remarks),
        },
        "question": None if outcome.question is None else outcome.question.about,
        "next": [dataclasses.asdict(one) for one in outcome.next],
        "search": {
            "complete": answer.selection.complete,
            "converged": answer.best.converged,
            "dispersion": answer.selection.dispersion,
            "selected": list(answer.best.place.hypothesis.names),
            "tried_last": [one.name for one in answer.selection.tried],
        },
        "criteria": _criteria(answer.criteria),
        "failures": list(outcome.failures),
        "of_records": list(outcome.of_records),
        "notes": list(subject.notes),
        "records": {
            "fitted": list(subject.view(subject.model).names),
            "held_out": list(subject.view(subject.held_out).names),
        },
        "seed": outcome.seed,
        "version": versions_of([_DISTRIBUTION])[_DISTRIBUTION],
    }
    return finite(whole)


def _criteria(criteria: Criteria) -> dict[str, Any]:
    return {
        "numbers": dataclasses.asdict(criteria),
        "rules": [{"rule": rule.name, "grade": rule.grade} for rule in RULES],
    }


def _finding(finding: Finding, subject: Subject) -> dict[str, Any]:
    return {
        "grade": finding.grade,
        "name": finding.name,
        "effects": [_effect(effect, subject) for effect in finding.effects],
        "probability": finding.probability,
        "closes": finding.closes,
        "why": finding.why,
        "rivals": [dataclasses.asdict(rival) for rival in finding.rivals],
    }


def _remains(outcome: Outcome) -> dict[str, Any]:
    answer = outcome.answer
    return {
        "times_noise": answer.after,
        "with_hints": answer.remains.level,
        "unrepeated": answer.remains.noise,
        "looks_like": answer.remains.looks_like,
        "most": where_in_short(outcome.left).removeprefix(", "),
        "where_in_words": [] if outcome.left is None else list(outcome.left.sentences),
        "origin": None if outcome.origin is None else _origin(outcome.origin),
    }


def _origin(origin: Origin) -> dict[str, Any]:
    return {
        "in_words": comes_from(origin),
        **dataclasses.asdict(origin.first),
        "share": origin.share,
        "others": [dataclasses.asdict(place) for place in origin.others],
        "beside": [place.name for place in origin.beside],
    }


def _table(table: Table) -> dict[str, Any]:
    rows = [
        {"place": place[0] if len(place) == 1 else list(place), "value": e.value, "interval": [e.low, e.high]}
        for place, e in zip(table.form.places, table.values, strict=True)
    ]
    return {
        "name": table.form.hypothesis.name, "what": "a table, not a law", "over": table.form.over,
        "unit": table.values[0].unit, "rows": rows, "before": table.before, "after": table.after,
        "closes": table.closes, "places": [axis.places.tolist() for axis in table.form.axes],
    }  # fmt: skip


def _effect(effect: FoundEffect, subject: Subject) -> dict[str, Any]:
    return {
        "name": effect.name,
        "parameters": [_estimate(e, subject, f"{effect.name}.{e.name}") for e in effect.parameters],
        "choices": dict(effect.choices),
        "bound": effect.bound,
    }


def _estimate(e: Estimate, subject: Subject, name: str) -> dict[str, Any]:
    return {
        "name": e.name, "value": e.value, "unit": e.unit, "interval": [e.low, e.high], "nominal": e.none,
        "moved": e.moved, "shop": subject.shop(name, (e.value, e.low, e.high)),
    }  # fmt: skip


def _gap(gap: Gap) -> dict[str, Any]:
    parts = {name: getattr(gap, name) for name in ("noise_floor", "before", "after", "closed_share")}
    values = {name: None if share is None else share.value for name, share in parts.items()}
    return {"metric": gap.metric, **values, "intervals": {name: _interval(share) for name, share in parts.items()}}


def _interval(share: Share | None) -> list[float] | None:
    return None if share is None else [share.low, share.high]


def _significant(where: Where | None) -> list[dict[str, Any]]:
    return [] if where is None else [_one(one) for one in where.significant]


def _one(one: Cell | Spot) -> dict[str, Any]:
    if isinstance(one, Cell):
        return {"axis": one.axis, "cell": one.label, "level": one.level, "expected": one.expected, "p": one.p}
    return {
        "axis": one.kind, "cell": one.name, "frequency": list(one.frequency), "prominence": one.prominence, "p": one.p,
    }  # fmt: skip


def _test(where: Where) -> dict[str, Any]:
    looked_at = len(where.cells) + int((~np.isnan(where.map.levels)).sum())
    return {
        "false_alarms": where.alarms, "draws": where.draws, "cells": looked_at,
        "lines": len(where.spots), "level": where.level, "between_repeats": where.repeats,
    }  # fmt: skip
