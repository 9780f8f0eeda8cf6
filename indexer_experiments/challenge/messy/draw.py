"""What is in case k of the messy challenge: a function of seed, half and k alone."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from indexer_env.checks import check_choice, check_integer, check_number
from indexer_env.effects import EFFECTS
from indexer_env.machine import Machine
from indexer_env.operating_point import OperatingPoint
from indexer_env.units import RPM
from indexer_experiments.challenge.draw import HIDDEN
from indexer_experiments.challenge.messy.disturbances import DISTURBANCES, HALVES, Kind
from indexer_experiments.challenge.messy.machines import Pair, drawn_machine

_TURN = 2.0 * math.pi

RATES = (500.0, 640.0, 800.0, 1000.0, 1280.0, 1600.0, 2000.0, 2560.0, 4000.0, 5000.0)
NOISE = (0.003, 0.05)
"""Noise over the rms of the first record, log-uniform."""
CORRELATION = (0.0, 0.95)
"""ρ of its autoregression from sample to sample."""
BITS = (10, 16)
CLOCK, LOAD_ERROR, DRIFT = 0.003, 0.1, 0.005
"""Largest relative error of the sample clock and of the load stated, largest relative change of speed in a record."""
SPEED_RPM, LOAD = (1000.0, 1600.0), (1.0, 30.0)
"""Motor speed, uniform; load [N m] of a machine of the reference's size, log-uniform."""
TURNS, RECORDS = (1.0, 3.0), (1, 3)
_LEAST_TURNS, _LEAST_CAM_TURNS, _LEAST_HELD = 2.1, 18.0, 6.0
"""Of all records together, and of one that is held out: less than that `indexer explain` turns away, as it says."""

HIDDEN_SHARES = (0.35, 0.4, 0.25)
"""Shares of cases with none, one and two effects of the library hidden."""

DISTURBED = (0.5, 3.0)
"""What all disturbances of a case leave together, over the noise; log-uniform."""
_SMALL = 0.05
"""The same at most, over the signal: with 5 % of noise, three times that would be another machine."""

ABOVE = (3.0, 8.0)
"""What each hidden effect leaves, over the larger one of noise and disturbances; log-uniform, within `_LARGE`."""
_LARGE = 0.2
"""The same at most, over the signal: four times `_SMALL`, so that 3 is always possible."""

_ORDERS = {"drive.speed_ripple": (1, 2), "drive.transmission_error": (1, 2, 3), "drive.mesh_stiffness": (1, 2, 3)}
_MAINS = (50.0, 60.0)
_SAME = {"drive.speed_ripple", "drive.transmission_error"}
"""Of one order, these are the same motion; never hidden together."""


@dataclass(frozen=True)
class MessyOrder:
    """A half of the messy challenge.

    Attributes
    ----------
    count, seed : int
        Cases, >= 1, and >= 0.
    half : str
        Of `disturbances.HALVES`: whose kinds of disturbance are drawn.
    limit : float or None
        Processor time after which a search is stopped without an answer [s], > 0; None: no limit.
    """

    count: int
    seed: int
    half: str
    limit: float | None = None

    def __post_init__(self) -> None:
        check_integer("challenge", "count", self.count, low=1)
        check_integer("challenge", "seed", self.seed, low=0)
        check_choice("challenge", "half", self.half, HALVES)
        if self.limit is not None:
            check_number("challenge", "limit", self.limit, low=0.0, low_open=True, unit="s")


@dataclass(frozen=True)
class Wanted:
    """An effect or a disturbance as it is drawn: its shape is settled, its size will be sought."""

    name: str
    shape: Mapping[str, float]

    @property
    def kind(self) -> Kind:
        """Of a disturbance."""
        return DISTURBANCES[self.name]


@dataclass(frozen=True)
class RecordDraw:
    """One record: true point, turns of the table, load as stated, relative change of speed, what is done with it, and
    its number, the judging one's the last."""

    point: OperatingPoint
    turns: float
    stated_load: float
    drift: float
    held_out: bool
    hum_phase: float
    number: int = 0

    def samples(self, machine: Machine, rate: float) -> int:
        """Samples at a rate [Hz]."""
        return int(self.turns * machine.turn_duration(self.point) * rate)


@dataclass(frozen=True, eq=False)
class MessyDraw:
    """A case before its sizes are known.

    Attributes
    ----------
    machines : Pair
    records : tuple of RecordDraw
    judging : RecordDraw
        A record at conditions of its own that no method gets.
    rate, clock : float
        Sampling rate as stated [Hz], its relative error.
    noise, correlation : float
    bits : int
    disturbances : tuple of Wanted
        0 to 3.
    disturbed : float
        What they leave together, over the noise; 0 without any.
    effects : tuple of Wanted
        In the order in which they are tried until `hidden` of them reach their size.
    hidden : int
        0 to 2.
    above : float
        What each leaves over the larger one of noise and disturbances.
    seeds : tuple of SeedSequence
        For noise and readers.
    """

    machines: Pair
    records: tuple[RecordDraw, ...]
    judging: RecordDraw
    rate: float
    clock: float
    noise: float
    correlation: float
    bits: int
    disturbances: tuple[Wanted, ...]
    disturbed: float
    effects: tuple[Wanted, ...]
    hidden: int
    above: float
    seeds: tuple[np.random.SeedSequence, ...]


