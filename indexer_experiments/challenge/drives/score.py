"""What was said of a case, and what of it is right: one finding per hidden effect, what is left over is wrong."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import linear_sum_assignment

ALSO: Mapping[str, tuple[str, ...]] = {
    "play.contact": ("play",), "loop_lag": ("delay",), "delay": ("loop_lag",), "offset": ("friction.asymmetric",),
    "friction.asymmetric": ("offset",),
}  # fmt: skip
"""Other names that are right for the same physics."""

WITH: Mapping[str, tuple[str, ...]] = {
    "play.contact": ("friction.coulomb",), "bending": ("friction.coulomb",), "stick_growth": ("friction.coulomb",),
}  # fmt: skip
"""What comes with an effect or a disturbance and is in the library: the load behind the play rubs, half of what bends
is friction that is the same everywhere, and what grows at rest is dry friction. Its name is right, but asked of
nobody."""

LIKE: Mapping[str, tuple[str, ...]] = {
    "cable": ("spring.bilinear",), "hysteresis": ("friction.presliding",), "thickening": ("friction.quadratic",),
    "sag": ("spring.linear", "spring.cubic", "load.imbalance", "ripple"),
}  # fmt: skip
"""Laws of the library that describe a disturbance to 95 % of its mean square or more, as near as `Criteria.law` asks a
law to be: the cube from the middle on is a hinge to 2 %, Bouc and Wen's hysteresis Dahl's to 1 %, the root a spring
that softens to 1.3 %, a linear one to 4.4 %, an imbalance to 1.7 to 4.3 % over the strokes that are drawn, a ripple of
order 2 to 1.2 % over 2 rad; a drag with the speed's power 1.5 is a quadratic one to 1.5 %."""


_HIDDEN, _WITH, _DESCRIBES = 10000, 100, 1
"""Worth of a finding by what it is right about: no number of the lesser kind outweighs one of the greater."""


@dataclass(frozen=True)
class Judged:
    """A case with what was said of it.

    Attributes
    ----------
    number : int
    hidden, unknown : tuple of str
    named : tuple of tuple of str
        Members of each finding that gives a name, more than one where it is a family.
    hints : tuple of str
        Names of what only stands in.
    before, after, remains : float
        Levels on records held out.
    seconds : float
        Processor time.
    """

    number: int
    hidden: tuple[str, ...]
    unknown: tuple[str, ...]
    named: tuple[tuple[str, ...], ...]
    hints: tuple[str, ...]
    before: float
    after: float
    remains: float
    seconds: float

    @property
    def right(self) -> tuple[str, ...]:
        """Effects hidden that a finding of their own names, alone or in a family."""
        meant = [k for k, _ in self._belongs.values()]
        return tuple(name for k, name in enumerate(self.hidden) if k in meant)

    @property
    def wrong(self) -> tuple[tuple[str, ...], ...]:
        """Findings left over: neither of an effect hidden, nor of what comes with one, nor of a law that describes a
        disturbance to 95 %."""
        return tuple(members for k, members in enumerate(self.named) if k not in self._belongs)

    @property
    def unlisted(self) -> tuple[tuple[str, ...], ...]:
        """The same without the laws that describe a disturbance."""
        listed = [k for k, (_, worth) in self._belongs.items() if worth > _DESCRIBES]
        return tuple(members for k, members in enumerate(self.named) if k not in listed)

    @property
    def families(self) -> int:
        """Effects rightly named that share their finding with other names."""
        return sum(worth == _HIDDEN and len(self.named[k]) > 1 for k, (_, worth) in self._belongs.items())

    @property
    def _belongs(self) -> dict[int, tuple[int, int]]:
        """Finding → the one thing it is right about and the worth of that, so that the most are right."""
        things = [({h, *ALSO.get(h, ())}, _HIDDEN) for h in self.hidden]
        things += [(set(WITH[one]), _WITH) for one in (*self.hidden, *self.unknown) if one in WITH]
        things += [(set(LIKE[one]), _DESCRIBES) for one in self.unknown if one in LIKE]
        worth = np.array([[w * bool(names & set(members)) for names, w in things] for members in self.named])
        rows, columns = linear_sum_assignment(worth.reshape(len(self.named), len(things)), maximize=True)
        return {int(k): (int(c), int(worth[k, c])) for k, c in zip(rows, columns, strict=True) if worth[k, c]}


def table(results: Sequence[Judged]) -> str:
    """Rates in words."""
    some, none = [r for r in results if r.hidden], [r for r in results if not r.hidden]
    one, two = ([r for r in some if len(r.hidden) == count] for count in (1, 2))
    named = sum(len(r.right) for r in some)
    rows = [
        f"cases {len(results)}: {len(none)} with nothing hidden, {len(one)} with one effect, {len(two)} with two",
        f"hidden effects named: {_share(named, sum(len(r.hidden) for r in some))}; "
        f"in a family with other names: {sum(r.families for r in some)}",
        f"one hidden, named: {_share(sum(len(r.right) for r in one), len(one))}",
        f"two hidden, both named: {_share(sum(len(r.right) == 2 for r in two), len(two))}",
        *(
            f"a false name, {what} hidden: {_share(sum(bool(r.wrong) for r in those), len(those))}; with the names of "
            f"laws that describe a disturbance to 95 %: {sum(bool(r.unlisted) for r in those)}"
            for what, those in (("something", some), ("nothing", none))
        ),
    ]
    if results:
        seconds = np.array([r.seconds for r in results])
        rows.append(f"processor time: median {np.median(seconds):.1f} s, 95 % {np.quantile(seconds, 0.95):.1f} s")
    return "\n".join(rows)


def _share(count: int, of: int) -> str:
    return f"{count} of {of} ({100.0 * count / of:.0f} %)" if of else "none"
