"""From a machine at an operating point to the plain numbers that the kernels take: the only way in."""

from __future__ import annotations

import functools
import operator
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from indexer_env.checks import did_you_mean
from indexer_env.effects.base import MachineEffect
from indexer_env.errors import ParameterError, refuse
from indexer_env.kernels import layout
from indexer_env.law_table import LawTable, law_table
from indexer_env.machine import Machine
from indexer_env.operating_point import OperatingPoint

_MODELS = {"A": layout.MODEL_A, "B": layout.MODEL_B, "B_on_base": layout.MODEL_B_ON_BASE}

_IN_DWELL = layout.USES_ANY_EFFECT & ~(
    layout.USES_VISCOUS | layout.USES_IMBALANCE | layout.USES_RIPPLE | layout.USES_TRANSMISSION
)
"""Effects with which the dwell has no closed form here: their items take steps in it, too. Of the process torque and
the profile error only those that reach into the dwell."""

_USES = (
    ("viscous", layout.USES_VISCOUS), ("coulomb_torque", layout.USES_COULOMB),
    ("stribeck_torque", layout.USES_STRIBECK), ("imbalance_torque", layout.USES_IMBALANCE),
    ("process_torque", layout.USES_PROCESS), ("slip_compliance", layout.USES_SLIP),
    ("ripple_amplitude", layout.USES_RIPPLE), ("transmission_amplitude", layout.USES_TRANSMISSION),
    ("mesh_depth", layout.USES_MESH), ("bump_height", layout.USES_BUMP), ("tabulated_over_1", layout.USES_TABLE),
)  # fmt: skip
"""Coefficients which, where they are not as in `_OFF`, switch on a feature of the kernels, whoever wrote them."""

_BUMPS = ((layout.USES_PROCESS, "process"), (layout.USES_BUMP, "bump"))
"""Effects that act in a part of the cam turn, and how the names of their numbers begin."""

_NO_EDGE = -1e90
"""rad; edge of a joint that has none. Finite, as must be the cube of a hardening contact where others of a call have
edges."""

_OFF = {
    # sizes of effects that are off, and shapes that only keep a division by zero out of an unused line
    "cubic_2": 0.0, "single_ratio_2": 1.0, "single_station": -1.0, "motor_acceleration": 0.0,
    "coulomb_torque": 0.0, "coulomb_speed": 1.0, "viscous": 0.0,
    "stribeck_torque": 0.0, "stribeck_speed": 1.0, "stribeck_smoothing": 1.0,
    "imbalance_torque": 0.0, "imbalance_phase": 0.0,
    "process_torque": 0.0, "process_centre": 0.0, "process_half_width": 1.0,
    "slip_compliance": 0.0, "ripple_amplitude": 0.0, "ripple_order": 1.0, "ripple_phase": 0.0,
    "transmission_amplitude": 0.0, "transmission_order": 1.0, "transmission_phase": 0.0,
    "mesh_depth": 0.0, "mesh_order": 1.0, "mesh_phase": 0.0, "mesh_friction": 0.0,
    "bump_height": 0.0, "bump_centre": 0.0, "bump_half_width": 1.0,
    "spacing_error": 0.0, "spacing_station": -1.0,
    "tabulated_over_1": -1.0, "tabulated_over_2": -1.0, "tabulated_moves": 0.0,
    "tabulated_first_1": 0.0, "tabulated_per_1": 0.0, "tabulated_count_1": 4.0, "tabulated_closed_1": 0.0,
    "tabulated_first_2": 0.0, "tabulated_per_2": 0.0, "tabulated_count_2": 4.0, "tabulated_closed_2": 0.0,
    "tabulated_stride": 0.0, **{f"tabulated_{k}": 0.0 for k in range(layout.LARGEST_TABLE)},
}  # fmt: skip


_JOINTS = tuple(tuple(f"{what}_{n}" for what in ("stiffness", "damping", "backlash", "ratio")) for n in (1, 2, 3))
"""Names of a joint's numbers."""

NUMBER_OF = {
    **{f"{part}_inertia": f"{part}_inertia" for part in ("cam", "follower", "table", "housing", "motor")},
    **{
        f"{joint}_joint.{field}": f"{field}_{n}"
        for n, joint in enumerate(("input", "output", "base"), start=1)
        for field in ("stiffness", "damping", "backlash")
    },
}
"""Name among `numbers_of` of attributes of a machine, ``joint.field`` or ``field``."""

