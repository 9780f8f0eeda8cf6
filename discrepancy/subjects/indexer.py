"""The cam indexing machine as a subject: its records by cam phase, station, torque, speed and load."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Mapping, Sequence

import numpy as np

from discrepancy.form import Form, shaped
from discrepancy.indexer import IndexerModel, machine_yaml, sensor_yaml
from discrepancy.indexer.scans import elsewhere_at, origin_at
from discrepancy.indexer.windows import START_PHASE
from discrepancy.model import Hypothesis, Model, Parameter
from discrepancy.origin import Origin
from discrepancy.place import Point
from discrepancy.records.conditions import grouped
from discrepancy.records.experiments import Experiments
from discrepancy.subjects.base import Axis, Line, Measurement, Subject, Torque, View, binned, told_apart
from discrepancy.subjects.imagined import imagined
from discrepancy.subjects.shop_units import in_the_shop
from indexer_env.effects import EFFECTS, TABLES
from indexer_env.effects.measures import measures
from indexer_env.effects.tabulated import ENDS
from indexer_env.machine import Machine
from indexer_env.operating_point import OperatingPoint
from indexer_env.sensors import Sensor
from indexer_env.units import RPM

_TURN = 2.0 * math.pi

PHASES = 24
"""Cells of the cam turn: 15° each, an index of half a turn has twelve."""

TIMES = 8
"""Cells of the time since a record's first sample."""

_MAINS = (50.0, 60.0, 100.0, 120.0, 150.0, 180.0)
"""Hz; mains hum of 50 and 60 Hz and its first harmonics."""

_ORDERS = {"table": (1, 2, 3), "cam": (1, 2, 3, 4, 6, 8), "motor shaft": (1, 2, 3, 4)}
"""Orders looked at of each shaft."""


_PARTS = {
    "the motor's speed through the torque of joint 1": "motor",
    "drive side of joint 1": "reducer",
    "torque of joint 1": "reducer",
    "motion law": "cam",
    "torque of joint 2": "cam",
    "table torque": "table",
    "joint 3": "base",
    "sensor": "sensor",
}
"""The part of the machine's picture for each quantity that an effect may enter (`Effect.enters`)."""


