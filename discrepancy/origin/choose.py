"""Which cause explains best what a fit has left: sums of few causes, by their evidence.

Each form says: this much may be missing at that joint, varying freely with this variable. The leading ones each begin
a sum, to which the form that wins most is added while it wins `MARGIN`. A sum speaks for the joint and kind of that
form without which it would lose most, and that of the most probable sum is where the remainder comes from. A torque
that is free at each moment explains whatever there is, and takes part as a sum of its own: it wins where nothing orders
the remainder.
"""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from discrepancy.origin.residue import Residue, Seen

MARGIN = 10.0
"""ln E by which a cause must win: forms, frequencies and dampings are chosen among some hundred."""

_LEADERS, _MOST = 3, 3
"""Causes that begin a sum, and causes of a sum."""

_BLUR = 0.02
"""Share of the best evidence by which a form falls behind another one before it is e times less likely: no form is the
true law, so that evidence grows with what all of them miss."""


_ALIKE = 1.0 / 3.0
"""Share of the first place's probability above which another one is told beside it."""


@dataclass(frozen=True, eq=False)
class Form:
    """A cause with free sizes.

    Attributes
    ----------
    joint : str
        Where it may come from: "input" (drive, reducer and input shaft), "output" (indexer, output shaft and table: one
        accelerometer on the table cannot tell a torque on it from one of the joint before it), "base" (what the machine
        stands on) or "sensor" (the measuring chain).
    kind : str
        What it may vary with: "phase", "station", "speed", "time" or "frequency".
    name : str
        In words, as a sentence may hold it: "a gain of the sensor that changes slowly".
    columns : ndarray (m, k)
        What each size adds, cleaned.
    price : float
        ln of the number of forms among which it was chosen.
    """

    joint: str
    kind: str
    name: str
    columns: np.ndarray
    price: float = 0.0


@dataclass(frozen=True)
class Place:
    """A joint and a kind, and how probable it is that the remainder comes from there in this way.

    Attributes
    ----------
    joint, kind, name : str
        As of `Form`, of its best form.
    probability : float
        Among all places that were compared.
    """

    joint: str
    kind: str
    name: str
    probability: float


@dataclass(frozen=True)
class Origin:
    """Where a remainder comes from.

    Attributes
    ----------
    first : Place
    share : float
        Of what remains above the noise, what this cause explains; NaN of a torque that is free at each moment.
    others : tuple of Place
        All other places, the most probable first.
    beside : tuple of Place
        Further causes that the records show beside it, those first without which most would be lost.
    """

    first: Place
    share: float
    others: tuple[Place, ...]
    beside: tuple[Place, ...]

    @property
    def alike(self) -> tuple[Place, ...]:
        """Places that the records hardly tell from the first one."""
        return tuple(place for place in self.others if place.probability > _ALIKE * self.first.probability)


_PARTS = {"input": 6.0, "output": 11.0, "base": 1.0, "sensor": 6.0}
"""Effects of the indexer's library at each joint: what is probable before the records are seen. It decides where they
hardly tell two joints apart."""

Scan = Callable[[Residue], Sequence[Form]]
"""Forms that have to be looked for: their frequencies or moments follow from what is left."""


@dataclass(frozen=True, eq=False)
class _Sum:
    forms: tuple[Form, ...]
    scales: tuple[float, ...]
    evidence: float
    residue: Residue


def origin_of(residue: Residue, forms: Sequence[Form], scan: Scan, free: Sequence[tuple[Form, float]]) -> Origin | None:
    """Where the remainder comes from; None where no cause is more likely than none.

    Parameters
    ----------
    residue : Residue
    forms : sequence of Form
    scan : callable
    free : sequence of (Form, float)
        Torques that are free at each moment, without columns, with their ln E.
    """
    free = sorted(free, key=lambda pair: -pair[1])
    leaders, sums = _sums(residue, forms, scan)
    if max([row[0] for row in leaders.values()] + [won for _, won in free[:1]], default=0.0) < MARGIN:
        return None
    evidence = {place: row[0] for place, row in leaders.items()}
    names = {place: row[2].name for place, row in leaders.items()}
    speaks = {place: _Sum((form,), (scale,), won, residue) for place, (won, scale, form) in leaders.items()}
    for one in sums:
        # a cause is as likely as the best sum that speaks for it; it may have come to light beside the others alone
        form = one.forms[0]
        place = form.joint, form.kind
        if one.evidence > evidence.get(place, -math.inf):
            evidence[place], names[place], speaks[place] = one.evidence, form.name, one
    for form, won in free:
        place = form.joint, form.kind
        if won > evidence.get(place, -math.inf):
            evidence[place], names[place] = won, form.name
            speaks.pop(place, None)
    most = max(evidence.values())
    blur = max(_BLUR * most, 1.0)
    weights = {place: _PARTS[place[0]] * math.exp((won - most) / blur) for place, won in evidence.items()}
    total = sum(weights.values())
    places = sorted(
        (Place(*place, names[place], weight / total) for place, weight in weights.items()), key=lambda p: -p.probability
    )
    first, *others = places
    whole = max(float(residue.y @ residue.y) - residue.samples * residue.noise, 1e-9)
    beside, share = (), math.nan
    if own := speaks.get((first.joint, first.kind)):
        share = min(_energy_of_first(residue, own) / whole, 1.0)
        beside = tuple(Place(form.joint, form.kind, form.name, math.nan) for form in own.forms[1:])
    return Origin(first, share, tuple(others), beside)


