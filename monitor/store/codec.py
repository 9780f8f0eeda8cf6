"""Samples and plain values <-> bytes."""

from __future__ import annotations

import json
import zlib
from typing import Any

import numpy as np

from monitor.intake.blocks import Block

_FAST = 1
"""Level of zlib: the quickest; states of a machine shrink to a quarter by it."""


def pack(body: dict[str, Any]) -> bytes:
    """Plain values as compressed JSON, in which Python, its only reader, has a word for an endless interval."""
    return zlib.compress(json.dumps(body, separators=(",", ":")).encode(), _FAST)


def unpack(content: bytes) -> dict[str, Any]:
    """Inverse of `pack`."""
    return json.loads(zlib.decompress(content))


def block_bytes(block: Block) -> bytes:
    """A block: a line of JSON, then the samples and the pulse as float32."""
    head = {
        "machine": block.machine,
        "start_ns": block.start_ns,
        "rate": block.rate,
        "unit": block.unit,
        "sequence": block.sequence,
        "sensor": block.sensor,
        "motor_speed": block.motor_speed,
        "begins": block.begins,
        "pulse": block.pulse is not None,
    }
    pulse = b"" if block.pulse is None else block.pulse.astype("<f4").tobytes()
    return json.dumps(head).encode() + b"\n" + block.values.astype("<f4").tobytes() + pulse


def block_from(content: bytes) -> Block:
    """Inverse of `block_bytes`."""
    head, _, samples = bytes(content).partition(b"\n")
    fields = json.loads(head)
    values = np.frombuffer(samples, "<f4")
    pulse = None
    if fields.pop("pulse"):
        values, pulse = values[: values.size // 2], values[values.size // 2 :]
    return Block(values=values, pulse=pulse, **fields)