class IndexerSubject(Subject):
    """A nominal machine and its checked experiments.

    Parameters
    ----------
    machine : Machine
    sensor : Sensor
    records : Experiments
    uncertainty : mapping
    known : sequence of Hypothesis
        As `IndexerModel` takes them.
    """

    kind = "cam indexing machine"
    model: IndexerModel
    held_out: IndexerModel

    def __init__(
        self, machine: Machine, sensor: Sensor, records: Experiments, uncertainty: Mapping[str, float] | None = None,
        known: Sequence[Hypothesis] = (),
    ) -> None:  # fmt: skip
        self.machine, self.sensor, self.uncertainty = machine, sensor, dict(uncertainty or {})
        self.records, self.notes = records, records.notes
        if machine.effects:
            had = ", ".join(effect.name for effect in machine.effects)
            said = f"the machine has {had} already: it is taken as it is, neither fitted nor looked for"
            self.notes = (*records.notes, said)
        self.model, self.held_out = (
            IndexerModel(machine, part, sensor, self.uncertainty, known=tuple(known))
            for part in (records.fitted, records.held_out)
        )

    def view(self, model: Model) -> View:
        assert isinstance(model, IndexerModel)
        w, experiments = model.windows, model.experiments
        samples = np.arange(int(w.count.max()))
        inside = samples < w.count[:, None]
        points = [e.operating_point for e in experiments]
        rates = np.array([e.signal.sample_rate for e in experiments])
        cam_rates = np.array([self.machine.reduction * p.motor_speed for p in points])
        starts = np.array([p.start_angle for p in points])
        time = (w.first[:, None] + samples) / rates[w.record][:, None]
        measured = np.zeros(inside.shape)
        for row, (record, first, count) in enumerate(zip(w.record, w.first, w.count, strict=True)):
            measured[row, :count] = experiments[record].signal.values[first : first + count]
        turns = (starts[w.record][:, None] + cam_rates[w.record][:, None] * time) / _TURN
        time = time + np.array([e.begun for e in experiments])[w.record][:, None]
        return View(
            names=tuple(map(model.record, range(len(experiments)))),
            unit=experiments[0].signal.unit,
            groups=w.record,
            inside=inside,
            time=time,
            measured=measured,
            noise=np.array([e.noise_level for e in experiments]),
            estimated=tuple(e.noise is None for e in experiments),
            colour=np.array([e.colour for e in experiments]),
            axes=(*self._axes(turns, inside, w.record, points), _time_axis(time, inside)),
            map_axes=("station", "cam phase"),
            lines=self._lines(cam_rates / _TURN),
            window="cam turn",
            aligned=True,
            shafts=self._shafts(cam_rates / _TURN),
            torque=self._torque(turns, cam_rates[w.record][:, None], time),
        )

    def _torque(self, turns: np.ndarray, rate: np.ndarray, time: np.ndarray) -> Torque:
        """Residual acceleration times the table's inertia, over where the cam stands, how fast the table turns by the
        motion law, and when."""
        machine = self.machine
        law = machine.motion_law.evaluate(_TURN * (turns % 1.0).ravel(), machine.stations, machine.motion_share)
        speed = np.reshape(law[1], turns.shape) * rate
        over = {"cam angle [°]": 360.0 * (turns % 1.0), "speed of the table [rad/s]": speed, "time [s]": time}
        return Torque("missing torque on the table [N m]", machine.table_inertia / self.sensor.scale, over)

    def _axes(
        self, turns: np.ndarray, inside: np.ndarray, record: np.ndarray, points: list[OperatingPoint]
    ) -> tuple[Axis, ...]:
        phase, stations = turns % 1.0, self.machine.stations
        edges = np.linspace(0.0, 1.0, PHASES + 1)
        # A window, which begins shortly before its index, belongs to the station which that index leaves.
        turn = np.floor(turns + 1.0 - START_PHASE).astype(int) % stations
        axes = [
            Axis("cam phase", tuple(f"{360 * e:.0f}°" for e in edges[:-1]), binned(phase, edges, inside)),
            Axis("station", tuple(map(str, range(stations))), np.where(inside, turn, -1)),
            Axis("sign of the torque", ("driving", "braking", "dwell"), np.where(inside, self._sense(phase), -1)),
        ]
        for name, values, unit in (
            ("motor speed", [p.motor_speed / RPM for p in points], "rpm"),
            ("load", [p.load_torque for p in points], "N m"),
        ):
            number, middles = grouped(values)
            if len(middles) > 1:
                of_record = np.array(number)
                labels = tuple(f"{v:.4g} {unit}" for v in middles)
                axes.append(Axis(name, labels, np.where(inside, of_record[record][:, None], -1)))
        return tuple(axes)

    def _sense(self, phase: np.ndarray) -> np.ndarray:
        """0 where the cam drives the table, 1 where it brakes it, 2 in the dwell; by the motion law (w, n)."""
        share = self.machine.motion_share
        acceleration = self.machine.motion_law.evaluate(_TURN * phase, self.machine.stations, share)[2]
        return np.where(phase >= share, 2, np.where(acceleration >= 0.0, 0, 1))

    def _shafts(self, cam: np.ndarray) -> dict[str, np.ndarray]:
        """Speeds (records,) of the shafts, that of the cam given, in its unit."""
        return {"table": cam / self.machine.stations, "cam": cam, "motor shaft": cam * self.machine.reduction_ratio}

    def _lines(self, cam: np.ndarray) -> tuple[Line, ...]:
        shafts = self._shafts(cam)
        lines = [
            Line(f"order {order} of the {shaft}", shaft, order * shafts[shaft])
            for shaft, orders in _ORDERS.items()
            for order in orders
        ]
        fixed = [Line(f"{f:g} Hz", "fixed frequency", np.full(len(cam), f)) for f in _MAINS]
        return tuple(lines + fixed)

    def files(self, model: Model, place: Point) -> Mapping[str, str]:
        assert isinstance(model, IndexerModel)
        machine, sensor = model.machine_at(place.hypothesis, place.z)
        # what was known of the machine holds no more, now that it is fitted; its owner may take it up again
        known = [f"#   {name}: {value:g}\n" for name, value in self.uncertainty.items()]
        before = "".join(["# known of the machine before it was fitted:\n# uncertainty:\n", *known] if known else [])
        return {"machine.yaml": before + machine_yaml(machine), "sensor.yaml": sensor_yaml(sensor)}

    def meaning(self, effect: str) -> str:
        return EFFECTS[effect].sentence

    def measurements(self, model: Model) -> tuple[Measurement, ...]:
        assert isinstance(model, IndexerModel)
        return imagined(model)

    def origin(self, model: Model, place: Point) -> Origin | None:
        assert isinstance(model, IndexerModel)
        return origin_at(model, place)

    def of_records(self, model: Model, place: Point) -> tuple[str, ...]:
        assert isinstance(model, IndexerModel)
        values = model.values(place.hypothesis, place.z)
        return tuple(
            f"{model.record(k)}: the table's inertia is {math.exp(values[f'record {k}.inertia']):.3g} times the "
            "machine's."
            for k, e in enumerate(model.experiments) if e.inertia_uncertainty > 0.0
        )  # fmt: skip

    def elsewhere(self, model: Model, place: Point, without: Point, effect: str) -> str:
        assert isinstance(model, IndexerModel)
        return elsewhere_at(model, place, without, effect)

    def forms(self) -> tuple[Form, ...]:
        """All tables of the library; none beside one that the machine has."""
        if any(effect.name in TABLES for effect in self.machine.effects):
            return ()
        fastest = max(e.operating_point.motor_speed for e in self.model.experiments)
        size = measures(self.machine, fastest)
        top, bent = 1.1 * size["speed"], 1.5 * size["deflection"]
        swung = bent * math.sqrt(self.machine.output_joint.stiffness / self.machine.table_inertia)
        ends = {"speed": (-0.1 * top, top), "deflection": (-bent, bent), "rate": (-swung, swung)}
        return tuple(_form(name, ends, size) for name in TABLES)

    def shop(self, name: str, values: Sequence[float]) -> str:
        return in_the_shop(name, values, self.machine)

    def part(self, effect: str) -> str:
        return _PARTS[EFFECTS[effect].enters]


