"""The machines that are this process', and the blocks of those that are another's."""

from __future__ import annotations

import math
import time
from collections.abc import Collection, Iterable
from typing import Any

from sqlalchemy import Connection

from monitor.analysis.finding import Diagnoser
from monitor.intake.arrivals import Arrival, Standby
from monitor.leases import Leases
from monitor.pipeline import Pipeline
from monitor.plan import Plan
from monitor.store import Store

_STANDBY = 3.0
"""Leases' lengths for which blocks of another process' machines are kept: until its lease has ended and one more."""


class Fleet:
    """Pipelines by machine; without leases all machines are this process'.

    Parameters
    ----------
    store : Store
    diagnoser : Diagnoser
    plan : Plan
    leases : Leases or None
    """

    def __init__(self, store: Store, diagnoser: Diagnoser, plan: Plan, leases: Leases | None) -> None:
        self._store, self._diagnoser, self._plan, self._leases = store, diagnoser, plan, leases
        self.pipelines: dict[str, Pipeline] = {}
        self.heard: dict[str, float] = {}
        self._standby = Standby(0.0 if leases is None else _STANDBY * leases.seconds)
        self._taken: dict[str, tuple[float, int]] = {}
        self._elsewhere: dict[str, dict[str, Any]] = {}

    def load(self) -> None:
        """Make the pipelines of all machines that are this process' from the start."""
        for summary in [] if self._leases is not None else self._store.machines():
            self.pipeline(str(summary["machine"]))

    def pipeline(self, machine: str) -> Pipeline:
        """The pipeline of a machine, made from what is stored where it is not there yet."""
        found = self.pipelines.get(machine)
        if found is None:
            body, blocks = self._store.machine(machine)
            found = Pipeline(machine, self._diagnoser, self._plan, body)
            found.restored = found.restore(blocks)
            self.pipelines[machine] = found
            self.heard.setdefault(machine, time.monotonic())
            self._taken[machine] = (time.monotonic(), found.newest_ns or 0)
        return found

    def held(self, connection: Connection, machines: Collection[str]) -> set[str]:
        """Those of some machines that are this process' until the transaction ends."""
        if self._leases is None:
            return set(machines)
        mine: set[str] = set()
        share = self._leases.share(len(self.heard.keys() | machines))
        for machine in sorted(machines):
            if machine in self.pipelines and self._leases.keep(connection, machine):
                mine.add(machine)
                continue
            # Another process may have had it meanwhile: what is stored counts.
            self.pipelines.pop(machine, None)
            if len(self.pipelines.keys() | mine) < share and self._leases.take(connection, machine):
                mine.add(machine)
        return mine

    def waiting(self) -> set[str]:
        """Machines of this process of which blocks wait that came when another process had them."""
        return self.pipelines.keys() & self._standby.machines

    def due(self, mine: Collection[str], batch: Iterable[Arrival]) -> list[Arrival]:
        """What of a batch is to be worked off: before the blocks of a machine that is new here those that came when
        another process had it, without what this has stored."""
        before = [arrival for machine in sorted(mine) for arrival in self._standby.blocks(machine)]
        own = [*before, *(arrival for arrival in batch if arrival.block.machine in mine)]
        return own if self._leases is None else [arrival for arrival in own if self._is_new(arrival)]

    def _is_new(self, arrival: Arrival) -> bool:
        self.pipeline(arrival.block.machine)
        taken, newest = self._taken[arrival.block.machine]
        return time.monotonic() - taken > self._standby.seconds or arrival.block.end_ns > newest

    def settle(self, mine: Collection[str], batch: Iterable[Arrival]) -> None:
        """A batch is committed: what of it is another process' waits for the case that this dies."""
        now = time.monotonic()
        for machine in mine:
            self._standby.drop(machine)
        for arrival in batch:
            self.heard[arrival.block.machine] = now
            if arrival.block.machine not in mine:
                self._standby.keep(arrival)

    @property
    def renewal_s(self) -> float:
        """Time after which to renew [s]."""
        return math.inf if self._leases is None else self._leases.seconds / 3.0

    def renew(self) -> list[dict[str, Any]]:
        """Renew all leases, give back what is more than a share, and take what nobody has; returns the summaries that
        other processes have changed since."""
        assert self._leases is not None
        self._leases.renew(self.pipelines)
        summaries = {str(one["machine"]): one for one in self._store.machines()}
        share = self._leases.share(len(summaries.keys() | self.heard.keys()))
        excess = sorted(self.pipelines)[share:]
        if excess:
            self._leases.release(excess)
            for machine in excess:
                del self.pipelines[machine]
        for machine in sorted(summaries.keys() - self.pipelines.keys() - set(excess)):
            if len(self.pipelines) < share:
                with self._store.transaction() as connection:
                    taken = self._leases.take(connection, machine)
                if taken:
                    self.pipeline(machine)
        before, self._elsewhere = (
            self._elsewhere,
            {name: one for name, one in summaries.items() if name not in self.pipelines},
        )
        return [one for name, one in self._elsewhere.items() if before.get(name) != one]

    def take_over(self, machine: str) -> None:
        """Who acts on a machine takes it from the process that has it, which then writes no more of it."""
        if self._leases is None or self._store.summary(machine) is None:
            return
        with self._store.transaction() as connection:
            kept = machine in self.pipelines and self._leases.keep(connection, machine)
            if not kept:
                self._leases.take(connection, machine, force=True)
        if not kept:
            self.pipelines.pop(machine, None)
        self.pipeline(machine)
