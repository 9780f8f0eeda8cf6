"""Blocks as they arrive -> blocks in their order.

A block follows when it begins where the last one ended, within the jitter of the sender's clock, or has the next
number; a counter that begins anew is no hole where the time goes on. One that is ahead waits for those between, for at
most HOLD blocks or until `flush`; then the hole is a gap. One that is behind came twice or too late and is left out;
three in a row that follow each other are a clock that was set back, and are used; not so where their numbers say that
their time is right. A step of the clock between two consecutive numbers is told and loses nothing.
"""

from __future__ import annotations

from collections import deque
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

from indexer_records.measured import RATE_TOLERANCE
from monitor.intake.blocks import EARLIEST_NS, NANO, Block
from monitor.intake.states import States

HOLD = 4
"""Blocks that wait for a missing one: a broker's redelivery overtakes by one or two."""

SET_BACK = 3
"""Blocks behind in a row that follow each other until the clock is believed: two may be a resent pair."""

_RETURNS = 0.01
"""Share by which a clock may come back farther than it was set back: for so long the sender may have been off."""

_REMEMBERED = 256


@dataclass(frozen=True, eq=False)
class Placed:
    """A block in its place.

    restart   it does not continue the one before it
    shift_ns  by how much its time is off the one before it [ns]
    set_ns    by how much the sender's clock was set just before it, so that no time went by [ns]
    """

    block: Block
    restart: bool
    shift_ns: int = 0
    set_ns: int = 0


