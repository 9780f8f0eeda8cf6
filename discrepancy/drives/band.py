"""The band in which motion and force of a drive's records are compared: one for all of them."""

from __future__ import annotations

from collections.abc import Sequence

from discrepancy.drives import smoothing
from discrepancy.drives.channels import Record

_HELD = 0.999
"""Share of the force's variance that the comparison must keep."""

_MOVING = 0.99
"""Share of the speed's variance that it must keep whatever the noise of the acceleration is."""

_HARMONICS = 5.0
"""Cut-off over the band of that share: what friction and contacts do stands at multiples of a motion's frequency."""

_DRIVEN = 0.05
"""Least variation of a record's speed, over that of the record where it varies most, for the band of its motion and
force to count."""

_LEAST_COMPARED = 240
"""Samples of each record that are compared, at least, where its rate allows: twelve windows of twenty."""

WIDER = 2.0
"""Cut-off of the motion's kernel over that of the comparison: what a kink of the equations loses to the motion's
kernel lies within the comparison's."""

PER_CUTOFF = 5.0
"""Samples kept per period of the comparison's cut-off, where it is down by 3 dB; at half that rate by 19 dB."""


def cutoff_of(records: Sequence[Record]) -> float:
    """Of the comparison [Hz]: what holds the force of every record, within what each one's sampling rate and the noise
    of its motion allow."""
    by_role = [("q", 1) if "q" in r.rows else ("v", 0) for r in records]
    varies = [
        smoothing.strength(r.rows[role], r.rate, order) for r, (role, order) in zip(records, by_role, strict=True)
    ]
    # at a standstill or a constant speed nothing but noise would tell a band of the motion
    driven = [
        (r, role, order) for r, (role, order), own in zip(records, by_role, varies, strict=True)
        if own >= _DRIVEN * max(varies)
    ]  # fmt: skip
    moving = [smoothing.holding(r.rows[role], r.rate, _MOVING, order) for r, role, order in driven]
    wanted = [_LEAST_COMPARED / PER_CUTOFF * r.rate / len(r.rows["force"]) for r in records]
    wanted += [smoothing.holding(r.rows["force"], r.rate, _HELD) for r, *_ in driven]
    top = min(WIDER * max(*wanted, _HARMONICS * max(moving)), smoothing.WIDEST * min(r.rate for r in records))
    quiet = [
        smoothing.quiet(r.rows[role], r.rate, top, order + 1) for r, role, order in driven if "a" not in r.rows
    ]  # fmt: skip
    # below the second of these the comparison would lose the motion of a record
    allowed = max(min(quiet), WIDER * max(moving)) if quiet else top
    return min(top, allowed) / WIDER