def likeliest(residue: Residue, forms: Sequence[Form]) -> Form | None:
    """The form that alone is the most likely; None where none is more likely than noise by the margin."""
    won, _, form = _weighed(residue, _seen(residue, forms))[0]
    return form if won >= MARGIN else None


_Row = tuple[float, float, Form]
"""ln E less the price, λ and form."""


def _sums(residue: Residue, forms: Sequence[Form], scan: Scan) -> tuple[dict[tuple[str, str], _Row], list[_Sum]]:
    """The best form of each joint and kind, and the sums that the leading ones of these begin, each with the form first
    without which it would lose most."""
    leaders: dict[tuple[str, str], _Row] = {}
    seen = _seen(residue, forms)
    for row in _weighed(residue, seen | _seen(residue, scan(residue))):
        leaders.setdefault((row[2].joint, row[2].kind), row)
    begun = [row for row in list(leaders.values())[:_LEADERS] if row[0] > 0.0]
    return leaders, [_by_need(residue, _grown(residue, row, seen, scan)) for row in begun]


def _seen(residue: Residue, forms: Sequence[Form]) -> dict[Form, Seen]:
    return {form: residue.seen(form.columns) for form in forms}


def _weighed(residue: Residue, seen: Mapping[Form, Seen]) -> list[_Row]:
    """All forms, the best first, given what is seen of each beside the causes that are a part of the noise."""
    rows = []
    for form, mine in seen.items():
        won, scale = residue.evidence(mine)
        rows.append((won - form.price, scale, form))
    return sorted(rows, key=lambda row: -row[0])


def _grown(residue: Residue, first: _Row, seen: Mapping[Form, Seen], scan: Scan) -> _Sum:
    """The sum that begins with a form, given what is seen of those that need not be looked for."""
    won, scale, form = first
    one = _Sum((form,), (scale,), won, residue.without(form.columns, scale))
    while len(one.forms) < _MOST:
        # what was seen of a form beside one cause less is a step towards what is seen of it now
        seen = {other: one.residue.seen_further(mine) for other, mine in seen.items()}
        won, scale, form = _weighed(one.residue, seen | _seen(one.residue, scan(one.residue)))[0]
        if won < MARGIN:
            break
        other = one.residue.without(form.columns, scale)
        one = _Sum((*one.forms, form), (*one.scales, scale), one.evidence + won, other)
    return one


def _by_need(residue: Residue, one: _Sum) -> _Sum:
    """The sum with that form first without which least evidence is left."""
    laid = [math.sqrt(scale) * form.columns for form, scale in zip(one.forms, one.scales, strict=True)]
    without = [residue.evidence_together(laid[:k] + laid[k + 1 :]) for k in range(len(laid))]
    order = np.argsort(without).tolist()
    forms, scales = (tuple(part[k] for k in order) for part in (one.forms, one.scales))
    return dataclasses.replace(one, forms=forms, scales=scales)


def _energy_of_first(residue: Residue, one: _Sum) -> float:
    """Sum of squares of what the first cause of a sum explains, its sizes at their posterior mean."""
    pairs = zip(one.forms, one.scales, strict=True)
    laid = np.concatenate([math.sqrt(scale) * form.columns for form, scale in pairs], axis=1)
    sizes = np.linalg.solve(laid.T @ laid + np.eye(laid.shape[1]), laid.T @ residue.y)
    own = one.forms[0].columns.shape[1]
    return float(((laid[:, :own] @ sizes[:own]) ** 2).sum())
