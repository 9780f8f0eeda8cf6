"""Whether machine.yaml is better than the nominal machine: on a record at conditions of its own that no method gets,
and at those of the records held out.

The gap is what a machine leaves of that record's true reading, without noise: rms over the noise, cam turn by cam
turn, each piece resumed from the true state, and what another start state would explain taken off. A method's own
held-out gap is not used: it may be measured on records whose conditions are misstated, by its own idea of the noise.
"""

from __future__ import annotations

import dataclasses
import math

import numpy as np

from indexer_env.errors import ParameterError, SimulationError
from indexer_env.machine import Machine
from indexer_env.sensors import Sensor
from indexer_experiments.challenge.messy.draw import RecordDraw
from indexer_experiments.challenge.messy.pieces import RATE, coarse_run, coarsely_resumed, local_basis
from indexer_experiments.challenge.messy.sizes import MessyCase, read_of
from indexer_experiments.challenge.running import read_running
from indexer_experiments.challenge.truth import turn_samples

TURNS = 1.2
"""Table turns of the record."""


class Judge:
    """A record of a case, and what machines leave of it."""

    def __init__(self, case: MessyCase, record: RecordDraw) -> None:
        record = dataclasses.replace(record, turns=TURNS, drift=0.0)
        self._point, self._noise = record.point, case.noise
        lead = turn_samples(case.machine, record.point, RATE)
        samples = record.samples(case.machine, RATE)
        whole = coarse_run(case.machine, record.point, samples, case.unlisted(record), lead)
        motion = whole[:, lead:]
        reading = read_of(motion, case.readers(), _without_hum(case.sensor), before=whole[:, :lead])
        starts = np.flatnonzero(np.diff(np.floor(motion[1] / (2.0 * math.pi))) > 0.0) + 1
        self._before = whole[0, starts[0] : starts[0] + lead]
        self._states = [motion[1:, first] for first in starts[:-1]]
        self._counts = np.diff(starts).tolist()
        self._reading = reading[starts[0] : starts[-1]]

    def gap(self, machine: Machine, sensor: Sensor) -> float:
        """What a machine and sensor leave, over the noise; infinite for a machine that cannot run."""
        try:
            pieces = [
                coarsely_resumed(machine, self._point, state, n)
                for state, n in zip(self._states, self._counts, strict=True)
            ]
            read = read_running(_without_hum(sensor), np.concatenate(pieces), self._before, RATE)
            difference = read - self._reading
            left, at = [], 0
            for state, n in zip(self._states, self._counts, strict=True):
                base, d = local_basis(machine, self._point, state, n), difference[at : at + n]
                left.append(d - base @ (base.T @ d))
                at += n
        except (ParameterError, SimulationError):
            return math.inf
        return float(np.sqrt(np.mean(np.concatenate(left) ** 2))) / self._noise


def _without_hum(sensor: Sensor) -> Sensor:
    """Its phase is that of the record alone."""
    return dataclasses.replace(sensor, hum_amplitude=0.0)