class Order:
    """Sorts the blocks of one machine and notes in `states` what was wrong.

    Parameters
    ----------
    states : States
    jitter : float
        By how much the time of a block may be off [s].
    used_until_ns : int or None
        End of the samples that were used before, after a restart; what lies before came twice.
    """

    def __init__(self, states: States, jitter: float, used_until_ns: int | None = None) -> None:
        self._states, self._jitter = states, round(jitter * NANO)
        self._used_until = used_until_ns
        self._last: Block | None = None
        self._held: list[Block] = []
        self._behind: list[Block] = []
        self._seen: deque[tuple[int, int | None]] = deque(maxlen=_REMEMBERED)
        self._anchor_ns, self._samples, self._set_back = 0, 0, 0

    @property
    def seen(self) -> list[tuple[int, int | None]]:
        """Starts and numbers of the last blocks that were used or wait: of these what comes again came twice."""
        return list(self._seen)

    @seen.setter
    def seen(self, seen: Iterable[tuple[int, int | None]]) -> None:
        self._seen = deque(seen, _REMEMBERED)

    @property
    def waiting(self) -> bool:
        """Whether blocks wait for a missing one."""
        return bool(self._held)

    def offer(self, block: Block) -> list[Placed] | None:
        """The blocks that are now in their place, this one among them or not; None: it is not needed, as it came twice
        or too late."""
        if (block.start_ns, block.sequence) in self._seen:
            self._states.note("double", block.start_ns)
            return None
        if block.begins:
            return self._again(block)
        last = self._last
        if last is None:
            return self._first(block)
        off = block.start_ns - last.end_ns
        ahead = _step(last, block)
        if ahead is not None:
            # Of a counter that begins anew at its end the time says that nothing is missing.
            if ahead == 1 or (ahead <= 0 and abs(off) <= self._jitter):
                return self._follow(block)
            # A sender that was started anew counts from 0 again, at a later time.
            if ahead <= 0 and off > 0:
                placed, last = self.flush(), self._last or last
                continues = abs(block.start_ns - last.end_ns) <= self._jitter
                return [*placed, *(self._follow(block) if continues else self._gap(block))]
        else:
            ahead = 1 if abs(off) <= self._jitter else (2 if off > 0 else 0)
            if ahead == 1:
                return self._follow(block)
        return self._ahead(block) if ahead > 1 else self._back(block)

    def replay(self, blocks: Sequence[Block]) -> list[Placed]:
        """As `offer` one by one, of blocks that were used before, all with their times by the clock of the last one."""
        placed: list[Placed] = []
        for place, block in enumerate(blocks):
            some = self.offer(block)
            if some is None and all(self._follows(block, following) for following in blocks[place + 1 : place + 2]):
                # It was used, so that the clock that was set back had been believed.
                some = [*self.flush(), *self._take(block, restart=True)]
            placed += some or ()
        told: list[Placed] = []
        set_ns = 0
        for one in reversed(placed):
            start_ns = one.block.start_ns + set_ns
            if start_ns < EARLIEST_NS:
                # by a clock that began at 1970 when it was set
                break
            told.append(Placed(replace(one.block, start_ns=start_ns), one.restart))
            set_ns += one.shift_ns
        return told[::-1]

    @property
    def ends(self) -> list[int]:
        """Ends of the blocks that wait [ns since 1970]."""
        return [block.end_ns for block in self._held]

    def flush(self) -> list[Placed]:
        """Wait no longer: the blocks that were held, the hole before them a gap."""
        held, self._held = sorted(self._held, key=_key), []
        placed: list[Placed] = []
        for block in held:
            last = self._last
            continues = last is not None and self._follows(last, block)
            placed += self._take(block, restart=False) if continues else self._gap(block)
        return placed

    def _follows(self, last: Block, block: Block) -> bool:
        """Whether a block is the one after the last, by number where both have one."""
        step = _step(last, block)
        return abs(block.start_ns - last.end_ns) <= self._jitter if step is None else step == 1

    def _first(self, block: Block) -> list[Placed] | None:
        if self._used_until is not None:
            if block.end_ns <= self._used_until + self._jitter:
                self._states.note("double", block.start_ns)
                return None
            if block.start_ns > self._used_until + self._jitter:
                return self._gap(block, since_ns=self._used_until)
        return self._take(block, restart=True)

    def _again(self, block: Block) -> list[Placed] | None:
        """The first block of another recording; what was held before it is complete."""
        if self._last is None and self._used_until is not None and block.end_ns <= self._used_until + self._jitter:
            self._states.note("double", block.start_ns)
            return None
        return [*self.flush(), *self._take(block, restart=True)]

    def _ahead(self, block: Block) -> list[Placed]:
        self._held.append(block)
        self._seen.append((block.start_ns, block.sequence))
        return self.flush() if len(self._held) >= HOLD else []

    def _back(self, block: Block) -> list[Placed] | None:
        chain = self._behind
        if chain and abs(block.start_ns - chain[-1].end_ns) <= self._jitter and _step(chain[-1], block) in (1, None):
            chain.append(block)
        else:
            self._behind = chain = [block]
        if len(chain) < SET_BACK or self._late(block):
            self._states.note("late", block.start_ns)
            return None
        placed = [*self.flush(), *self._take(block, restart=True)]
        # Those before it were told as late by the clock that is believed now.
        self._states.note("late", block.start_ns, count=0)
        return placed

    def _late(self, block: Block) -> bool:
        """Whether a block behind has just the time that belongs to its number: no clock was set back then."""
        step = None if self._last is None else _step(self._last, block)
        if self._last is None or step is None:
            return False
        due = step * (block.end_ns - block.start_ns)
        return abs(block.start_ns - self._last.start_ns - due) <= self._jitter + RATE_TOLERANCE * abs(due)

    def _gap(self, block: Block, since_ns: int | None = None) -> list[Placed]:
        since = self._last.end_ns if self._last is not None else since_ns
        lost = 0.0 if since is None else (block.start_ns - since) / NANO
        self._states.note("gap", block.start_ns, f"{max(0.0, lost):.3g} s of samples were lost")
        return self._take(block, restart=True)

    def _follow(self, block: Block) -> list[Placed]:
        placed = self._take(block, restart=False)
        # Those that waited for it, and those that came a second time meanwhile.
        while self._held:
            held = sorted(self._held, key=_key)
            last, following = self._last, held[0]
            assert last is not None
            if not self._follows(last, following):
                break
            self._held = held[1:]
            self._states.note("reordered", following.start_ns)
            placed += self._take(following, restart=False)
        return placed

    def _take(self, block: Block, restart: bool) -> list[Placed]:
        restart = restart or self._last is None
        if self._last is not None and not restart and block.rate != self._last.rate:
            restart = True
        shift, set_ns = self._shift(block, restart)
        if restart or shift:
            self._anchor(block)
        self._seen.append((block.start_ns, block.sequence))
        self._last, self._behind = block, []
        self._check_rate(block)
        self._samples += block.values.size
        return [Placed(block, restart, shift, set_ns)]

    def _shift(self, block: Block, restart: bool) -> tuple[int, int]:
        """By how much the time of a block that is used now is off the last one, and how much of that is a clock that
        was set [ns]. Forward it may be a sender that paused, so that hours went by, or samples that were lost, but
        where the clock had been set back by nearly as much: a logger that begins at 1970 gets its time."""
        off = 0 if self._last is None else block.start_ns - self._last.end_ns
        returned = 0 < self._set_back <= off + self._jitter and off <= (1.0 + _RETURNS) * self._set_back + self._jitter
        if abs(off) <= self._jitter or (restart and off > 0 and not returned):
            return 0, 0
        set_ns = off if off < 0 else self._set_back if returned else 0
        self._set_back = 0 if returned else self._set_back + max(0, -off)
        if set_ns:
            self._states.set_clock(set_ns)
        self._states.note("clock_step", block.start_ns, f"the sender's clock was set by {off / NANO:+.3g} s")
        return off, set_ns

    def _anchor(self, block: Block) -> None:
        self._anchor_ns, self._samples = block.start_ns, 0

    def _check_rate(self, block: Block) -> None:
        """Whether the samples come as fast as stated, once so much was seen that jitter cannot tell otherwise."""
        if not self._samples:
            return
        elapsed, stated = (block.start_ns - self._anchor_ns) / NANO, self._samples / block.rate
        allowed = RATE_TOLERANCE + 2.0 * self._jitter / NANO / stated
        if allowed > 2.0 * RATE_TOLERANCE:
            return
        if abs(elapsed / stated - 1.0) > allowed:
            true = self._samples / elapsed
            text = f"{true:.6g} samples come in a second where the sender states {block.rate:g}"
            self._states.note("rate_error", block.start_ns, text)
        else:
            self._states.over("rate_error")


def _step(one: Block, other: Block) -> int | None:
    """By how much the number of the other is greater; None: not both have one."""
    return None if one.sequence is None or other.sequence is None else other.sequence - one.sequence


def _key(block: Block) -> tuple[int, int]:
    return (block.start_ns, 0) if block.sequence is None else (block.sequence, block.start_ns)
