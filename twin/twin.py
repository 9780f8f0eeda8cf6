"""A twin as it lies in its folder: load it, ask it of a turn, ask physics."""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import nn

from discrepancy.records.conditions import Conditions
from discrepancy.records.reading import Record
from indexer_env.errors import SignalError
from indexer_env.machine import Machine
from indexer_env.operating_point import OperatingPoint
from indexer_env.sensors import Sensor
from indexer_env.signal import Signal
from twin import physics
from twin.corrected import BY_COMPARISON, corrected
from twin.detection import Seen, worst
from twin.diagnosis import NOT_COMPARABLE, FaultSeen, TurnDiagnosis, said_of
from twin.faults import Fault, share_of
from twin.folder import (
    about_of,
    faults_of,
    machine_and_sensor,
    networks_of,
    reading,
    stored_remains,
    synthesis_of,
    view_of,
)
from twin.gate import Gate
from twin.judge import NAMED, Judge, ensemble, sigmoid
from twin.learn import View
from twin.nuisance import draws_in
from twin.refine import fitted
from twin.synthesis import Synthesis
from twin.turns import Cells, Healthy
from twin.weigh import IMPOSSIBLE, Weights, spread

_LOUDER = 1.2
"""Noise over that of the healthy records from which on networks see it as a change of the machine."""


@dataclass(frozen=True, eq=False)
class _Estimate:
    """Of one turn: logit, size and its standard deviation of each fault, what to multiply that by (faults, 2), and how
    strange the turn is."""

    logits: np.ndarray
    size: np.ndarray
    spread: np.ndarray
    reach: np.ndarray
    strange: float


