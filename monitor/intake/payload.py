"""Bytes of a message -> block.

Two forms. JSON, one object:

    {"time": "2026-11-22T06:00:00Z", "rate": 1000, "unit": "m/s^2", "values": [0.1, ...],
     "pulse": [0, ...], "sequence": 17, "sensor": "SN 4711", "speed_rpm": 1500, "begins": false}

of which time, rate, unit and values are needed; time may be seconds since 1970 as well. Or the samples as little-endian
float32, and the same names as MQTT 5 user properties (without values; with `columns: 2` values and pulse alternate).
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Mapping
from datetime import datetime
from typing import Any

import numpy as np

from indexer_env.errors import SignalError
from indexer_env.units import RPM
from monitor.intake.blocks import LARGEST_BLOCK, NANO, Block

LARGEST_PAYLOAD = 24 * LARGEST_BLOCK
"""Most bytes of a message: a block of samples and pulses as JSON with a dozen digits each."""

_NEEDED = ("time", "rate", "unit", "values")
_SECONDS = re.compile(r"\d{1,10}(\.\d{1,9})?")
_KEYS = (*_NEEDED, "pulse", "sequence", "sensor", "speed_rpm", "begins")


def block_of(machine: str, payload: bytes, properties: Mapping[str, str] | None = None) -> Block:
    """The block that a message holds.

    Parameters
    ----------
    machine : str
    payload : bytes
    properties : mapping of str to str, optional
        MQTT 5 user properties; with "rate" among them the payload is float32, else JSON.

    Raises
    ------
    SignalError
        One sentence: what is wrong with it.
    """
    if len(payload) > LARGEST_PAYLOAD:
        raise SignalError(f"a message must have at most {LARGEST_PAYLOAD} bytes, got {len(payload)}.")
    body = _binary(payload, properties) if properties and "rate" in properties else _json(payload)
    unknown = sorted(set(body) - set(_KEYS))
    if unknown:
        raise SignalError(f"the message must have the keys {', '.join(_KEYS)} only, got {str(unknown[0])[:40]!r}.")
    missing = [key for key in _NEEDED if body.get(key) is None]
    if missing:
        raise SignalError(f"the message must state {', '.join(_NEEDED)}, it lacks {missing[0]}.")
    speed = body.get("speed_rpm")
    if speed is not None and (isinstance(speed, bool) or not isinstance(speed, int | float) or not 0 < speed < 1e6):
        raise SignalError("the message's speed_rpm must be a number > 0 and < 1000000 rpm.")
    return Block(
        machine=machine,
        start_ns=nanoseconds(body["time"]),
        rate=body["rate"],
        unit=body["unit"],
        values=_list("values", body["values"]),
        pulse=None if body.get("pulse") is None else _list("pulse", body["pulse"]),
        sequence=body.get("sequence"),
        sensor=body.get("sensor"),
        motor_speed=None if speed is None else speed * RPM,
        begins=body.get("begins", False),
    )


def nanoseconds(time: object) -> int:
    """Nanoseconds since 1970 of a time in seconds or in ISO 8601 with its zone; raises SignalError."""
    if isinstance(time, int | float) and not isinstance(time, bool):
        if not 0 <= time < 1e10:
            raise SignalError("the message's time must be seconds since 1970, as 1800000000.")
        return round(time * NANO) if isinstance(time, float) else time * NANO
    if not isinstance(time, str):
        raise SignalError("the message's time must be seconds since 1970 or a text in ISO 8601.")
    try:
        moment = datetime.fromisoformat(time)
    except ValueError:
        raise SignalError(f"the message's time must be in ISO 8601, got {time[:40]!r}.") from None
    if moment.tzinfo is None:
        raise SignalError(f"the message's time must have a zone, such as Z or +01:00, got {time[:40]!r}.")
    try:
        seconds = int(moment.replace(microsecond=0).timestamp())
    except (OverflowError, ValueError):
        raise SignalError(f"the message's time must lie between 1970 and 2100, got {time[:40]!r}.") from None
    return seconds * NANO + moment.microsecond * 1000


def _json(payload: bytes) -> dict[str, Any]:
    try:
        body = json.loads(payload)
    except (ValueError, RecursionError):
        raise SignalError("the message must be JSON, or float32 with the user property rate.") from None
    if not isinstance(body, dict):
        raise SignalError(f"the message must be one JSON object, got {type(body).__name__}.")
    return body


def _binary(payload: bytes, properties: Mapping[str, str]) -> dict[str, Any]:
    body: dict[str, Any] = {key: value for key, value in properties.items() if key in _KEYS}
    columns = {"1": 1, "2": 2}.get(properties.get("columns", "1"))
    if columns is None or not payload or len(payload) % (4 * columns):
        raise SignalError("a float32 message must hold whole samples in 1 or 2 columns.")
    samples = np.frombuffer(payload, "<f4").reshape(-1, columns)
    body |= {"values": samples[:, 0]} | ({"pulse": samples[:, 1]} if columns == 2 else {})
    try:
        for key, kind in (("rate", float), ("sequence", int), ("speed_rpm", float)):
            if key in body:
                body[key] = kind(body[key])
    except ValueError:
        raise SignalError("the user properties rate, sequence and speed_rpm must be numbers.") from None
    if _SECONDS.fullmatch(body.get("time", "")):
        body["time"] = float(body["time"])
    if "begins" in body:
        begins = {"true": True, "false": False}.get(str(body["begins"]).lower())
        if begins is None:
            raise SignalError(f"the user property begins must be true or false, got {str(body['begins'])[:40]!r}.")
        body["begins"] = begins
    return body


def _list(name: str, given: object) -> np.ndarray:
    """Numbers as an array; null for a sample that the sensor did not give."""
    if isinstance(given, np.ndarray):
        return given
    if not isinstance(given, list) or not 1 <= len(given) <= LARGEST_BLOCK:
        raise SignalError(f"the message's {name} must be a list of 1 to {LARGEST_BLOCK} numbers.")
    if not set(map(type, given)) <= {int, float, type(None)}:
        raise SignalError(f"the message's {name} must be numbers.")
    try:
        return np.array([math.nan if value is None else value for value in given], dtype=np.float64)
    except (OverflowError, ValueError):
        raise SignalError(f"the message's {name} must be numbers in the range of float64.") from None
