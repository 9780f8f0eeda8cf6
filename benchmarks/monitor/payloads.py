"""Broken payloads: whatever comes is a block or one sentence, and blocks that are still read make no turn."""

from __future__ import annotations

import argparse
import json
import random
from collections.abc import Mapping

import numpy as np

from indexer_env.errors import SignalError
from indexer_env.signal import Signal
from indexer_records.conditions import RecordConditions
from indexer_records.stream import StreamedTurn
from monitor.alarms import Rules
from monitor.analysis.finding import Finding
from monitor.intake.cutter import Mode
from monitor.intake.payload import block_of
from monitor.pipeline import Pipeline
from monitor.plan import Plan

_VALUES = (
    None,
    True,
    False,
    0,
    -1,
    1e308,
    10**400,
    "",
    "NaN",
    "1",
    [],
    [[]],
    {},
    {"a": 1},
    [None],
    ["x"],
    3.5,
    "2026-01-01",
)


def broken(dice: random.Random) -> tuple[bytes, dict[str, str] | None]:
    """A good message with something wrong: a field, some bytes, its end, its properties."""
    body: dict[str, object] = {
        "time": 1_800_000_000 + dice.random(), "rate": 1000, "unit": "m/s^2",
        "values": [round(dice.gauss(0, 1), 3) for _ in range(dice.randrange(1, 40))], "sequence": dice.randrange(100),
    }  # fmt: skip
    kind = dice.randrange(6)
    if kind == 0:
        body[dice.choice([*body, "pulse", "sensor", "speed_rpm", "begins", "extra"])] = dice.choice(_VALUES)
    elif kind == 1:
        del body[dice.choice(["time", "rate", "unit", "values"])]
    payload = bytearray(json.dumps(body).encode())
    if kind == 2:
        payload = payload[: dice.randrange(len(payload))]
    elif kind == 3:
        for _ in range(dice.randrange(1, 8)):
            payload[dice.randrange(len(payload))] = dice.randrange(256)
    elif kind == 4:
        payload = bytearray(dice.randbytes(dice.randrange(0, 200)))
    elif kind == 5:
        words = ["1000", "", "x", "nan", "-5", "2", "1e400", "2026-01-01T00:00:00Z", "m/s^2"]
        names = ["rate", "time", "unit", "columns", "sequence", "speed_rpm", "begins"]
        return bytes(dice.randbytes(dice.randrange(0, 60))), {name: dice.choice(words) for name in names}
    return bytes(payload), None


class _Undiagnosed:
    """A machine whose turns are cut and not diagnosed."""

    modes = (Mode("1500 rpm", rate=1000.0, duration=8.2, unit="m/s^2"),)
    quantities = ()
    units: Mapping[str, str] = {}

    def flaw(self, mode: Mode, turn: StreamedTurn) -> tuple[str, str]:
        return "not_comparable", turn.problem or "nobody looks at it"

    def diagnose_turn(
        self, signal: Signal, conditions: RecordConditions, start_angle: float | None = None
    ) -> Finding:  # fmt: skip
        raise NotImplementedError


def measure(count: int, seed: int) -> dict[str, int]:
    """Counts of sentences, of blocks, and of turns that a pipeline makes of all these blocks as those of one machine;
    an exception of any other kind ends the run."""
    dice, refused, taken = random.Random(seed), 0, 0
    pipeline = Pipeline("m", _Undiagnosed(), Plan({}, Rules()))
    for _ in range(count):
        payload, properties = broken(dice)
        try:
            block = block_of("m", payload, properties)
        except SignalError as error:
            assert "\n" not in str(error) and len(str(error)) < 400, error
            refused += 1
            continue
        # What still reads as a message is one: finite rate and time, samples of one length.
        assert np.isfinite(block.rate) and block.rate > 0 and block.values.ndim == 1
        assert block.pulse is None or block.pulse.shape == block.values.shape
        pipeline.take(block)
        taken += 1
    pipeline.finish()
    return {
        "payloads": count, "refused_with_a_sentence": refused, "still_a_message": taken, "turns": pipeline.turns,
    }  # fmt: skip


def main(arguments: list[str]) -> None:
    """The command."""
    parser = argparse.ArgumentParser(prog="benchmarks.monitor payloads")
    parser.add_argument("--count", type=int, default=100_000)
    parser.add_argument("--seed", type=int, default=1)
    given = parser.parse_args(arguments)
    print(json.dumps(measure(given.count, given.seed)))