@dataclass(frozen=True, eq=False)
class Twin:
    """A loaded twin.

    Attributes
    ----------
    folder : Path
    about : mapping
        All of twin.yaml.
    machine, sensor : Machine, Sensor
        Healthy, at the posterior's mean.
    view : View
    networks : tuple of Module
    judge : Judge
    healthy : Healthy
    synthesis : Synthesis or None
        By which what the networks estimate is simulated and refined; None: the networks alone.
    weights : Weights or None
        What that is worth.
    """

    folder: Path
    about: Mapping[str, Any]
    machine: Machine
    sensor: Sensor
    view: View
    networks: tuple[nn.Module, ...]
    judge: Judge
    healthy: Healthy
    synthesis: Synthesis | None = None
    weights: Weights | None = None

    @classmethod
    def load(cls, folder: str | Path) -> Twin:
        """The twin of a folder.

        Raises
        ------
        ParameterError
            No folder of a finished twin, one of another version, or a damaged one.
        """
        folder = Path(folder)
        about = about_of(folder)
        machine, sensor = machine_and_sensor(folder)
        remains = stored_remains(folder)
        with reading(folder / "twin.yaml"):
            cells = Cells(**about["cells"])
            faults = faults_of(about, machine, sensor)
            view = view_of(about, remains)
            healthy = Healthy(machine, sensor, cells, float(about["load_factor"]))
            judge, weights = Judge.restore(about["judge"]), Weights.restore(about["weights"])
        networks = networks_of(folder, about["networks"], len(faults), cells)
        synthesis = synthesis_of(folder, faults, healthy, view)
        return cls(folder, about, machine, sensor, view, networks, judge, healthy, synthesis, weights)

    @functools.cached_property
    def gate(self) -> Gate:
        """What a record must be to be compared."""
        return Gate(self.healthy, self.view)

    @functools.cached_property
    def faults(self) -> tuple[Fault, ...]:
        """The fault table."""
        return faults_of(self.about, self.machine, self.sensor)

    @functools.cached_property
    def draws(self) -> Mapping[str, np.ndarray]:
        """Joint draws (n,) of the posterior, by path."""
        with reading(self.folder / "posterior.parquet"):
            return draws_in(self.folder / "posterior.parquet")

    @functools.cached_property
    def seen(self) -> tuple[Seen, ...]:
        """Smallest sizes that are seen."""
        return tuple(Seen(**row) for row in self.about["detection"])

    @functools.cached_property
    def matters(self) -> Mapping[str, float]:
        """Smallest size of each fault that a headline names, as share of the largest."""
        given = self.about["settings"]["matters"] or {}
        sizes = {}
        for fault in self.faults:
            sizes[fault.name] = worst(self.seen, fault.name)
            if fault.name in given:
                sizes[fault.name] = share_of(fault, float(given[fault.name]), self.machine)
        return sizes

    def diagnose_turn(
        self, signal: Signal, conditions: Conditions, pulses: Sequence[float] | np.ndarray | None = None
    ) -> TurnDiagnosis:
        """What the networks say of a record of one turn of the table or more, refined by simulation where they raise an
        alarm; milliseconds, with an alarm some tenths of a second.

        Parameters
        ----------
        signal : Signal
            Table acceleration in the twin's unit at its sampling rate.
        conditions : Conditions
            Motor speed and load, the cam angle of the first sample where it is known. A speed up to 2 % off is put
            right by the record.
        pulses : sequence of float, optional
            Times of the once-per-turn pulse after the first sample [s].
        """
        signal, conditions, notes = self._at_own_radius(signal, conditions)
        try:
            x, record = self.gate.looked(signal, conditions, pulses)
        except SignalError as error:
            return TurnDiagnosis(NOT_COMPARABLE, (), {}, {}, 0.0, 0.0, str(error))
        judged = self.judged(x, record.point, record.stations_known)
        return dataclasses.replace(judged, notes=(*notes, *record.notes, *self._louder(signal, record.conditions)))

    def _louder(self, signal: Signal, told: Conditions) -> tuple[str, ...]:
        """What is to be said where a record is stated to be noisier than the networks know."""
        times = 0.0 if told.noise is None else told.noise / float(self.about["sample_noise"])
        if times <= _LOUDER:
            return ()
        name, much = signal.source or "the record", f"{times:.2g} times the noise of the twin's healthy records"
        return (f"{name}: {much} is stated, and the networks know no other than theirs: go by physics",)

    def _at_own_radius(self, signal: Signal, told: Conditions) -> tuple[Signal, Conditions, tuple[str, ...]]:
        """A record taken at another radius as the twin's sensor would read it, and what is to be said of it."""
        radius, own = told.sensor_radius, self.sensor.radius
        if radius is None or own is None or radius == own:
            return signal, told, ()
        name, factor = signal.source or "the record", own / radius
        said = f"{name} was taken at a radius of {radius:g} m and is compared as at the twin's {own:g} m"
        noise = None if told.noise is None else factor * told.noise
        told = dataclasses.replace(told, sensor_radius=own, noise=noise)
        return dataclasses.replace(signal, values=factor * signal.values), told, (said,)

    def judged(self, x: np.ndarray, point: OperatingPoint, stations_known: bool) -> TurnDiagnosis:
        """The verdict on turns x (k, stations, cells) of one operating point, together."""
        conditions = torch.from_numpy(self.view.conditions([point] * len(x)))
        told = ensemble(self.networks, torch.from_numpy(x.astype(np.float32)), conditions)
        told = {name: value.mean(axis=0)[None] for name, value in told.items()}
        alarm = float(told["any"][0]) - self.judge.alarm
        estimate = self._estimate(x.mean(axis=0)[None], point, told, stations_known, alarm=alarm > 0.0)
        strange, chance = estimate.strange, sigmoid(estimate.logits)
        reach = estimate.spread * estimate.reach[:, int((chance >= NAMED).sum() > 1)]
        sizes, each = {}, []
        for k, fault in enumerate(self.faults):
            share = float(estimate.size[k])
            ends = [fault.possible(value) for value in (share, share - float(reach[k]), share + float(reach[k]))]
            shop = [fault.told(value, self.machine) for value in ends]
            size, low, high = shop[0], min(shop[1:]), max(shop[1:])
            sizes[fault.name] = size, low, high
            single = fault.name == "crack_single" and "station" in told and stations_known
            station = int(np.argmax(told["station"][0])) if single else None
            each.append(FaultSeen(
                fault.name, float(chance[k]), size, low, high, fault.unit, ends[0],
                abs(ends[0]) >= self.matters[fault.name], station,
            ))  # fmt: skip
        likeliest = sorted(each, key=lambda one: -one.probability)
        likely = [one for one in likeliest if one.probability >= NAMED]
        verdict, faults, reason = said_of(alarm, strange, likely, likeliest[0])
        possible = [one for one, logit in zip(each, estimate.logits, strict=True) if alarm > 0.0 and logit > IMPOSSIBLE]
        probabilities = {fault.name: float(p) for fault, p in zip(self.faults, chance, strict=True)}
        unnamed = tuple(one for one in possible if one not in faults)
        return TurnDiagnosis(verdict, faults, probabilities, sizes, alarm, strange, reason, unnamed=unnamed)

    def _estimate(
        self, x: np.ndarray, point: OperatingPoint, told: Mapping[str, np.ndarray], stations_known: bool, *, alarm: bool
    ) -> _Estimate:
        """Of one turn x (1, stations, cells): by simulation where there is an alarm to look into, else by networks."""
        networks = _Estimate(told["faults"][0], told["size"][0], np.exp(told["spread"][0]), self.judge.reach, 0.0)
        if self.synthesis is None or self.weights is None:
            return networks
        synthesis = self.synthesis if stations_known else self.synthesis.of_mean()
        if not alarm:
            strange = self.weights.oddness(synthesis.unexplained(x), stations_known=stations_known)
            return dataclasses.replace(networks, strange=float(strange[0]))
        fits = fitted(synthesis, x, [point], told)
        strange = float(self.weights.strangeness(fits)[0])
        logits = self.weights.logits(fits)[0]
        # no fit tried a fault that is not possible, so that the networks alone have a size of it
        tried = np.isfinite(fits.error[0])
        size, wide = np.where(tried, fits.size[0], networks.size), np.where(tried, spread(fits)[0], networks.spread)
        reach = np.where(tried[:, None], self.weights.reach, networks.reach)
        return _Estimate(logits, size, wide, reach, strange)

    def explain(
        self,
        turns: Sequence[tuple[Signal, Conditions] | tuple[Signal, Conditions, Sequence[float] | np.ndarray | None]],
        suspected: Sequence[FaultSeen] = (),
    ) -> physics.Physics:  # fmt: skip
        """What physics says of records together, with the times of their pulses where they have any: faults as
        hypotheses from the twin's machine; those that the networks think possible, `suspected`, are measured where it
        does not find them. Seconds.

        Raises
        ------
        SignalError
            Records that are not comparable, or too few cam turns in all.
        """
        records, stations_known = [], True
        for number, (signal, told, *pulses) in enumerate(turns):
            name = signal.source or f"turn {number + 1}"
            signal, told, _ = self._at_own_radius(signal, told)
            right = corrected(name, signal, told, pulses[0] if pulses else None, self.healthy, self.view.remains)
            told, stations_known = right.conditions, stations_known and right.stations_known
            spread = told.start_uncertainty if right.stations_known else BY_COMPARISON
            noise = self.about["sample_noise"] if told.noise is None else told.noise
            signal = self._without_remains(right.signal, told)
            load = self.healthy.load_factor * told.load_torque
            told = dataclasses.replace(told, start_uncertainty=spread, noise=noise, load_torque=load)
            records.append(Record(name, signal, told))
        given = physics.checked(records, self.machine, self.sensor)
        found = self.about["calibration"]["findings"]
        known = self.machine, self.sensor, found, self.draws, self.healthy.load_factor, self.faults
        said = physics.explained(given, *known, suspected if stations_known else [_anywhere(one) for one in suspected])
        return said if stations_known else said.without_stations()

    def _without_remains(self, signal: Signal, told: Conditions) -> Signal:
        """A record without what healthy records leave there, which no effect of the library explains."""
        assert told.start_angle is not None, "found by comparison where it was not stated"
        left = self.view.remains.at(OperatingPoint(told.motor_speed, told.load_torque))
        step = self.machine.reduction * told.motor_speed / signal.sample_rate
        angle = told.start_angle + step * np.arange(len(signal.values))
        return dataclasses.replace(signal, values=signal.values - self.healthy.cells.along(left, angle))


def _anywhere(seen: FaultSeen) -> FaultSeen:
    """A fault without its station, which the networks count from another one than physics does."""
    return dataclasses.replace(seen, station=None)
