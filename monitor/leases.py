"""Several processes on one store: each machine is one process' at a time, by a lease that it renews as it writes.

A lease is renewed in the very transaction that writes what came of a machine's samples, so a process that has lost a
machine writes nothing of it. One that dies renews no more, and after `seconds` another takes its machines over. Every
process takes as many machines as are its share among those alive. The hosts' clocks must agree within a second.
"""

from __future__ import annotations

import math
import time
from collections.abc import Collection

from sqlalchemy import Connection, Update, delete, func, insert, or_, select, update

from monitor.intake.blocks import NANO
from monitor.store.schema import LEASE, WORKER
from monitor.store.store import Store

_LEADER = ""
"""Lease of what one process does for all: sending alarms, archiving, forgetting."""


class Leases:
    """The leases of one process.

    Parameters
    ----------
    store : Store
    owner : str
        Name of this process, another one for each; it is the same after a restart.
    seconds : float
        For which a lease holds.
    """

    def __init__(self, store: Store, owner: str, seconds: float) -> None:
        self.owner, self.seconds = owner, seconds
        self._store, self._ns = store, round(seconds * NANO)
        self._alive, self._lead = 1, False

    def keep(self, connection: Connection, machine: str) -> bool:
        """Renew the lease of a machine, which is then this process' until the transaction ends; False: it is not, or no
        longer, and what is known of the machine here is of the past."""
        mine = (LEASE.c.machine == machine) & (LEASE.c.owner == self.owner)
        return bool(connection.execute(self._renewal(time.time_ns()).where(mine)).rowcount)

    def take(self, connection: Connection, machine: str, force: bool = False) -> bool:
        """Take a machine whose lease is free; False: another process has it. `force` takes it whoever has it."""
        now = time.time_ns()
        renewal = self._renewal(now).where(LEASE.c.machine == machine)
        if not force:
            renewal = renewal.where(or_(LEASE.c.owner == self.owner, LEASE.c.until_ns < now))
        if connection.execute(renewal).rowcount:
            return True
        if connection.execute(select(LEASE.c.machine).where(LEASE.c.machine == machine)).first() is not None:
            return False
        # Where two begin at once, the second one's transaction breaks off at the key and is done again.
        connection.execute(insert(LEASE).values(machine=machine, owner=self.owner, until_ns=now + self._ns))
        return True

    def release(self, machines: Collection[str]) -> None:
        """Give machines back: another process may take them at once."""
        with self._store.transaction() as connection:
            mine = (LEASE.c.owner == self.owner) & LEASE.c.machine.in_(list(machines))
            connection.execute(update(LEASE).where(mine).values(until_ns=0))

    def renew(self, held: Collection[str]) -> None:
        """Say that this process lives, renew what it holds, count who else lives, and see who leads."""
        now = time.time_ns()
        with self._store.transaction() as connection:
            values = {"until_ns": now + self._ns}
            alive = update(WORKER).where(WORKER.c.owner == self.owner).values(**values)
            if not connection.execute(alive).rowcount:
                connection.execute(insert(WORKER).values(owner=self.owner, **values))
            connection.execute(delete(WORKER).where(WORKER.c.until_ns < now))
            self._alive = connection.execute(select(func.count()).select_from(WORKER)).scalar() or 1
            mine = (LEASE.c.owner == self.owner) & LEASE.c.machine.in_(list(held))
            connection.execute(self._renewal(now).where(mine))
            self._lead = self.take(connection, _LEADER)

    def share(self, machines: int) -> int:
        """How many of so many machines are this process' share."""
        return math.ceil(machines / self._alive)

    @property
    def leads(self) -> bool:
        """Whether this process does what one does for all."""
        return self._lead

    def end(self) -> None:
        """Give everything back."""
        with self._store.transaction() as connection:
            connection.execute(update(LEASE).where(LEASE.c.owner == self.owner).values(until_ns=0))
            connection.execute(delete(WORKER).where(WORKER.c.owner == self.owner))

    def _renewal(self, now: int) -> Update:
        return update(LEASE).values(owner=self.owner, until_ns=now + self._ns)
