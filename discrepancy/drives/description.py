"""What a user's file says of a drive: one function, its parameters, the channels, and which effects may be missing."""

from __future__ import annotations

import functools
import inspect
import keyword
import math
import re
from collections import namedtuple
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from types import ModuleType
from typing import Any

from discrepancy.drives.effects import DriveEffect
from discrepancy.drives.stated_effects import effects_of, effects_stated, texts
from discrepancy.drives.user_code import executed
from discrepancy.model import Parameter
from indexer_env.checks import check_number, did_you_mean
from indexer_env.errors import ParameterError, refuse

INVERSE, FORWARD = ("q", "v", "a", "u", "t", "p"), ("x", "u", "t", "p")
"""Arguments of the two forms."""

LOAD = ("q_load", "v_load", "a_load")
"""The role of a load's own position, and what it gives the inverse form as inputs."""

_KEYS = (
    "name", "parameters", "channels", "effects", "own_effects", "cutoff", "noise", "held_out", "joints", "states",
    "windows", "known", "sessions", "held", "force", "rates",
)  # fmt: skip

_FOREIGN = frozenset((
    "mm", "cm", "km", "um", "µm", "nm", "deg", "°", "rev", "rpm", "min", "h", "ms", "us", "kN", "MN", "mN", "kW", "kV",
    "mA", "mV", "lbf", "in", "ft", "arcmin", "arcsec",
))  # fmt: skip
"""Parts of a unit that no channel is in."""

_OTHERS = {"force": ("states", "joints", "windows"), "rates": ("cutoff",)}
"""Names that belong to the other form."""


@dataclass(frozen=True)
class Channel:
    """Where a role's samples stand: column of the file, what one of its numbers is worth, in which unit; None where
    the file says it."""

    column: str
    factor: float | None = None
    unit: str | None = None


@dataclass(frozen=True)
class Joint:
    """Where a force of an effect enters the forward form: states of position and speed, inertia as a parameter's name
    or a number."""

    name: str
    position: str
    speed: str
    inertia: str | float


@dataclass(frozen=True, eq=False)
class Drive:
    """A drive as its file describes it.

    Attributes
    ----------
    path : Path
    name : str
    function : callable
        `force` or `rates`.
    parameters : tuple of Parameter
        Their scale is how well they are known.
    channels : mapping of str to Channel
        By role: `time`, `q`, `v`, `a`, `force`; any other name is an input.
    effects : tuple of DriveEffect
        That may be missing, and those that are known.
    cutoff : float or None
        Where the comparison's low-pass is down by 3 dB [Hz]; None: by the record.
    noise : float, mapping of str to float, or None
        Standard deviation of the measured force [F]; in the forward form of each measured channel, by its role where
        their units differ; None: by the record.
    held_out : float
        Share of each record, its end, that is held out where no whole record is.
    states : tuple of str
        Of the forward form.
    joints : tuple of Joint
    windows : float or None
        Length of a window of the forward form [s]; None: by the record.
    known : mapping
        Standard effects that the model has from the start, by name: their parameters' values.
    sessions : tuple of str
        What differs from record to record: names of parameters, its own or those of known effects; in the inverse form
        "offset", that of each record's force.
    held : tuple of str
        Inputs, and the force, that keep a sample's value until the next; the others are linear between samples.
    """

    path: Path
    name: str
    function: Callable[..., Any]
    parameters: tuple[Parameter, ...]
    channels: Mapping[str, Channel]
    effects: tuple[DriveEffect, ...]
    cutoff: float | None = None
    noise: float | Mapping[str, float] | None = None
    held_out: float = 1.0 / 3.0
    states: tuple[str, ...] = ()
    joints: tuple[Joint, ...] = ()
    windows: float | None = None
    known: Mapping[str, Mapping[str, float]] = field(default_factory=dict)
    sessions: tuple[str, ...] = ()
    held: tuple[str, ...] = ()

    @property
    def forward(self) -> bool:
        """Whether the function gives rates of states."""
        return bool(self.states)

    def p(self, values: Sequence[float]) -> Any:
        """Values of the parameters [units] as the function takes them: a named tuple."""
        return named(tuple(p.name for p in self.parameters))(*map(float, values))


