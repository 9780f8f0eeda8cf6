"""The thread that takes blocks, runs the pipelines and commits each batch in one transaction.

A block is acknowledged to its source once the transaction that holds it and all that it led to is committed. Where the
database breaks off, all pipelines are forgotten, and when it is back they are made again from what was committed, and
the batch is taken in again: what of it had been committed comes twice then, and is left out.
"""

from __future__ import annotations

import functools
import logging
import math
import queue
import threading
import time
from collections.abc import Callable

from sqlalchemy import Connection
from threadpoolctl import threadpool_limits

from indexer_env.errors import refuse
from monitor.alarms import Event
from monitor.analysis.finding import Diagnoser
from monitor.fleet import Fleet
from monitor.intake.arrivals import Arrival, Batches
from monitor.intake.unread import Unread
from monitor.leases import Leases
from monitor.pipeline import Pipeline
from monitor.plan import Change, Outcome, Plan
from monitor.store.store import Store, StoreConflict, StoreDown, drop_blocks, write_block, write_machine, write_position
from monitor.store.writing import write_outcome

_log = logging.getLogger(__name__)

_TICK_S = 0.5
_RETRY_S = 1.0
_CONFLICTS = 5  # in a row: no other process that takes a machine at the same time


class Engine:
    """Runs until `stop`.

    Parameters
    ----------
    store : Store
    diagnoser : Diagnoser
    plan : Plan
    channels : tuple of str
        Outputs that want to hear of alarms: each gets its own copy in the outbox.
    changed : callable
        Called from the engine's thread with each `Change`, after its commit.
    queue_blocks : int
        Blocks that may wait; a source that brings more is held up.
    stale_s : float
        Seconds without samples after which a machine is stale, by the clock of this host.
    reorder_s : float
        Seconds without any block after which those that wait for a missing one wait no longer.
    leases : Leases, optional
        Where several processes share the machines.
    """

    def __init__(
        self,
        store: Store,
        diagnoser: Diagnoser,
        plan: Plan,
        channels: tuple[str, ...] = (),
        changed: Callable[[Change], None] = lambda change: None,
        queue_blocks: int = 2000,
        stale_s: float = 60.0,
        reorder_s: float = 2.0,
        leases: Leases | None = None,
    ) -> None:
        self._store, self._diagnoser, self._plan, self._channels = store, diagnoser, plan, channels
        self._changed, self._stale_s, self._reorder_s = changed, stale_s, reorder_s
        self.trouble: str | None = None
        self.told: Callable[[], None] = lambda: None
        self._queue: queue.Queue[Arrival] = queue.Queue(queue_blocks)
        self._batches = Batches(self._queue)
        self._ended: set[str] = set()
        self.unread = Unread()
        self._fleet = Fleet(store, diagnoser, plan, leases)
        self._renewed = -math.inf
        self._lock = threading.RLock()
        self._stopping = threading.Event()
        self._thread = threading.Thread(target=self._run, name="engine", daemon=True)
        self.failure: BaseException | None = None
        self.blocks = self.turns = self.refused = self.retries = 0

    # ------------------------------------------------------------------------------------------------ outside

    def start(self) -> None:
        """Make the pipelines of all known machines, and begin."""
        with self._lock:
            self._fleet.load()
        self._thread.start()

    def stop(self) -> None:
        """Finish the batch at hand and end."""
        self._stopping.set()
        if self._thread.is_alive():
            self._thread.join()

    def offer(self, arrival: Arrival, timeout: float | None = None) -> bool:
        """Hand in a block; waits while the queue is full, at most `timeout` [s]. False: it was not taken."""
        try:
            self._queue.put(arrival, timeout=timeout)
        except queue.Full:
            return False
        return True

    @property
    def waiting(self) -> int:
        """Blocks in the queue."""
        return self._queue.qsize()

    def positions(self, source: str) -> dict[str, str]:
        """How far a source has been read, by item; asks until the database answers."""
        while not self._stopping.is_set():
            try:
                return self._store.positions(source)
            except StoreDown:
                self._stopping.wait(_RETRY_S)
        return {}

    def broken(self, machine: str, sentence: str, item: str = "") -> None:
        """A message, or a file, `item`, could not be read; it is told with its machine as soon as this is known."""
        self.refused += 1
        self.unread.add(machine, sentence, item)

    def newest_ns(self, machine: str) -> int | None:
        """End of the newest samples of a machine [ns since 1970]; None: it is unknown."""
        pipeline = self._fleet.pipelines.get(machine)
        return None if pipeline is None else pipeline.newest_ns

    def ended(self, machine: str) -> None:
        """No samples are expected from a machine for now: it is not stale."""
        self._ended.add(machine)

    def command(self, machine: str, quantity: str, act: Callable[[Pipeline], Event]) -> Event:
        """An operator does something to an alarm; it is committed when this returns.

        Raises
        ------
        ParameterError
            There is no such alarm, or `act` refuses.
        StoreDown
            The database cannot be reached.
        """
        with self._lock:
            self._fleet.take_over(machine)
            pipeline = self._fleet.pipelines.get(machine)
            if pipeline is None and self.trouble is not None:
                raise StoreDown(self.trouble)
            if pipeline is None or quantity not in pipeline.conditions:
                raise refuse("alarm", "machine", "the name of a machine and a quantity that it has", machine)
            before = pipeline.watch.to_dict()
            happened = act(pipeline)
            try:
                with self._store.transaction() as connection:
                    self._write(connection, machine, Outcome(events=[happened]))
            except StoreDown:
                pipeline.watch.replace(before)
                raise
            self._changed(Change(pipeline.summary(), (happened,)))
            return happened

    # ------------------------------------------------------------------------------------------------ inside

    def _run(self) -> None:
        try:
            # Matrices of a hundred rows are slower in several threads, on a busy host many times.
            with threadpool_limits(1):
                ticked = time.monotonic()
                while not self._stopping.is_set():
                    batch, began = self._batches.next(), time.monotonic()
                    if batch:
                        self._insist(functools.partial(self._work, batch))
                        self._batches.took(time.monotonic() - began)
                    if time.monotonic() - ticked >= _TICK_S:
                        ticked = time.monotonic()
                        self._insist(self._tick)
        except BaseException as error:
            self.failure = error
            _log.exception("the engine has stopped")

    def _insist(self, work: Callable[[], None]) -> None:
        """Do it until the database has taken it; raises StoreConflict where this does not help."""
        conflicts, forgotten = 0, False
        while not self._stopping.is_set():
            try:
                with self._lock:
                    if forgotten:
                        self._fleet.load()
                        forgotten = False
                    work()
                self._tell(None)
                return
            except StoreDown as reason:
                conflicts = conflicts + 1 if isinstance(reason, StoreConflict) else 0
                if conflicts == _CONFLICTS:
                    raise
                self.retries += 1
                self._tell(f"the store cannot be used ({reason}); trying again")
                if self.retries % 30 == 1:
                    _log.warning("the store cannot be used (%s); trying again", reason)
                with self._lock:
                    self._fleet.pipelines.clear()
                forgotten = True
                self._stopping.wait(_RETRY_S)

    def _tell(self, trouble: str | None) -> None:
        """Why nothing can be stored at present, as a sentence for the page; None: it can."""
        changed, self.trouble = trouble != self.trouble, trouble
        if changed:
            self.told()

    def _work(self, batch: list[Arrival]) -> None:
        changes: dict[str, list[Event]] = {}
        turns = 0
        with self._store.transaction() as connection:
            arrived = {arrival.block.machine for arrival in batch}
            mine = self._fleet.held(connection, arrived | self._fleet.waiting())
            for arrival in self._fleet.due(mine, batch):
                block = arrival.block
                pipeline = self._fleet.pipeline(block.machine)
                self._ended.discard(block.machine)
                if arrival.position is not None:
                    write_position(connection, *arrival.position)
                    self.unread.read(pipeline, arrival.position[1])
                happened = changes.setdefault(block.machine, [])
                if (outcome := pipeline.take(block)) is None:
                    continue
                pipeline.heard_ns = time.time_ns()
                write_block(connection, block)
                write_outcome(connection, pipeline, outcome, self._channels)
                happened += outcome.events
                turns += len(outcome.turns)
            for machine in changes:
                self._write_state(connection, machine)
        self._fleet.settle(mine, batch)
        self.blocks, self.turns = self.blocks + len(batch), self.turns + turns
        for arrival in batch:
            if arrival.kept is not None:
                arrival.kept()
        for machine, events in changes.items():
            self._changed(Change(self._fleet.pipelines[machine].summary(), tuple(events)))

    def _tick(self) -> None:
        """Machines that are silent, and blocks that have waited long enough."""
        now = time.monotonic()
        if now - self._renewed > self._fleet.renewal_s:
            for summary in self._fleet.renew():
                self._changed(Change(summary, (), own=False))
            self._renewed = now
        if self._fleet.waiting():
            # A machine that was another's until now may send no more.
            self._work([])
        for machine, pipeline in list(self._fleet.pipelines.items()):
            silent = now - self._fleet.heard.get(machine, now)
            now_ns, outcome = pipeline.time_at(time.time_ns()), Outcome()
            changed = self.unread.move(machine, pipeline.states, now_ns)
            if pipeline.waiting and silent > self._reorder_s:
                outcome, changed = pipeline.flush(), True
            outcome.events += pipeline.watch.at(now_ns)
            if silent > self._stale_s and machine not in self._ended and "stale" not in pipeline.states.active:
                pipeline.note_silence(now_ns)
                changed = True
            if self._queue.qsize() > 0.8 * self._queue.maxsize:
                pipeline.states.note("overload", now_ns)
                changed = True
            if changed or outcome.events:
                with self._store.transaction() as connection:
                    self._fleet.held(connection, {machine})
                    if self._fleet.pipelines.get(machine) is not pipeline:
                        continue
                    self._write(connection, machine, outcome)
                self.turns += len(outcome.turns)
                self._changed(Change(pipeline.summary(), tuple(outcome.events)))

    # ------------------------------------------------------------------------------------------------ writing

    def _write(self, connection: Connection, machine: str, outcome: Outcome) -> None:
        write_outcome(connection, self._fleet.pipelines[machine], outcome, self._channels)
        self._write_state(connection, machine)

    def _write_state(self, connection: Connection, machine: str) -> None:
        pipeline = self._fleet.pipelines[machine]
        write_machine(connection, machine, pipeline.to_dict(), pipeline.summary())
        needed, newest = pipeline.first_needed_ns(), pipeline.newest_ns
        if needed is not None and newest is not None:
            drop_blocks(connection, machine, needed, newest)
