"""A trained classifier, one for each speed, as the one who diagnoses."""

from __future__ import annotations

import dataclasses
import hashlib
from collections.abc import Mapping, Sequence

import numpy as np

from classifier.diagnose.diagnosis import diagnose_turn
from classifier.model import Model
from classifier.tasks.severity import Severity
from indexer_env.errors import refuse
from indexer_env.signal import Signal
from indexer_env.units import RPM
from indexer_records.conditions import RecordConditions
from indexer_records.stream import StreamedTurn
from monitor.analysis.finding import Finding, Size
from monitor.intake.cutter import Mode

_SHOWN_BANDS = 5


class ClassifierDiagnoser:
    """Diagnoses by classifiers that were trained at one speed each.

    Parameters
    ----------
    models : sequence of Model
        Each of one channel, with the part `severity`.

    Raises
    ------
    ParameterError
        No model, one without sizes of faults, one of several channels, or two of one speed.
    """

    def __init__(self, models: Sequence[Model]) -> None:
        if not models:
            raise refuse("monitor", "model", "one folder at least", None)
        self._models: dict[str, Model] = {}
        self.units: Mapping[str, str] = {}
        modes, quantities = [], []
        for model in models:
            part = next((part for part in model.parts if isinstance(part, Severity)), None)
            if part is None:
                remedy = "train it on data that state the size of each fault, with the part severity"
                raise refuse("monitor", "model", "a model that tells sizes of faults", "one without severity", remedy)
            if model.channels != 1:
                raise refuse("monitor", "model", "a model of one channel", model.channels)
            mode = mode_of(model)
            if mode.name in self._models:
                raise refuse("monitor", "model", "models of different speeds", mode.name, "leave one out")
            self._models[mode.name] = model
            modes.append(mode)
            quantities += [name for name in part.names if name not in quantities]
        self.modes, self.quantities = tuple(modes), tuple(quantities)
        self.origins: Mapping[str, str] = {name: _origin(model) for name, model in self._models.items()}

    @property
    def needs_radius(self) -> bool:
        """Whether turns can be compared only where the radius of the accelerometer is known."""
        return any(model.conditions.sensor_radius is not None for model in self._models.values())

    @property
    def stations(self) -> int | None:
        """Of the tables whose records were taught, each one turn; None: they show no indexing, or are not alike."""
        shown = [model.conditions.stations for model in self._models.values()]
        counts = {None if one is None else round(sum(one) / 2.0) for one in shown}
        return counts.pop() if len(counts) == 1 else None

    def flaw(self, mode: Mode, turn: StreamedTurn) -> tuple[str, str] | None:
        """The state that keeps a turn from being diagnosed, and a sentence; None: sound."""
        if turn.record is None:
            sensor = "finite" in turn.problem or "float32" in turn.problem
            return ("dead" if sensor else "other_speed"), f"a turn {turn.problem}"
        conditions = self._models[mode.name].conditions
        shares = turn.clipped_share, turn.constant_share
        if state := conditions.sensor_state(*shares):
            return state, f"a turn {conditions.flaw(*shares)}"
        problem = conditions.indexing_flaw(turn.record)
        if not problem:
            return None
        state = "swapped" if "sign is reversed" in problem else "other_speed" if "within" in problem else "no_indexing"
        return state, f"a turn {problem}"

    def diagnose_turn(
        self, signal: Signal, conditions: RecordConditions, start_angle: float | None = None
    ) -> Finding:  # fmt: skip
        """What a turn shows to the model of its speed.

        Raises
        ------
        SignalError
            Conditions that the model was not trained for.
        """
        mode = next(mode for mode in self.modes if _has(mode, signal, conditions))
        model = self._models[mode.name]
        # The turn was stretched to the length that the model was taught, so it is one at the taught speed.
        taught = dataclasses.replace(conditions, motor_speed=mode.motor_speed)
        model.conditions.check(taught, signal.source or "the turn")
        record = signal.values.astype(np.float32)
        told = diagnose_turn(model, record)
        ends = {
            name: [float(told.assessment[f"{name}{end}"]) for end in ("", "_low", "_high")]
            for name in self.quantities
            if name in told.assessment
        }
        # what is like nothing that was taught has any size or none
        sizes = {n: Size(value, 0.0 if told.is_novel else low, high) for n, (value, low, high) in ends.items()}
        spoke = sorted(told.bands, key=lambda band: -abs(band.contribution))[:_SHOWN_BANDS]
        return Finding(
            verdict=told.verdict,
            healthy=not told.is_novel and set(told.code) == {"0"},
            probability=None if told.is_novel else told.assessment.get("probability"),
            sizes=sizes,
            novelty=_novelty(told.assessment),
            level=float(np.sqrt(np.mean(np.square(signal.values - signal.values.mean())))),
            more={
                "nearest": told.class_name,
                "second": told.second_name,
                "margin": told.margin,
                "bands": [[band.low_hz, band.high_hz, band.contribution] for band in spoke],
            },
        )


def _origin(model: Model) -> str:
    """A checksum of the network and of what tells sizes by it."""
    arrays = [model.parameters, model.mean_features, *(a for part in model.parts for a in part.arrays().values())]
    return hashlib.sha256(b"".join(np.ascontiguousarray(array).tobytes() for array in arrays)).hexdigest()


def mode_of(model: Model) -> Mode:
    """The operating mode that a model was trained for."""
    span = model.conditions.motor_speed
    speed = None if span is None else 0.5 * (span[0] + span[1])
    duration = model.samples / model.sample_rate
    name = f"{duration:.4g} s a turn" if speed is None else f"{speed / RPM:.4g} rpm"
    return Mode(name, model.sample_rate, duration, model.unit, speed)


def _has(mode: Mode, signal: Signal, conditions: RecordConditions) -> bool:
    fits = mode.unit == signal.unit and round(mode.duration * mode.rate) == signal.values.size
    return fits and mode.rate == signal.sample_rate


def _novelty(assessment: dict) -> float | None:
    known = [float(assessment[name]) for name in ("novelty", "range") if name in assessment]
    return max(known) if known else None
