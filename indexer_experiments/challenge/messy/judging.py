"""Whether machine.yaml is better than the nominal machine: on a record at conditions of its own that no method gets,
and at those of the records held out.

The gap is what a machine leaves of that record's true reading, without noise: rms over the noise, cam turn by cam turn,
each resumed in the state of the true machine's joints, once the record's load, drive angle and speed, within what is
known of them, and the start states are fitted (`leftover`). A record's load is stated up to 10 % wrong, and no record
shows that all inertias, stiffnesses and loads are 5 % too large. A method's own held-out gap is not used: it may be
measured by its own idea of the noise.
"""

from __future__ import annotations

import dataclasses
import math

from indexer_env.errors import ParameterError, SimulationError
from indexer_env.machine import Machine
from indexer_env.sensors import Sensor
from indexer_experiments.challenge.messy.draw import RecordDraw
from indexer_experiments.challenge.messy.leftover import Fit
from indexer_experiments.challenge.messy.pieces import RATE, coarse_run
from indexer_experiments.challenge.messy.sizes import MessyCase, read_of
from indexer_experiments.challenge.truth import turn_samples

TURNS = 1.2
"""Table turns of the record."""


class Judge:
    """A record of a case, and what machines leave of it."""

    def __init__(self, case: MessyCase, record: RecordDraw) -> None:
        record = dataclasses.replace(record, turns=TURNS, drift=0.0)
        self._point, self._noise, self._machine = record.point, case.noise, case.machine
        self._unlisted = case.unlisted(record)
        lead = turn_samples(case.machine, record.point, RATE)
        samples = record.samples(case.machine, RATE)
        whole = coarse_run(case.machine, record.point, samples, self._unlisted, lead)
        self._before, self._motion = whole[:, :lead], whole[:, lead:]
        self._reading = read_of(self._motion, case.readers(record), _without_hum(case.sensor), before=self._before)

    def gap(self, machine: Machine, sensor: Sensor) -> float:
        """What a machine and sensor leave, over the noise; infinite for a machine that cannot run."""
        try:
            fit = Fit(machine, [self._point], [self._motion], self._noise, _without_hum(sensor), held=True)
            return fit.reached([self._reading], [self._motion], self._machine, [self._unlisted], [self._before])
        except (ParameterError, SimulationError):
            return math.inf


def _without_hum(sensor: Sensor) -> Sensor:
    """Its phase is that of the record alone."""
    return dataclasses.replace(sensor, hum_amplitude=0.0)
