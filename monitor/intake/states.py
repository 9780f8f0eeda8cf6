"""What is wrong with a sensor, its clock or its connection. A state is told beside the diagnoses and never is one."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import Any

WORDS = {
    "stale": "no samples arrive",
    "gap": "samples were lost",
    "late": "samples came too late to be used",
    "double": "samples came twice and were used once",
    "reordered": "samples came in another order and were sorted",
    "clock_step": "the sender's clock was set",
    "rate_error": "the sampling rate is not what the sender states",
    "broken_payload": "messages or files cannot be read",
    "dead": "the sensor gives one value or nothing",
    "clipped": "the sensor is at its limits",
    "swapped": "the sensor was exchanged, turned round or its gain changed",
    "other_speed": "the table turns at a speed that no model was taught",
    "no_indexing": "the record does not show the table's indexing: the table rests, or the sensor is off",
    "no_pulse": "no pulse marks the turns",
    "not_comparable": "rate, unit or channel do not suit the model",
    "overload": "samples come faster than they are worked off",
}
"""The states by name, each as the page tells it."""

UNTIL_GOOD_TURN = ("dead", "clipped", "other_speed", "no_indexing", "no_pulse", "not_comparable")
"""States that hold until a turn is diagnosed again."""

_MOMENT_NS = 3600 * 1_000_000_000
"""For how long the page shows an event that has no end of its own, as a lost block: an hour."""

_ITEMS = 100
"""Items of which a state knows that they may come right; with more of them it ends by its age alone."""


@dataclass
class State:
    """One state of a machine: since when, last seen, how often, and a sentence; `active` until it is over. `open` has
    the items that it is of and may come right, as files, with a sentence for each; "" stands for what never will."""

    since_ns: int
    last_ns: int
    count: int
    text: str
    active: bool
    open: dict[str, str] = field(default_factory=dict)


def joined_items(items: Mapping[str, str], more: Mapping[str, str]) -> dict[str, str]:
    """Items of a state and further ones, the newest last."""
    both = {item: said for item, said in items.items() if item not in more} | dict(more)
    return both if len(both) <= _ITEMS else {"": list(both.values())[-1]}


class States:
    """All states of one machine."""

    def __init__(self, body: dict[str, Any] | None = None) -> None:
        self._states: dict[str, State] = {}
        self.replace(body or {})

    def note(
        self, name: str, now_ns: int, text: str = "", count: int = 1, items: Mapping[str, str] | None = None
    ) -> None:
        """Something happened or goes on, with these `items`."""
        state = self._states.get(name)
        if state is None:
            self._states[name] = State(now_ns, now_ns, count, text or WORDS[name], True, dict(items or {}))
            return
        if not state.active:
            state.since_ns = now_ns
        state.last_ns, state.count, state.active = now_ns, state.count + count, True
        state.text, state.open = text or WORDS[name], joined_items(state.open, items or {})

    def right(self, name: str, item: str) -> None:
        """An item of a state has come right; the state is over once all have."""
        state = self._states.get(name)
        if state is None or state.open.pop(item, None) is None:
            return
        if state.open:
            state.text = list(state.open.values())[-1]
        else:
            state.active = False

    def over(self, *names: str) -> None:
        """These are no longer so; they stay in the count."""
        for name in names:
            if name in self._states:
                self._states[name].active, self._states[name].open = False, {}

    def set_clock(self, shift_ns: int) -> None:
        """The sender's clock was set by so much [ns]: all times are those of the new one."""
        for state in self._states.values():
            state.since_ns, state.last_ns = state.since_ns + shift_ns, state.last_ns + shift_ns

    def age(self, now_ns: int) -> None:
        """End events that are an hour old, reckoned by the samples' own time."""
        for name, state in self._states.items():
            if name not in (*UNTIL_GOOD_TURN, "stale", "rate_error") and now_ns - state.last_ns > _MOMENT_NS:
                state.active, state.open = False, {}

    def replace(self, body: dict[str, Any]) -> None:
        """Be as `to_dict` told."""
        self._states = {name: State(**values) for name, values in body.items() if name in WORDS}

    @property
    def active(self) -> list[str]:
        """Names of those that hold."""
        return [name for name, state in self._states.items() if state.active]

    def count(self, name: str) -> int:
        """How often a state was noted since the machine is known."""
        return self._states[name].count if name in self._states else 0

    def to_dict(self) -> dict[str, Any]:
        """Plain values, from which the constructor makes the same states."""
        return {name: asdict(state) for name, state in self._states.items()}