def messy_draw(order: MessyOrder, number: int) -> MessyDraw:
    """Case `number`."""
    # 4, as the clean challenge's keys are three numbers long
    root = np.random.SeedSequence(order.seed, spawn_key=(HALVES.index(order.half), number, 0, 4))
    machine_seed, record_seed, sensor_seed, mess_seed, effect_seed, *others = root.spawn(7)
    machines = drawn_machine(np.random.default_rng(machine_seed))
    rng = np.random.default_rng(sensor_seed)
    noise = _log_uniform(rng, NOISE)
    rate, clock = float(rng.choice(RATES)), CLOCK * rng.uniform(-1.0, 1.0)
    correlation, bits = rng.uniform(*CORRELATION), int(rng.integers(BITS[0], BITS[1] + 1))
    disturbances, disturbed = _disturbances(order.half, noise, np.random.default_rng(mess_seed))
    rng = np.random.default_rng(effect_seed)
    hidden = int(rng.choice(len(HIDDEN_SHARES), p=HIDDEN_SHARES))
    base = max(disturbed, 1.0)
    above = _log_uniform(rng, (ABOVE[0], min(ABOVE[1], _LARGE / (noise * base))))
    *records, judging = _records(machines, np.random.default_rng(record_seed))
    return MessyDraw(
        machines, tuple(records), judging, rate, clock, noise, correlation, bits, disturbances, disturbed,
        _effects(machines, rng), hidden, above, tuple(others),
    )  # fmt: skip


def _disturbances(half: str, noise: float, rng: np.random.Generator) -> tuple[tuple[Wanted, ...], float]:
    kinds = [kind for kind in DISTURBANCES.values() if kind.half == half]
    chosen = rng.choice(len(kinds), int(rng.integers(0, 4)), replace=False)
    level = _log_uniform(rng, (DISTURBED[0], min(DISTURBED[1], _SMALL / noise)))
    shapes = [{name: rng.uniform(*law) for name, law in kinds[k].shape.items()} for k in chosen]
    wanted = tuple(Wanted(kinds[k].name, shape) for k, shape in zip(chosen, shapes, strict=True))
    return wanted, level if wanted else 0.0


def _records(machines: Pair, rng: np.random.Generator) -> list[RecordDraw]:
    """The records, then one more for judging."""
    stations, count = machines.truth.stations, int(rng.integers(RECORDS[0], RECORDS[1] + 1))
    made = [_record(machines, rng) for _ in range(RECORDS[1] + 1)]
    while count < RECORDS[1] and not _enough(made[:count], stations):
        count += 1
    if not _enough(made[:count], stations):
        made = [replace(record, turns=TURNS[1]) for record in made]
    holds = rng.random() < 0.7 and made[0].turns * stations >= _LEAST_HELD and _enough(made[1:count], stations)
    found = [replace(made[0], held_out=holds), *made[1:count], made[-1]]
    return [replace(record, number=k) for k, record in enumerate(found)]


def _enough(records: list[RecordDraw], stations: int) -> bool:
    turns = sum(record.turns for record in records)
    return turns >= _LEAST_TURNS and turns * stations >= _LEAST_CAM_TURNS


def _record(machines: Pair, rng: np.random.Generator) -> RecordDraw:
    speed, load = rng.uniform(*SPEED_RPM) * RPM, _log_uniform(rng, LOAD) * machines.size
    point = OperatingPoint(speed, load, rng.uniform(0.0, _TURN * machines.truth.stations))
    stated = load * (1.0 + LOAD_ERROR * rng.uniform(-1.0, 1.0))
    turns, drift = rng.uniform(*TURNS), DRIFT * rng.uniform(-1.0, 1.0)
    return RecordDraw(point, turns, stated, drift, False, rng.uniform(0.0, _TURN))


def _effects(machines: Pair, rng: np.random.Generator) -> tuple[Wanted, ...]:
    """All effects in random order, each with its shape."""
    truth = machines.truth
    wanted = []
    for k in rng.permutation(len(HIDDEN)):
        name = list(HIDDEN)[k]
        shape: dict[str, float] = {}
        for field, law in HIDDEN[name].items():
            if not isinstance(law, tuple):
                continue
            u = rng.random()
            shape[field] = law[0] + u * (law[1] - law[0])
            if field == "station":
                shape[field] = int(u * truth.stations)
            elif field in ("centre", "half_width"):
                shape[field] = _placed(name, field, u, truth.motion_share)
        if name in _ORDERS:
            shape["order"] = float(rng.choice(_ORDERS[name]))
        if name == "sensor.mains_hum":
            shape["frequency"] = float(rng.choice(_MAINS))
        wanted.append(Wanted(name, shape))
    first = next(w.name for w in wanted if w.name in _SAME)
    return tuple(w for w in wanted if w.name == first or w.name not in _SAME)


def _placed(name: str, field: str, u: float, share: float) -> float:
    """A bump within the motion, or a pulse within the dwell."""
    begin, length = (0.0, share) if name == "cam.profile_error" else (share, 1.0 - share)
    return begin + length * (0.2 + 0.6 * u) if field == "centre" else length * (0.1 + 0.1 * u)


def _log_uniform(rng: np.random.Generator, ends: tuple[float, float]) -> float:
    return math.exp(rng.uniform(math.log(ends[0]), math.log(ends[1])))


def unit_size(name: str, size: float) -> float:
    """Size from which the search for the right one begins, on a machine `size` times as heavy as the reference."""
    field, law = next(iter(HIDDEN[name].items()))
    assert not isinstance(law, tuple)
    unit = next(f.metadata["unit"] for f in EFFECTS[name].__dataclass_fields__.values() if f.name == field)
    return law * size ** (1 if unit.startswith("N m") else -1 if unit.endswith("N m)") else 0)