@functools.cache
def named(names: tuple[str, ...]) -> type:
    """The class of a named tuple `p`: making one takes longer than a law over a record."""
    return namedtuple("p", names)  # type: ignore[misc]


def load_drive(path: Path) -> Drive:
    """Read a drive's file.

    Raises
    ------
    ParameterError
        There is no such file, it raises when it is read, or something in it breaks its rule.
    """
    found = executed(path)
    name = path.name
    forms = [form for form in ("force", "rates") if callable(found.get(form))]
    if len(forms) != 1:
        rule = "one function, force(q, v, a, u, t, p) or rates(x, u, t, p)"
        raise ParameterError(f"{name} must define {rule}, got {' and '.join(forms) or 'none'}.")
    form = forms[0]
    for key in _OTHERS[form]:
        if key in found:
            raise refuse(name, key, f"left out beside {form}, which has no such thing", found[key])
    _check_arguments(name, form, found[form])
    _check_names(name, found)
    states, joints = _states(name, form, found)
    share = found.get("held_out", 1.0 / 3.0)
    check_number(name, "held_out", share, low=0.05, high=0.8, unit="of each record")
    of = "of the force" if form == "force" else "of the measured channels, or such numbers by their roles"
    for key, unit in (("cutoff", "Hz"), ("noise", of), ("windows", "s")):
        by_role = key == "noise" and form == "rates" and isinstance(found.get(key), Mapping)
        if found.get(key) is not None and not by_role:
            check_number(name, key, found[key], low=0.0, low_open=True, unit=unit)
    known = effects_stated(name, "known", found.get("known", {}))
    return Drive(
        path, str(found.get("name", path.stem)), found[form], _parameters(name, found.get("parameters")),
        _channels(name, form, found.get("channels"), states), effects_of(name, found, known),
        found.get("cutoff"), found.get("noise"), float(share), states, joints, found.get("windows"),
        known, _sessions(name, found.get("sessions", False)),
        texts(name, "held", "a tuple of names of channels, ('force',)", found.get("held", ())),
    )  # fmt: skip


def _check_arguments(name: str, form: str, function: Callable[..., Any]) -> None:
    wanted = INVERSE if form == "force" else FORWARD
    given = tuple(inspect.signature(function).parameters)
    if given != wanted:
        raise ParameterError(f"{name}: {form} must take ({', '.join(wanted)}), got ({', '.join(given)}).")


def _check_names(name: str, found: Mapping[str, Any]) -> None:
    """Refuse a name that is one letter off a known one: an option that is not read would do nothing."""
    for key, value in found.items():
        if key.startswith("_") or key in _KEYS or callable(value) or isinstance(value, ModuleType):
            continue
        if hint := did_you_mean(key, [k for k in _KEYS if abs(len(k) - len(key)) < 3]):
            raise ParameterError(f"{name}.{key} is no name that is read here; {hint}, or begin your own names with _.")


def _check_name(name: str, where: str, key: Any) -> None:
    if not isinstance(key, str) or not key.isidentifier() or keyword.iskeyword(key) or key.startswith("_"):
        raise refuse(name, where, "named as Python names are, without _ in front", key)


def _parameters(name: str, given: Any) -> tuple[Parameter, ...]:
    if not isinstance(given, Mapping) or not given:
        raise refuse(name, "parameters", "a mapping of names to (value, unit, uncertainty)", given)
    found = []
    for key, row in given.items():
        _check_name(name, "parameters", key)
        if not isinstance(row, list | tuple) or len(row) != 3:
            raise refuse(name, f"parameters[{key!r}]", "(value, unit, uncertainty)", row)
        value, unit, uncertainty = row
        if foreign := sorted(_FOREIGN.intersection(re.findall(r"[a-zµ°]+", str(unit), re.IGNORECASE))):
            remedy = f"channels are in SI units here, and so are parameters: state its value without {foreign[0]}"
            raise refuse(
                name, f"parameters[{key!r}] (unit)", "in m, rad, s, kg, N and what is made of them", unit, remedy
            )
        check_number(name, f"{key} (value)", value, unit=str(unit))
        check_number(name, f"{key} (uncertainty)", uncertainty, low=0.0, low_open=True, unit=str(unit))
        found.append(known_parameter(str(key), str(unit), float(value), float(uncertainty)))
    return tuple(found)


