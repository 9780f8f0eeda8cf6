"""The measured drive as a subject: its force by position, direction, speed and acceleration."""

from __future__ import annotations

import itertools
from collections.abc import Mapping
from typing import Any

import numpy as np

from discrepancy.emps import DECIMATION, MARGIN, EmpsModel, Motion, load_emps, thinned
from discrepancy.model import Hypothesis, Model, in_turn
from discrepancy.problem import Point
from discrepancy.subjects.base import Axis, Measurement, Subject, View, binned
from indexer_cli.job_paths import path_given
from indexer_env.errors import SignalError, refuse

_KEYS = ("system", "measured", "out", "overwrite", "seed")
"""Keys of conf/explain.yaml that this model takes; the others belong to the indexing machine."""

MEANINGS = {
    "friction.viscous": "Drag grows in proportion to the slide's speed.",
    "friction.coulomb": "Dry friction opposes the motion with a constant force.",
    "friction.asymmetric": "Dry friction is larger in one direction than in the other.",
    "friction.stribeck": "Dry friction is larger at low speed.",
    "offset": "A constant force acts, as of a tilted rail or an amplifier's offset.",
    "elastic_coupling": "Half of the mass hangs on a spring.",
    "delay": "The force comes later than it is asked for.",
    "backlash": "Half of the mass is not felt while the play is crossed.",
    "cogging": "The force wavers with the position.",
}
"""The effects of `emps.EFFECTS`, one sentence each."""

_CELLS = 8
_STANDING = 2.0
"""Standstill added to an imagined motion [s]."""


class EmpsSubject(Subject):
    """The drive, inertia only, with one cycle to fit and one to hold out.

    Parameters
    ----------
    model, held_out : EmpsModel
    """

    kind = "positioning drive (EMPS)"
    model: EmpsModel
    held_out: EmpsModel

    def __init__(self, model: EmpsModel, held_out: EmpsModel) -> None:
        self.model, self.held_out = model, held_out
        self.notes = ("the cycles repeat one motion, so records held out are other times, not other conditions",)

    def view(self, model: Model) -> View:
        assert isinstance(model, EmpsModel)
        motion, counts = model.motion, model.counts
        first = np.concatenate([[0], np.cumsum(counts)[:-1]])
        samples = np.arange(int(counts.max()))
        inside = samples < counts[:, None]
        at = np.where(inside, first[:, None] + samples, 0)
        time = (MARGIN + at) * DECIMATION * motion.step
        columns = {
            "position": (thinned(motion.position), "m"),
            "speed": (np.abs(thinned(motion.rate)), "m/s"),
            "acceleration": (thinned(motion.acceleration), "m/s²"),
        }
        axes = [_direction(thinned(motion.rate)[at], inside)]
        for name, (row, unit) in columns.items():
            edges = np.linspace(row.min(), row.max(), _CELLS + 1)
            labels = tuple(f"{(low + high) / 2.0:.2g} {unit}" for low, high in itertools.pairwise(edges))
            axes.append(Axis(name, labels, binned(row[at], edges, inside)))
        held = "second cycle" if model.motion is self.held_out.motion else "first cycle"
        return View(
            names=(held,), unit="N", groups=np.zeros(len(counts), dtype=np.int64), inside=inside, time=time,
            measured=np.where(inside, thinned(model.force)[at], 0.0), noise=np.array([model.noise]), estimated=(False,),
            axes=tuple(axes), map_axes=("direction", "speed"),
        )  # fmt: skip

    def files(self, model: Model, place: Point) -> Mapping[str, str]:
        import yaml

        assert isinstance(model, EmpsModel)
        parameters = model.parameters + place.hypothesis.parameters
        values = {p.name: float(p.value(z)) for p, z in zip(parameters, place.z, strict=True)}
        machine: dict[str, Any] = {"mass": values.pop("mass"), "effects": {}}
        for name, value in values.items():
            effect, _, field = name.rpartition(".")
            machine["effects"].setdefault(effect, {})[field] = value
        return {"machine.yaml": yaml.safe_dump(machine, sort_keys=False)}

    def meaning(self, effect: str) -> str:
        return MEANINGS[effect]

    def measurements(self, effects: tuple[Hypothesis, ...]) -> tuple[Measurement, ...]:
        found = []
        for words, motion in _motions(self.model.motion):
            zero = np.zeros_like(motion.rate)
            found.append(Measurement(words, in_turn(EmpsModel(motion, zero, self.model.noise), effects)))
        return tuple(found)


def _direction(rate: np.ndarray, inside: np.ndarray) -> Axis:
    return Axis("direction", ("forwards", "backwards"), np.where(inside, (rate < 0.0).astype(int), -1))


def _motions(motion: Motion) -> list[tuple[str, Motion]]:
    """Motions that could be asked of the drive: faster, slower, and with a standstill."""
    found = []
    for factor in (0.25, 0.5, 1.0, 2.0):
        # The path run through at another pace: speed grows with the factor, acceleration with its square.
        faster = Motion(motion.position, factor * motion.rate, factor**2 * motion.acceleration, motion.step / factor)
        found.append((f"the same path at {factor:g} times the speed", faster))
    still = round(_STANDING / motion.step)
    parts = (np.full(still, motion.position[-1]), np.zeros(still), np.zeros(still))
    rows = (motion.position, motion.rate, motion.acceleration)
    position, rate, acceleration = (np.concatenate(pair) for pair in zip(rows, parts, strict=True))
    standing = Motion(position, rate, acceleration, motion.step)
    found.append((f"the same motion with {_STANDING:g} s of standstill under control", standing))
    return found


def emps_subject(config: Mapping[str, Any]) -> EmpsSubject:
    """The subject of a composed conf/explain.yaml with system=emps.

    Raises
    ------
    ParameterError
        A key that is for the indexing machine alone.
    SignalError
        The file is not the EMPS data set.
    """
    import scipy.io

    _refuse_others(config)
    path = path_given("discrepancy", "measured", config["measured"])
    try:
        model, held_out = load_emps(path)
    except (OSError, KeyError, ValueError, IndexError, NotImplementedError, scipy.io.matlab.MatReadError) as error:
        why = f"it has no {error}" if isinstance(error, KeyError) else str(error)
        raise SignalError(f"{path} must be the data set EMPS as published, DATA_EMPS.mat, but {why}.") from None
    return EmpsSubject(model, held_out)


def _refuse_others(config: Mapping[str, Any]) -> None:
    from hydra.core.hydra_config import HydraConfig

    if not HydraConfig.initialized():
        return
    for override in HydraConfig.get().overrides.task:
        key = override.lstrip("+~").partition("=")[0]
        if key.partition(".")[0] not in _KEYS:
            raise refuse("discrepancy", key, "left out with system=emps, which has no such thing", override)