_IN_ORDER = operator.itemgetter(*layout.COEFFICIENT_NAMES)

PLACES = {name: place for place, name in enumerate(layout.COEFFICIENT_NAMES)}
"""Place of each coefficient in a row, by its name."""


@dataclass(frozen=True, eq=False)
class Coefficients:
    """One machine at one operating point, as the kernels take it.

    Attributes
    ----------
    model, features : int
        The kernels' model and feature bits (kernels/layout.py).
    row : ndarray (COEFFICIENT_ROWS,)
        In the order of layout.COEFFICIENT_NAMES; the law's place in a table of pieces is filled in by `pack`.
    law : LawTable
    """

    model: int
    features: int
    row: np.ndarray
    law: LawTable

    def __getitem__(self, name: str) -> float:
        """A coefficient by its name."""
        return float(self.row[PLACES[name]])


def coefficients(machine: Machine, operating_point: OperatingPoint) -> Coefficients:
    """The coefficients of a machine at an operating point.

    Raises
    ------
    ParameterError
        An effect that does not fit the machine (a station it has not, a loose base under Model A).
    """
    numbers = numbers_of(machine) | {"load_torque": operating_point.load_torque}
    return coefficients_with(machine, numbers, machine.effects)


def numbers_of(machine: Machine) -> dict[str, float]:
    """A machine's own numbers without load, by the kernels' names; joint n's play is `backlash_n`. These are what an
    effect may change."""
    numbers = _OFF | {
        "cam_inertia": machine.cam_inertia, "follower_inertia": machine.follower_inertia,
        "table_inertia": machine.table_inertia, "housing_inertia": machine.housing_inertia,
        "motor_inertia": machine.motor_inertia,
        "reduction": machine.reduction, "advance": machine.advance, "stations": float(machine.stations),
        "load_torque": 0.0,
    }  # fmt: skip
    for names, joint in zip(_JOINTS, (machine.input_joint, machine.output_joint, machine.base_joint), strict=True):
        its = joint.stiffness, joint.damping, joint.backlash, joint.stiffness_ratio
        numbers.update(zip(names, its, strict=True))
    return numbers


def coefficients_with(machine: Machine, numbers: dict[str, float], effects: Sequence[MachineEffect]) -> Coefficients:
    """The coefficients of a machine that has these numbers, as `numbers_of` gives them, and these effects in place of
    its own; the numbers are used up. A search builds thousands of machines a second so, which need no check."""
    model, known = machine.model, len(numbers)
    for effect in effects:
        if effect.is_null:
            continue
        if machine.model not in effect.models:
            raise ParameterError(
                f"{effect.name} needs Machine.model {' or '.join(effect.models)}, got {machine.model!r}; "
                f"it acts on {effect.enters}, which that model does not have."
            )
        effect.extend(numbers, machine)
        if len(numbers) > known:
            raise _no_coefficient(effect, machine, list(numbers)[known])
        if effect.name == "base.looseness":
            model = "B_on_base"
    features = 0
    for name, bit in _USES:
        features |= bit if numbers[name] != _OFF[name] else 0
    for number in (1, 2, 3):
        features |= _edges(numbers, number, machine.contact_law)
    if model == "A":
        features &= ~layout.HAS_EDGES_1
    if model != "B_on_base":
        features &= ~layout.HAS_EDGES_3
    in_dwell = features & _IN_DWELL
    law = law_table(machine.motion_law, machine.stations, machine.motion_share)
    for bit, name in _BUMPS if in_dwell else ():
        centre, half = numbers[f"{name}_centre"] % 1.0, numbers[f"{name}_half_width"]
        if any(low + half <= place <= high - half for low, high in law.motions for place in (centre, centre + 1.0)):
            in_dwell &= ~bit
    linear = model == "B" and not in_dwell and numbers["cubic_2"] == 0.0
    # a motor that does not slip may stand in a block with those that do, where its line must not divide by zero
    slip = numbers["slip_compliance"] or 1.0
    numbers |= {"law_first": 0.0, "law_count": 0.0, "linear_dwell": float(linear), "slip_compliance": slip}
    row = np.array(_IN_ORDER(numbers))
    return Coefficients(_MODELS[model], features, row, law)


