"""n machines with hidden faults, measured together: the core of both diagnosis environments.

An item's numbers do not depend on its fleet; a fleet of one is the single environment.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from gymnasium.spaces import Box, Discrete

from indexer_env.build import check_keywords
from indexer_env.checks import check_choice
from indexer_env.diagnosis import BANDS, Case, Measurement, check_bench, check_hypotheses, draw_case, measure
from indexer_env.diagnosis_task import DiagnosisTask, Setting, task_from_mapping
from indexer_env.errors import ParameterError, refuse
from indexer_env.faults import Faults
from indexer_env.machine import Machine
from indexer_env.operating_point import OperatingPoint
from indexer_env.presets import load_machine, load_operating_point, load_sensor, load_yaml
from indexer_env.scenario import loaded
from indexer_env.sensors import Sensor

_ARGUMENTS = ("machine", "operating_point", "sensor", "task", "reveal", "render_mode")
"""What an environment takes besides the fields of `DiagnosisTask`."""


class Turn(NamedTuple):
    """What a step of n items gives, in fresh arrays: observations (n, k) float32, rewards (n,), terminated (n,) bool,
    and what was measured, for the items that measured (None for the others)."""

    observations: np.ndarray
    rewards: np.ndarray
    terminated: np.ndarray
    measured: list[Measurement | None]


class DiagnosisFleet:
    """n machines, started one by one and stepped together.

    Parameters
    ----------
    n : int
    machine, operating_point, sensor, task
        As `IndexerDiagnosisEnv` takes them.
    changes : mapping
        Fields of the task that differ.
    others : sequence of str
        What the environment takes besides the arguments of the single one, for the hint to a misspelled name.
    """

    def __init__(
        self,
        n: int,
        machine: object,
        operating_point: object,
        sensor: object,
        task: object,
        changes: Mapping[str, Any],
        others: Sequence[str] = (),
    ) -> None:
        owner = "IndexerDiagnosisEnv"
        check_keywords(owner, changes, (*_ARGUMENTS, *others), DiagnosisTask)
        self.machine: Machine = loaded(owner, "machine", machine, Machine, load_machine)
        self.operating_point: OperatingPoint = loaded(
            owner, "operating_point", operating_point, OperatingPoint, load_operating_point
        )
        self.sensor: Sensor = loaded(owner, "sensor", sensor, Sensor, load_sensor)
        self.task = _task(task, changes)
        check_bench(self.task, self.machine, self.operating_point, self.sensor)
        check_hypotheses(self.task, self.machine)
        self.settings, self.names = self.task.settings, self.task.names
        self.costs = self.task.costs(self.machine, self.operating_point)
        self.left = np.zeros(n)
        self._cases: list[Case | None] = [None] * n
        self._observations = np.zeros((n, BANDS + len(self.settings) + 1), dtype=np.float32)

    def spaces(self) -> tuple[Discrete, Box]:
        """Action and observation space of one machine."""
        return Discrete(len(self.settings) + len(self.names)), Box(-1.0, 1.0, self._observations.shape[1:])

    @property
    def observations(self) -> np.ndarray:
        """Observations (n, k) float32 of the present, a new array."""
        return self._observations.copy()

    @property
    def _pays(self) -> np.ndarray:
        """What a turn may cost (n,): what is left, and what the subtractions before may have rounded off it."""
        return self.left + 1e-9 * self.task.budget

    @property
    def action_masks(self) -> np.ndarray:
        """1 where an action is a name or a turn that the budget still pays, (n, actions) int8."""
        affordable = self.costs <= self._pays[:, np.newaxis]
        return np.concatenate([affordable, np.ones((len(affordable), len(self.names)))], axis=1).astype(np.int8)

    def truths(self) -> dict[str, np.ndarray]:
        """What no bench shows (n,): the name's place and the faults; the station is -1 where none is cracked.

        An item that was not started has the place -1 and no faults.
        """
        faults = [Faults() if case is None else case.faults for case in self._cases]
        return {
            "hypothesis": np.array([-1 if case is None else case.name for case in self._cases]),
            "roller_crack": np.array([fault.roller_crack for fault in faults]),
            "cracked_station": np.array([
                -1 if fault.cracked_station is None else fault.cracked_station for fault in faults
            ]),
            "screw_looseness": np.array([fault.screw_looseness for fault in faults]),
            "backlash": np.array([fault.backlash for fault in faults]),
        }  # fmt: skip

    def start(self, i: int, rng: np.random.Generator, name: int | None) -> None:
        """Draw what item i suffers from, of the hypothesis at a place unless that is to be drawn too.

        Raises
        ------
        ParameterError
            Faults that the machine cannot have; the item is then as it was.
        """
        self._cases[i] = draw_case(self.task, self.machine, rng, name)
        self.left[i] = self.task.budget
        self._observations[i] = 0.0
        self._observations[i, :BANDS] = -1.0
        self._observations[i, -1] = 1.0

    def step(self, actions: np.ndarray, live: np.ndarray, rngs: Sequence[np.random.Generator]) -> Turn:
        """Measure or name, as the checked actions (n,) say; of items that are not `live` (n,) bool nothing changes, and
        what the turn holds of them means nothing.

        Raises
        ------
        SimulationError
            A machine leaves the model's range at its setting; no item has measured or named then.
        """
        n, turns = len(actions), len(self.settings)
        settings = np.minimum(actions, turns - 1)
        measures = live & (actions < turns) & (self.costs[settings] <= self._pays)
        rows = np.flatnonzero(measures).tolist()
        cases = [case for i in rows if (case := self._cases[i]) is not None]
        chosen = [self.settings[settings[i]] for i in rows]
        found = measure(cases, chosen, self.operating_point, self.sensor, [rngs[i] for i in rows], numbers=rows)
        self.left[measures] = np.maximum(self.left[measures] - self.costs[settings[measures]], 0.0)
        measured: list[Measurement | None] = [None] * n
        for i, measurement in zip(rows, found, strict=True):
            measured[i] = measurement
            self._observations[i, :BANDS] = measurement.levels
            self._observations[i, BANDS:-1] = 0.0
            self._observations[i, BANDS + settings[i]] = 1.0
            self._observations[i, -1] = self.left[i] / self.task.budget
        names = np.array([-1 if case is None else case.name for case in self._cases])
        named = np.where(actions - turns == names, self.task.right, -self.task.wrong)
        rewards = np.where(measures, -self.costs[settings], named)
        return Turn(self._observations.copy(), rewards, live & ~measures, measured)

    def hypothesis(self, options: Mapping[str, Any] | None) -> int | None:
        """Place of the hypothesis that `reset` is asked for, None where it is to be drawn; raises ParameterError."""
        owner = "IndexerDiagnosisEnv.reset"
        if options and not isinstance(options, Mapping):
            raise refuse(owner, "options", "a mapping", options)
        for key in options or {}:
            if key != "hypothesis":
                raise ParameterError(f"{owner} has no option {key!r}; its only one is 'hypothesis'.")
        if not options:
            return None
        check_choice(owner, "hypothesis", options["hypothesis"], self.names)
        return self.names.index(options["hypothesis"])


def _task(given: object, changes: Mapping[str, Any]) -> DiagnosisTask:
    if isinstance(given, DiagnosisTask):
        given = {key: getattr(given, key) for key in DiagnosisTask.__dataclass_fields__}
    elif isinstance(given, str | Path):
        given = load_yaml("diagnosis", given)
    if not isinstance(given, Mapping):
        rule = "a DiagnosisTask, a mapping of its fields or the name of a preset"
        raise refuse("IndexerDiagnosisEnv", "task", rule, given)
    return task_from_mapping({**given, **changes})


class FleetView:
    """What the environments of one machine and of many show of their fleet."""

    _fleet: DiagnosisFleet

    @property
    def machine(self) -> Machine:
        """The machine around which an episode's own is drawn."""
        return self._fleet.machine

    @property
    def operating_point(self) -> OperatingPoint:
        """Nominal motor speed and load torque."""
        return self._fleet.operating_point

    @property
    def sensor(self) -> Sensor:
        """The chain through which the acceleration is read."""
        return self._fleet.sensor

    @property
    def task(self) -> DiagnosisTask:
        """What may be measured and named, and what it costs."""
        return self._fleet.task

    @property
    def settings(self) -> tuple[Setting, ...]:
        """The settings of the measuring actions, which come first."""
        return self._fleet.settings

    @property
    def names(self) -> tuple[str, ...]:
        """The names of the naming actions, which come after them."""
        return self._fleet.names

    @property
    def costs(self) -> np.ndarray:
        """What a turn at each setting costs (k,) [reward]."""
        return self._fleet.costs