def known_parameter(name: str, unit: str, value: float, uncertainty: float) -> Parameter:
    """A parameter known to ± uncertainty (one standard deviation). Where the value is above 0 and more than twice its
    uncertainty it cannot change its sign: its logarithm is what moves."""
    if value > 2.0 * uncertainty:
        return Parameter(
            name, unit, value, uncertainty / value, 1e-3 * value, 1e3 * value, known=True, logarithmic=True
        )
    return Parameter(name, unit, value, uncertainty, known=True)


def _channels(name: str, form: str, given: Any, states: Sequence[str]) -> dict[str, Channel]:
    if not isinstance(given, Mapping) or not given:
        raise refuse(name, "channels", "a mapping of roles to columns of the files", given)
    found = {}
    for role, row in given.items():
        row: Any = (row,) if isinstance(row, str) else row
        usable = isinstance(row, list | tuple) and 1 <= len(row) <= 3 and isinstance(row[0], str)
        _check_name(name, "channels", role)
        if not usable or (len(row) > 2 and not isinstance(row[2], str)):
            raise refuse(name, f"channels[{role!r}]", "'column' or ('column', factor, 'unit')", given[role])
        if len(row) > 1:
            check_number(name, f"channels[{role!r}] (factor)", row[1])
            if not row[1] or not math.isfinite(row[1]):
                raise refuse(name, f"channels[{role!r}] (factor)", "a number other than 0", row[1])
        found[str(role)] = Channel(*row)
    if form == "force":
        if "force" not in found:
            raise refuse(name, "channels", "a mapping with the role 'force', which is what is predicted", list(found))
        if LOAD[0] in found and "q" not in found:
            raise refuse(name, "channels", "a mapping with the role 'q' beside 'q_load'", list(found))
        if taken := {"v_load", "a_load"} & set(found):
            rule = "a mapping without roles that are made of 'q_load'"
            raise refuse(name, "channels", rule, sorted(taken), "give the load's position alone")
        if not {"q", "v"} & set(found):
            raise refuse(name, "channels", "a mapping with the role 'q' or 'v', the measured motion", list(found))
    elif not set(states) & set(found):
        raise refuse(name, "channels", f"a mapping with one of the states {', '.join(states)}", list(found))
    return found


def _states(name: str, form: str, found: Mapping[str, Any]) -> tuple[tuple[str, ...], tuple[Joint, ...]]:
    if form == "force":
        return (), ()
    states = texts(name, "states", "a tuple of names, ('q', 'v')", found.get("states", ("q", "v")) or None)
    for state in states:
        _check_name(name, "states", state)
    joints = found.get("joints")
    if not isinstance(joints, Mapping) or not joints:
        rule = "a mapping of joints to (position state, speed state, inertia), {'joint': ('q', 'v', 'inertia')}"
        raise refuse(name, "joints", rule, joints, "it says where a missing force enters")
    rows = []
    for key, row in joints.items():
        if not isinstance(row, list | tuple) or len(row) != 3 or row[0] not in states or row[1] not in states:
            raise refuse(name, f"joints[{key!r}]", f"(position, speed, inertia), both of {', '.join(states)}", row)
        named = isinstance(row[2], str) and row[2] in (found.get("parameters") or {})
        if not named:
            check_number(name, f"joints[{key!r}] (inertia)", row[2], low=0.0, low_open=True)
        rows.append(Joint(str(key), *row))
    return states, tuple(rows)


def _sessions(name: str, given: Any) -> tuple[str, ...]:
    if isinstance(given, bool):
        return ("offset",) if given else ()
    rule = "a tuple of names of parameters that differ between records, ('offset', 'mass'), or True for the offset"
    return texts(name, "sessions", rule, given)