def _no_coefficient(effect: MachineEffect, machine: Machine, name: str) -> ParameterError:
    """What to say of an effect that writes what no machine has, or what is worked out when all effects have written."""
    rule = "a function that changes only what indexer_env.coefficients.numbers_of(machine) has"
    worked_out = "it is worked out from the others, edges from backlash_1, backlash_2 and backlash_3"
    remedy = worked_out if name in PLACES else did_you_mean(name, numbers_of(machine))
    return refuse(effect.name, "extend", rule, name, remedy)


def _edges(values: dict[str, float], number: int, contact_law: str) -> int:
    """Derive a joint's edges and release times from its play and ratio; return its feature bit if it has edges."""
    play, damping = values.pop(f"backlash_{number}"), values[f"damping_{number}"]
    stiffness, ratio = values[f"stiffness_{number}"], values[f"ratio_{number}"]
    uneven = {1: values["mesh_friction"] > 0.0, 2: values["single_ratio_2"] < 1.0, 3: False}[number]
    bilinear = ratio < 1.0 or uneven
    clipped = play > 0.0 and contact_law == "clipped"
    release = damping / stiffness if clipped else 0.0
    hardening = values["cubic_2"] / stiffness if clipped and number == 2 else 0.0
    values |= {
        f"edge_{number}": play / 2.0 if play > 0.0 else (0.0 if bilinear else _NO_EDGE),
        f"release_{number}": release,
        f"hardening_{number}": hardening,
        f"release_minus_{number}": release / ratio,
        f"hardening_minus_{number}": hardening / ratio,
        f"free_damping_{number}": damping if play > 0.0 and contact_law == "damped_play" else 0.0,
    }
    return layout.HAS_EDGES_1 << (number - 1) if play > 0.0 or bilinear else 0


@dataclass(eq=False)
class Pack:
    """Items of the same model, side by side as the kernel takes them.

    Attributes
    ----------
    model : int
    features : int
        Of all items together.
    states : ndarray (n, STATE_ROWS)
        Start states: kinematic motion at `start_angle`, as from `start_states`.
    coefficients : ndarray (n, COEFFICIENT_ROWS)
    pieces : ndarray (p, PIECE_COLUMNS)
        All laws' pieces, one after the other.
    """

    model: int
    features: int
    states: np.ndarray
    coefficients: np.ndarray
    pieces: np.ndarray


def pack(items: Sequence[Coefficients], operating_points: Sequence[OperatingPoint]) -> Pack:
    """Put items of one model side by side."""
    laws = {id(item.law): item.law for item in items}
    first: dict[int, int] = {}
    total = 0
    for key, law in laws.items():
        first[key] = total
        total += len(law.pieces)
    rows = np.stack([item.row for item in items])
    rows[:, PLACES["law_first"]] = [first[id(item.law)] for item in items]
    rows[:, PLACES["law_count"]] = [len(item.law.pieces) for item in items]
    pieces = np.concatenate([law.pieces for law in laws.values()])
    features = functools.reduce(operator.or_, (item.features for item in items))
    return Pack(items[0].model, features, start_states(rows, operating_points), rows, pieces)


def start_states(rows: np.ndarray, operating_points: Sequence[OperatingPoint]) -> np.ndarray:
    """States (n, STATE_ROWS) of kinematic motion, from coefficients (n, COEFFICIENT_ROWS): motor at speed, input joint
    deflected by what ripples on the drive at the motor's angle and by nothing else, base undeflected.

    The kernel puts the table on its law (region_1 = 2) and finds the law's piece (piece = -1).
    """
    reduction = rows[:, PLACES["reduction"]]
    speed = np.array([point.motor_speed for point in operating_points], dtype=float)
    angle = np.array([point.start_angle for point in operating_points], dtype=float)
    columns = {
        "cam_angle": angle, "cam_rate": reduction * speed,
        "motor_angle": angle / reduction, "motor_rate": speed, "motor_command": speed,
        "region_1": 2.0, "piece": -1.0,
    }  # fmt: skip
    states = np.zeros((len(rows), layout.STATE_ROWS))
    for name, values in columns.items():
        states[:, layout.STATE_NAMES.index(name)] = values
    return states
