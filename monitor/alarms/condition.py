"""The state machine of one alarm.

Words of OPC UA Part 9: an alarm is active or not, acknowledged or not, shelved or not, and retained while it is any of
active and unacknowledged. On-delay and off-delay are counted in turns, since only a turn is evidence: a level must be
reached in each of `on_delay` turns in a row to become active, and left in each of `off_delay` to end. Turns of each
operating mode are counted apart, since a fault that shows at one speed may hide at another, and the alarm has the worst
of their levels: one that was raised at a speed ends by turns of this speed. A higher level or
a time of `re_alarm` makes an acknowledged alarm unacknowledged again. A shelved alarm goes through the same states and
history, but tells nobody.
"""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import asdict, dataclass
from typing import Any

from indexer_env.checks import check_integer, check_number
from indexer_env.errors import refuse
from monitor.alarms.limits import LEVELS, Limits
from monitor.analysis.finding import Size
from monitor.intake.blocks import NANO, is_text

HOUR_NS = 3600 * NANO
LONGEST_NOTE = 500
LONGEST_SHELF_H = 24.0 * 90


@dataclass(frozen=True)
class Rules:
    """Delays of all alarms.

    Attributes
    ----------
    on_delay, off_delay : int
        Turns in a row that raise and that end a level, >= 1.
    re_alarm_h : float
        Hours after which an acknowledged alarm that is still active asks again, > 0.
    """

    on_delay: int = 5
    off_delay: int = 20
    re_alarm_h: float = 72.0

    def __post_init__(self) -> None:
        for name in ("on_delay", "off_delay"):
            check_integer("alarms", name, getattr(self, name), low=1, unit="turns")
        check_number("alarms", "re_alarm", self.re_alarm_h, low=0.0, low_open=True, unit="h")


@dataclass(frozen=True)
class Event:
    """Something that happened to an alarm; `told`: whether it goes out to people; `turn`: number of the turn that led
    to it, None where an operator did it.

    kind: raised, lowered, ended, again, acknowledged, repaired, shelved, unshelved, noted.
    """

    time_ns: int
    quantity: str
    kind: str
    level: str
    value: float | None
    low: float | None
    high: float | None
    told: bool
    user: str = ""
    note: str = ""
    turn: int | None = None


class _Stand:
    """How the turns of one mode stand: the level that they hold, and for how many in a row each was reached or left."""

    def __init__(self, body: Mapping[str, Any]) -> None:
        self.level = int(body.get("level", 0))
        self._rising = [int(count) for count in body.get("rising", [0, 0, 0, 0])]
        self._leaving = [int(count) for count in body.get("leaving", [0, 0, 0, 0])]

    def count(self, size: Size, limits: Limits, rules: Rules) -> None:
        """Take in a turn."""
        target = limits.level(size.value, self.level)
        # Of a size whose interval reaches down to nothing it is not sure that there is any.
        if size.low <= 0.0 and target > self.level:
            target = self.level
        for level in (1, 2, 3):
            self._rising[level] = self._rising[level] + 1 if target >= level > self.level else 0
            self._leaving[level] = self._leaving[level] + 1 if target < level <= self.level else 0
        reached = max((level for level in (1, 2, 3) if self._rising[level] >= rules.on_delay), default=0)
        left = [level for level in (1, 2, 3) if self._leaving[level] >= rules.off_delay]
        if reached > self.level:
            self.level, self._rising = reached, [0, 0, 0, 0]
        elif left:
            self.level = min(left) - 1

    def to_dict(self) -> dict[str, Any]:
        return {"level": self.level, "rising": self._rising, "leaving": self._leaving}


