"""What the turns of one machine come to: trends, what is usual, remaining time and alarms."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import replace
from typing import Any

from monitor.alarms import Condition, Event
from monitor.analysis.baseline import Baselines
from monitor.analysis.finding import Finding, Size
from monitor.analysis.remaining import Remaining, remaining_time
from monitor.analysis.running import Running
from monitor.analysis.trend import Trend
from monitor.intake.blocks import NANO
from monitor.intake.cutter import CutTurn
from monitor.intake.states import States
from monitor.plan import CHANGE, Outcome, Plan, Turn


class Watch:
    """Follows what is wrong with one machine.

    Parameters
    ----------
    plan : Plan
    modes : collection of str
        Names of the operating modes.
    states : States
        Of the machine; a gain that jumped is noted there.
    body : mapping, optional
        What `to_dict` gave.

    Attributes
    ----------
    last : dict
        Of the newest turn that was diagnosed: when it ended, what it showed, and the sizes under "modes". Where the
        newest turn of all was not diagnosed "problem", "problem_ns" and "problem_mode" tell of that one.
    references : dict of str to int
        Number of the healthy turn of each mode with which the page compares later ones.
    """

    def __init__(self, plan: Plan, modes: Collection[str], states: States, body: dict[str, Any] | None = None) -> None:
        self._plan, self._modes, self._states = plan, tuple(modes), states
        self.replace(body or {})

    def replace(self, body: dict[str, Any]) -> None:
        """Be as `to_dict` told."""
        plan, modes = self._plan, self._modes
        self.last: dict[str, Any] = _by_mode(body.get("last", {}))
        self.trends = {
            mode: {name: Trend(plan.window, trend) for name, trend in trends.items()}
            for mode, trends in body.get("trends", {}).items()
        }
        # Earlier versions took all time for running time.
        ended_s = self.last["time_ns"] / NANO if "time_ns" in self.last else None
        self.running = Running(body.get("running", {"last_s": ended_s, "ran_s": ended_s}))
        self.baselines = Baselines(body.get("baselines"))
        self.references: dict[str, int] = dict(body.get("references", {}))
        stored = body.get("conditions", {})
        self.conditions = {name: Condition(name, plan.rules, stored.get(name), modes) for name in plan.limits}
        unwatched = [Condition(name, plan.rules, one, modes) for name, one in stored.items() if name not in plan.limits]
        self._unwatched = [one for one in unwatched if one.active]

    # ------------------------------------------------------------------------------------------------ turns

    def take(self, number: int, cut: CutTurn, finding: Finding, outcome: Outcome) -> None:
        """Follow a turn that was diagnosed."""
        ran_s = self.running.turn(cut.end_ns / NANO)
        sizes: dict[str, Size] = dict(finding.sizes)
        sizes[CHANGE] = self._change(cut, finding)
        trends = self.trends.setdefault(cut.mode.name, {})
        smooth: dict[str, Size] = {}
        remaining: dict[str, Remaining] = {}
        for name, size in sizes.items():
            if name not in self._plan.limits:
                continue
            trend = trends.setdefault(name, Trend(self._plan.window))
            smooth[name] = trend.add(cut.end_ns / NANO, size, ran_s)
            if trend.full:
                outcome.events += self._judge(name, number, cut, smooth[name])
            if name != CHANGE and smooth[name].low > 0.0:
                limit = self._plan.limits[name].end
                found = remaining_time(trend.running, limit, ran_s, trend.stride)
                if found is not None:
                    remaining[name] = found
        known = {mode: one for mode, one in self.last.get("modes", {}).items() if mode in self._modes}
        known[cut.mode.name] = {
            "time_ns": cut.end_ns,
            "ran_s": ran_s,
            "sizes": {name: list(size) for name, size in smooth.items()},
            "remaining": {name: [r.median, r.low, r.high] for name, r in remaining.items()},
        }
        self.last = {
            "time_ns": cut.end_ns,
            "mode": cut.mode.name,
            "problem": "",
            "verdict": finding.verdict,
            "healthy": finding.healthy,
            "probability": finding.probability,
            "level": finding.level,
            "novelty": finding.novelty,
            "modes": known,
        }
        outcome.turns.append(Turn(number, cut, None, finding, smooth, remaining))

    def leave_out(self, number: int, cut: CutTurn, flaw: tuple[str, str], outcome: Outcome) -> None:
        """A turn that was not diagnosed, with the state and the sentence that say why."""
        self.last = {**self.last, "problem": flaw[1], "problem_ns": cut.end_ns, "problem_mode": cut.mode.name}
        outcome.turns.append(Turn(number, cut, flaw, None, {}, {}))

    def _judge(self, name: str, number: int, cut: CutTurn, size: Size) -> list[Event]:
        condition, limits = self.conditions[name], self._plan.limits[name]
        if name == CHANGE and self._explained(max(condition.level, limits.level(size.value, condition.level))):
            return []
        happened = condition.judge(cut.end_ns, size, limits, cut.mode.name)
        return [replace(event, turn=number) for event in happened]

    def _explained(self, level: int) -> bool:
        """Whether a change of this level is no unknown one, as a fault has the same level or a higher one."""
        return max((one.level for name, one in self.conditions.items() if name != CHANGE), default=0) >= max(level, 1)

    def _change(self, cut: CutTurn, finding: Finding) -> Size:
        """How far a turn is from what was taught and from what is usual, the greater of both; 1 and more is far."""
        record = cut.turn.record
        assert record is not None
        key, stations = f"{cut.mode.name} {cut.by_pulse}", self._plan.stations if cut.by_pulse else None
        far, factor = self.baselines.far(key, record, cut.mode.rate, finding.level, stations)
        if factor is not None:
            text = f"all frequencies have changed by the factor {factor:.3g}: sensor, gain or range was changed"
            self._states.note("swapped", cut.end_ns, text)
        value = max(far, finding.novelty or 0.0)
        return Size(value, value, value)

    # ------------------------------------------------------------------------------------------------ time

    def at(self, time_ns: int) -> list[Event]:
        """What time alone brings about, also where no turn comes: shelves that run out, alarms that ask again. Alarms
        of quantities that are watched no longer end."""
        ended = [one.end(time_ns, "it is not watched any more") for one in self._unwatched]
        self._unwatched = []
        return ended + [event for one in self.conditions.values() for event in one.at(time_ns)]

    def set_clock(self, shift_ns: int) -> None:
        """The sender's clock was set by so much [ns]: all times are those of the new one."""
        for one in (*self.conditions.values(), *self._unwatched):
            one.set_clock(shift_ns)
        self.running.set_clock(shift_ns / NANO)

    # ------------------------------------------------------------------------------------------------ operators

    def repair(self, quantity: str, time_ns: int, user: str, note: str = "") -> Event:
        """An operator has repaired or changed the part: its trends begin anew at all speeds, and what is usual is
        learnt again. Raises ParameterError for a long note."""
        happened = self.conditions[quantity].repaired(time_ns, user, note)
        for trends in self.trends.values():
            trends.pop(quantity, None)
        self.forget_usual()
        modes = self.last.get("modes", {})
        left = {
            mode: {**one, "sizes": _without(one["sizes"], quantity), "remaining": _without(one["remaining"], quantity)}
            for mode, one in modes.items()
        }
        self.last = {**self.last, "modes": left}
        return happened

    def forget_usual(self) -> None:
        """The machine or its sensor was changed: what is usual, and a healthy turn to compare with, come anew."""
        self.baselines.clear()
        self.references.clear()

    # ------------------------------------------------------------------------------------------------ what is known

    def shown(self) -> dict[str, Any]:
        """`last`, and of each quantity the size and remaining time in the mode that holds its level, else in the one
        that was diagnosed last."""
        modes = self.last.get("modes", {})
        newest_first = sorted(modes, key=lambda mode: -modes[mode]["time_ns"])
        told: dict[str, Any] = {"sizes": {}, "remaining": {}, "size_mode": {}}
        for name, condition in self.conditions.items():
            for mode in (condition.mode, *newest_first):
                if mode in modes and name in modes[mode]["sizes"]:
                    told["sizes"][name], told["size_mode"][name] = modes[mode]["sizes"][name], mode
                    if name in modes[mode]["remaining"]:
                        told["remaining"][name] = self._left(modes[mode], name)
                    break
        return {**self.last, **told}

    def _left(self, told: dict[str, Any], name: str) -> list[float]:
        """The remaining time that a mode's newest turn told, less what the machine has run since in other modes."""
        since = self.running.ran_s - told.get("ran_s", self.running.ran_s)
        return [max(0.0, end - since) for end in told["remaining"][name]]

    def to_dict(self) -> dict[str, Any]:
        """Plain values, from which the constructor makes the same."""
        conditions = [*self.conditions.values(), *self._unwatched]
        return {
            "last": self.last,
            "trends": {m: {n: trend.to_dict() for n, trend in trends.items()} for m, trends in self.trends.items()},
            "running": self.running.to_dict(),
            "baselines": self.baselines.to_dict(),
            "references": dict(self.references),
            "conditions": {one.quantity: one.to_dict() for one in conditions},
        }


