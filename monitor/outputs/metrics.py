"""The endpoint for Prometheus."""

from __future__ import annotations

from collections.abc import Iterator

from prometheus_client import CollectorRegistry, generate_latest
from prometheus_client.core import CounterMetricFamily, GaugeMetricFamily, Metric

from monitor.alarms.limits import LEVELS
from monitor.engine import Engine
from monitor.store import Store


class Metrics:
    """What the engine has done and how the machines are."""

    def __init__(self, engine: Engine, store: Store) -> None:
        self._engine, self._store = engine, store
        self._registry = CollectorRegistry()
        self._registry.register(self)  # type: ignore[arg-type]

    def text(self) -> str:
        """In the text format of Prometheus."""
        return generate_latest(self._registry).decode()

    def describe(self) -> list[Metric]:
        """None: they are collected when asked for."""
        return []

    def collect(self) -> Iterator[Metric]:
        """As prometheus_client asks for them."""
        engine = self._engine
        yield CounterMetricFamily("monitor_blocks", "blocks taken in", engine.blocks)
        yield CounterMetricFamily("monitor_turns", "turns accepted", engine.turns)
        yield CounterMetricFamily("monitor_refused_messages", "messages that could not be read", engine.refused)
        yield CounterMetricFamily("monitor_store_retries", "times the database could not be used", engine.retries)
        yield GaugeMetricFamily("monitor_waiting_blocks", "blocks in the queue", engine.waiting)
        level = GaugeMetricFamily("machine_alarm_level", "0 normal, 1 alert, 2 alarm, 3 danger", labels=["machine"])
        size = GaugeMetricFamily("machine_size", "smoothed size of a quantity", labels=["machine", "quantity", "mode"])
        state = GaugeMetricFamily("machine_state", "1 while a state holds", labels=["machine", "state"])
        turns = CounterMetricFamily("machine_turns", "turns accepted", labels=["machine"])
        for one in self._store.machines():
            machine = one["machine"]
            level.add_metric([machine], LEVELS.index(one["level"]))
            turns.add_metric([machine], one["turns"])
            for mode, told in one["last"].get("modes", {}).items():
                for name, values in told["sizes"].items():
                    if values[0] is not None:
                        size.add_metric([machine, name, mode], values[0])
            for name in one["active_states"]:
                state.add_metric([machine, name], 1)
        yield from (level, size, state, turns)