class Condition:
    """The alarm of one quantity of one machine.

    Parameters
    ----------
    quantity : str
    rules : Rules
    body : mapping, optional
        What `to_dict` gave.
    modes : collection of str, optional
        Names of the operating modes; what others have left goes on with the one that is judged next.
    """

    def __init__(
        self,
        quantity: str,
        rules: Rules,
        body: Mapping[str, Any] | None = None,
        modes: Collection[str] | None = None,
    ) -> None:
        body = body or {}
        self.quantity, self._rules = quantity, rules
        # Earlier versions counted the turns of all modes together.
        stands = {mode: _Stand(stand) for mode, stand in body.get("modes", {"": body}).items()}
        known = stands if modes is None else modes
        self._stands = {mode: stand for mode, stand in stands.items() if mode in known and mode}
        self._left = max(
            (stand for mode, stand in stands.items() if mode not in self._stands),
            key=lambda stand: stand.level,
            default=_Stand({}),
        )
        self.acknowledged = bool(body.get("acknowledged", True))
        self.since_ns: int | None = body.get("since_ns")
        self.shelved_until_ns: int | None = body.get("shelved_until_ns")
        self._asked_ns = int(body.get("asked_ns", 0))

    @property
    def level(self) -> int:
        """The worst of the levels of all modes, 0 (normal) to 3 (danger)."""
        return max(stand.level for stand in (self._left, *self._stands.values()))

    @property
    def active(self) -> bool:
        """Whether a level above normal holds."""
        return self.level > 0

    @property
    def retained(self) -> bool:
        """Whether an operator should still see it."""
        return self.active or not self.acknowledged

    @property
    def shelved(self) -> bool:
        """Whether it tells nobody for now."""
        return self.shelved_until_ns is not None

    @property
    def mode(self) -> str | None:
        """The mode that holds the level; None: there is no level above normal, or its mode is no more."""
        held = [mode for mode, stand in self._stands.items() if stand.level == self.level]
        return held[-1] if self.active and held else None

    def at(self, time_ns: int, size: Size | None = None) -> list[Event]:
        """What time alone brings about, with the size where a turn has told it; returns what happened."""
        events = []
        if self.shelved_until_ns is not None and time_ns >= self.shelved_until_ns:
            self.shelved_until_ns = None
            events.append(self._event(time_ns, "unshelved", size))
        if self.active and self.acknowledged and time_ns - self._asked_ns >= self._rules.re_alarm_h * HOUR_NS:
            self.acknowledged, self._asked_ns = False, time_ns
            events.append(self._event(time_ns, "again", size))
        return events

    def set_clock(self, shift_ns: int) -> None:
        """The sender's clock was set by so much [ns]: all times are those of the new one."""
        self.since_ns = None if self.since_ns is None else self.since_ns + shift_ns
        self.shelved_until_ns = None if self.shelved_until_ns is None else self.shelved_until_ns + shift_ns
        self._asked_ns += shift_ns

    def judge(self, time_ns: int, size: Size, limits: Limits, mode: str) -> list[Event]:
        """Take in the smoothed size of a turn of a mode; returns what happened."""
        events, before = self.at(time_ns, size), self.level
        stand = self._stands.get(mode)
        if stand is None or self._left.level > stand.level:
            stand, self._left = self._left, _Stand({})
        self._stands[mode] = stand
        stand.count(size, limits, self._rules)
        if self.level > before:
            self.since_ns = self.since_ns if before else time_ns
            self.acknowledged, self._asked_ns = False, time_ns
            events.append(self._event(time_ns, "raised", size))
        elif self.level < before:
            events.append(self._event(time_ns, "lowered" if self.active else "ended", size))
            self.since_ns = self.since_ns if self.active else None
        return events

    def acknowledge(self, time_ns: int, user: str, note: str = "") -> Event:
        """An operator has seen it. Raises ParameterError where there is nothing to acknowledge, or for a long note."""
        if self.acknowledged:
            raise refuse("alarm", "acknowledge", "asked for an alarm that is not acknowledged yet", self.quantity)
        note = _note(note)
        self.acknowledged, self._asked_ns = True, max(time_ns, self._asked_ns)
        return self._event(time_ns, "acknowledged", None, user, note)

    def shelve(self, time_ns: int, hours: float, user: str, note: str = "") -> Event:
        """Tell nobody for so many hours. Raises ParameterError."""
        check_number("alarm", "hours", hours, low=0.0, low_open=True, high=LONGEST_SHELF_H, unit="h")
        note = _note(note)
        self.shelved_until_ns = time_ns + round(hours * HOUR_NS)
        return self._event(time_ns, "shelved", None, user, note or f"for {hours:g} h")

    def unshelve(self, time_ns: int, user: str) -> Event:
        """Tell again. Raises ParameterError where it was not shelved."""
        if not self.shelved:
            raise refuse("alarm", "unshelve", "asked for an alarm that is shelved", self.quantity)
        self.shelved_until_ns = None
        return self._event(time_ns, "unshelved", None, user)

    def note(self, time_ns: int, user: str, note: str) -> Event:
        """A remark in the history. Raises ParameterError for an empty one."""
        if not _note(note):
            raise refuse("alarm", "note", "a text", note)
        return self._event(time_ns, "noted", None, user, note)

    def repaired(self, time_ns: int, user: str, note: str = "") -> Event:
        """An operator has repaired or changed the part, and so has seen the alarm; its level ends by turns. Raises
        ParameterError for a long note."""
        note = _note(note)
        self.acknowledged, self._asked_ns = True, max(time_ns, self._asked_ns)
        return self._event(time_ns, "repaired", None, user, note)

    def end(self, time_ns: int, note: str) -> Event:
        """It ends without a turn that would show it, for the reason in the note."""
        self._left, self._stands, self.since_ns = _Stand({}), {}, None
        return self._event(time_ns, "ended", None, note=note)

    def _event(self, time_ns: int, kind: str, size: Size | None, user: str = "", note: str = "") -> Event:
        value, low, high = (None, None, None) if size is None else size
        return Event(time_ns, self.quantity, kind, LEVELS[self.level], value, low, high, not self.shelved, user, note)

    def to_dict(self) -> dict[str, Any]:
        """Plain values, from which the constructor makes the same alarm."""
        return {
            "level": self.level,
            "acknowledged": self.acknowledged,
            "since_ns": self.since_ns,
            "shelved_until_ns": self.shelved_until_ns,
            "modes": {mode: stand.to_dict() for mode, stand in {"": self._left, **self._stands}.items()},
            "asked_ns": self._asked_ns,
        }


def plain(event: Event) -> dict[str, Any]:
    """An event as plain values."""
    return asdict(event)


def _note(note: object) -> str:
    if not is_text(note) or len(note) > LONGEST_NOTE:
        rule = f"a text of at most {LONGEST_NOTE} signs that UTF-8 has"
        raise refuse("alarm", "note", rule, str(note)[:40])
    return note.strip()
