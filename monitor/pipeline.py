"""One machine: blocks in, turns with what they mean out. Knows no store and no network; time is that of the samples."""

from __future__ import annotations

import logging
from collections.abc import Sequence
from datetime import UTC, datetime
from typing import Any

from indexer_cli.words import joined
from indexer_env.errors import SignalError
from indexer_env.signal import Signal
from indexer_records.conditions import RecordConditions
from monitor.alarms import Condition
from monitor.alarms.limits import LEVELS
from monitor.analysis.finding import Diagnoser, Finding
from monitor.intake.blocks import NANO, Block
from monitor.intake.cutter import Cutter, CutTurn, OtherSpeed
from monitor.intake.order import Order, Placed
from monitor.intake.states import UNTIL_GOOD_TURN, States
from monitor.plan import Outcome, Plan
from monitor.watch import Watch, without_modes

_log = logging.getLogger(__name__)

_TIME = "%Y-%m-%d %H:%M:%S UTC"


class Pipeline:
    """All that is known of one machine.

    Parameters
    ----------
    machine : str
    diagnoser : Diagnoser
    plan : Plan
    body : mapping, optional
        What `to_dict` gave; samples that were not used yet must be fed again.

    Attributes
    ----------
    heard_ns : int or None
        When the newest samples came, by the host's clock [ns since 1970]; set from outside. None: it is unknown.
    """

    def __init__(self, machine: str, diagnoser: Diagnoser, plan: Plan, body: dict[str, Any] | None = None) -> None:
        body = body or {}
        self.machine, self._diagnoser, self._plan = machine, diagnoser, plan
        self.states = States(body.get("states"))
        self.turns = int(body.get("turns", 0))
        self.until_ns: int | None = body.get("until_ns")
        self.heard_ns: int | None = body.get("heard_ns")
        self.sensor: str | None = body.get("sensor")
        others = {mode for mode, own in body.get("origins", {}).items() if diagnoser.origins.get(mode, own) != own}
        if others:
            said = "%s: another model or twin diagnoses at %s than before; trends begin anew there"
            _log.warning(said, machine, joined(sorted(others)))
        self.watch = Watch(plan, [mode.name for mode in diagnoser.modes], self.states, without_modes(body, others))
        self._order = Order(self.states, plan.jitter, self.until_ns)
        self._order.seen = [(start, number) for start, number in body.get("seen", ())]
        self._cutter = Cutter(diagnoser.modes, plan.pulse_range, plan.pulse)
        self._resume_ns: int | None = None
        self._newest_ns: int | None = None
        self._begun_ns: int | None = None
        self.restored = Outcome()

    # ------------------------------------------------------------------------------------------------ samples

    def take(self, block: Block) -> Outcome | None:
        """Take in a block as it arrives; None: it came twice or too late, and is not needed."""
        placed = self._order.offer(block)
        if placed is None:
            return None
        return self._work(placed, self._of_restart())

    def restore(self, blocks: Sequence[Block]) -> Outcome:
        """Take in again the samples that were in the store, after a restart; as nothing is new, the states stay. What
        was used before came twice where it comes again."""
        states, seen = self.states.to_dict(), self._order.seen
        self._order = Order(self.states, self._plan.jitter, None if blocks else self.until_ns)
        placed = self._order.replay(blocks)
        self._newest_ns = max((place.block.end_ns for place in placed), default=None)
        if self.until_ns is not None and self.newest_ns is not None:
            # Earlier versions left the end of a turn by a clock that was set back.
            self.until_ns = min(self.until_ns, self.newest_ns)
        self._resume_ns = self.until_ns
        outcome = self._work(placed, Outcome())
        self._resume_ns = None
        self._order.seen = dict.fromkeys([*seen, *self._order.seen])
        self.states.replace(states)
        return outcome

    def flush(self) -> Outcome:
        """Wait no longer for blocks that are missing."""
        return self._work(self._order.flush(), self._of_restart())

    def finish(self) -> Outcome:
        """No samples will follow: the turns that waited for them are told."""
        outcome = self.flush()
        self._tell(self._cutter.finish(), outcome)
        return outcome

    @property
    def newest_ns(self) -> int | None:
        """End of the newest samples [ns since 1970], also of those that were restored or wait."""
        known = [] if self._newest_ns is None else [self._newest_ns]
        return max([*known, *self._order.ends], default=None)

    def time_at(self, host_ns: int) -> int:
        """The samples' time when the host's clock tells this: in a replay, or of a logger that is ahead, it is another.
        It goes on while no samples come."""
        newest = self.newest_ns or self.until_ns or host_ns
        return newest if self.heard_ns is None else newest + max(0, host_ns - self.heard_ns)

    @property
    def conditions(self) -> dict[str, Condition]:
        """The alarm of each quantity."""
        return self.watch.conditions

    @property
    def waiting(self) -> bool:
        """Whether blocks wait for a missing one."""
        return self._order.waiting

    def note_silence(self, now_ns: int) -> None:
        """No samples come any more."""
        newest = self.newest_ns or self.until_ns
        since = "" if newest is None else f" since {datetime.fromtimestamp(newest // NANO, UTC):{_TIME}}"
        self.states.note("stale", now_ns, f"no samples have come{since}")

    def _of_restart(self) -> Outcome:
        """What was found as the stored samples were taken in again, and is not written yet."""
        found, self.restored = self.restored, Outcome()
        return found

    def _work(self, placed: list[Placed], outcome: Outcome) -> Outcome:
        for place in placed:
            if self._begin(place, outcome):
                self._feed(place.block, place.restart, outcome)
        return outcome

    def _begin(self, place: Placed, outcome: Outcome) -> bool:
        """What a new stretch of samples or a clock that was set means for the turns; False: the block is used up."""
        block = place.block
        if place.restart:
            self._tell(self._cutter.finish(), outcome)
        if self._resume_ns is not None and block.pulse is None:
            # Without a pulse the next turn begins where the last one ended.
            left = block.behind(self._resume_ns)
            if left is None:
                return False
            self._resume_ns = None
            if left is not block:
                self._feed(left, True, outcome)
                return False
        if place.shift_ns:
            self._cutter.set_clock(place.shift_ns)
            self.until_ns = None if self.until_ns is None else self.until_ns + place.shift_ns
            self._begun_ns = None if self._begun_ns is None else self._begun_ns + place.shift_ns
        if place.set_ns:
            self.watch.set_clock(place.set_ns)
        return True

    def _feed(self, block: Block, restart: bool, outcome: Outcome) -> None:
        self._newest_ns = block.end_ns
        if restart or self._begun_ns is None:
            self._begun_ns = block.start_ns
        if block.sensor is not None:
            if self.sensor is not None and block.sensor != self.sensor:
                self.states.note("swapped", block.start_ns, f"the sensor is {block.sensor}, it was {self.sensor}")
                self.watch.forget_usual()
            self.sensor = block.sensor
        self.states.over("stale")
        self.states.age(block.end_ns)
        try:
            cuts = self._cutter.feed(block, restart)
        except SignalError as error:
            state = "other_speed" if isinstance(error, OtherSpeed) else "not_comparable"
            self.states.note(state, block.start_ns, str(error))
            # What follows does not go on with what came before it.
            self._tell(self._cutter.finish(), outcome)
            self.until_ns = block.end_ns
            return
        self._tell(cuts, outcome)
        self._check_pulse(block)

    def _check_pulse(self, block: Block) -> None:
        """Samples of three turns without one: the pulse has died, or never comes."""
        longest = max(mode.duration for mode in self._diagnoser.modes)
        if block.pulse is not None and self._begun_ns is not None:
            waited = (block.end_ns - max(self._begun_ns, self.until_ns or 0)) / NANO
            if waited > 3.0 * longest:
                self.states.note("no_pulse", block.end_ns, f"no pulse has come for {waited:.3g} s")

    # ------------------------------------------------------------------------------------------------ turns

    def _tell(self, cuts: list[CutTurn], outcome: Outcome) -> None:
        for cut in cuts:
            # After a restart the samples around the last turn are fed again.
            if self.until_ns is not None and cut.start_ns < self.until_ns - round(0.25 * cut.turn.duration * NANO):
                continue
            self.until_ns = cut.end_ns
            self.turns += 1
            flaw = self._diagnoser.flaw(cut.mode, cut.turn)
            if flaw is None:
                try:
                    finding = self._diagnosed(cut)
                except SignalError as error:
                    flaw = "not_comparable", str(error)
                except Exception as error:
                    # one turn that nobody foresaw must not end the watch over all other machines
                    _log.exception("%s: turn %d could not be diagnosed", self.machine, self.turns)
                    flaw = "not_comparable", f"a turn that could not be diagnosed ({type(error).__name__}: {error})"
                else:
                    self.states.over(*UNTIL_GOOD_TURN)
                    self.watch.take(self.turns, cut, finding, outcome)
                    continue
            self.states.note(flaw[0], cut.end_ns, flaw[1])
            self.watch.leave_out(self.turns, cut, flaw, outcome)

    def _diagnosed(self, cut: CutTurn) -> Finding:
        mode, record = cut.mode, cut.turn.record
        assert record is not None
        signal = Signal(record, mode.rate, unit=mode.unit, source=self.machine)
        speed = None if mode.motor_speed is None else mode.motor_speed * mode.duration / cut.turn.duration
        known = RecordConditions(motor_speed=speed, sensor_radius=self._plan.sensor_radius)
        return self._diagnoser.diagnose_turn(signal, known, self._plan.pulse_angle if cut.by_pulse else None)

    # ------------------------------------------------------------------------------------------------ what is known

    def summary(self) -> dict[str, Any]:
        """What the first view tells of the machine."""
        worst = max(self.conditions.values(), key=lambda one: (one.level, not one.acknowledged))
        alarms = {
            name: {**one.to_dict(), "level_name": LEVELS[one.level], "shelved": one.shelved}
            for name, one in self.conditions.items()
            if one.retained or one.shelved
        }
        return {
            "machine": self.machine,
            "turns": self.turns,
            "sensor": self.sensor,
            "level": LEVELS[worst.level],
            "worst": worst.quantity if worst.active else None,
            "alarms": alarms,
            "states": {name: values for name, values in self.states.to_dict().items()},
            "active_states": self.states.active,
            "last": self.watch.shown(),
        }

    def first_needed_ns(self) -> int | None:
        """Samples that end before this time are not needed any more [ns]: two turns before the end of the last one, and
        four before the newest sample where no turn is found."""
        if self._newest_ns is None:
            return None
        longest = round(max(mode.duration for mode in self._diagnoser.modes) * NANO)
        last = self._newest_ns - 4 * longest
        return last if self.until_ns is None else max(last, min(self.until_ns, self._newest_ns) - 2 * longest)

    def to_dict(self) -> dict[str, Any]:
        """Plain values, from which the constructor makes the same pipeline."""
        return {
            "states": self.states.to_dict(),
            "turns": self.turns,
            "until_ns": self.until_ns,
            "heard_ns": self.heard_ns,
            "sensor": self.sensor,
            "origins": dict(self._diagnoser.origins),
            **self.watch.to_dict(),
            "seen": self._order.seen,
        }