def without_modes(body: dict[str, Any], modes: Collection[str]) -> dict[str, Any]:
    """What `to_dict` gave, without the trends of some modes and what was usual and healthy there."""
    usual = {key: one for key, one in body.get("baselines", {}).items() if key.rpartition(" ")[0] not in modes}
    trends = {mode: one for mode, one in body.get("trends", {}).items() if mode not in modes}
    references = {mode: number for mode, number in body.get("references", {}).items() if mode not in modes}
    last = dict(body.get("last", {}))
    if "modes" in last:
        last["modes"] = {mode: one for mode, one in last["modes"].items() if mode not in modes}
    return {**body, "trends": trends, "last": last, "baselines": usual, "references": references}


def _by_mode(last: dict[str, Any]) -> dict[str, Any]:
    """`last` with its sizes by mode; earlier versions kept those of the newest turn alone."""
    if "modes" in last or "sizes" not in last:
        return last
    kept = {"time_ns": last["time_ns"], "sizes": last["sizes"], "remaining": last["remaining"]}
    rest = {name: value for name, value in last.items() if name not in ("sizes", "remaining")}
    return {**rest, "modes": {last["mode"]: kept}}


def _without(values: dict[str, Any], name: str) -> dict[str, Any]:
    return {key: value for key, value in values.items() if key != name}