_VARIABLES = {
    "speed": "speed of the table [rad/s]", "angle": "angle of the table [rad]", "cam": "angle of the cam [rad]",
    "deflection": "deflection of the output joint [rad]", "rate": "rate of that deflection [rad/s]",
}  # fmt: skip
"""What tables are over."""

_WIDE = 3.0
"""Spread of a table's values before the records are looked at, over the torque of the motion, or over what that bends
the output joint by: places that no record passes stay at nothing."""


def _form(name: str, reached: Mapping[str, tuple[float, float]], size: Mapping[str, float]) -> Form:
    table = TABLES[name]
    scale, unit = (size["deflection"], "rad") if table.moves else (size["torque"], "N m")
    fixed: dict[str, float] = {}
    for variable, ends in zip(table.over, ENDS, strict=False):
        fixed |= dict(zip(ends, reached.get(variable, ()), strict=False))
    rules = {field.name: field.metadata for field in dataclasses.fields(table)}
    bounds = {end: rules[table.grid[0]][end] for end in ("low", "high") if rules[table.grid[0]][end] is not None}
    parameters = tuple(
        Parameter(f"{name}.{value}", unit, 0.0, _WIDE * scale, known=True, **bounds) for value in table.grid
    )
    axes = table(**dict.fromkeys(table.grid, 0.0), **fixed).axes
    over = " and ".join(_VARIABLES[variable] for variable in table.over)
    told = f"{over}, as an error of the cam's motion" if table.moves else over
    return Form(told, table.over, Hypothesis(name, parameters, fixed, shaped(axes, scale)), axes)


def _time_axis(time: np.ndarray, inside: np.ndarray) -> Axis:
    edges = np.linspace(float(time[inside].min()), float(time[inside].max()), TIMES + 1)
    return Axis("time", told_apart(edges[:-1].tolist(), "s"), binned(time, edges, inside))
