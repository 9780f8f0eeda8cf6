"""A user's `rates` for the integrator: compiled where numba can, called back as Python where it cannot."""

from __future__ import annotations

import logging
import math
import warnings
from collections import namedtuple
from collections.abc import Callable, Sequence
from typing import Any

import numba
import numpy as np
from numba.core import errors

from discrepancy.drives.advance import SIGNATURE
from discrepancy.drives.description import Drive
from discrepancy.drives.user_code import said_by_user
from indexer_env.errors import ParameterError

_log = logging.getLogger(__name__)


def integrable(drive: Drive, inputs: Sequence[str], x: np.ndarray, u: np.ndarray, row: np.ndarray) -> tuple[Any, bool]:
    """The drive's `rates` as the integrator calls it, f(x, u, t, row, out), and whether numba could compile it.

    Parameters
    ----------
    drive : Drive
    inputs : sequence of str
        Names of the inputs.
    x, u, row : ndarray
        States, inputs and values of the parameters for a trial call.

    Raises
    ------
    ParameterError
        It raises, or gives another number of rates than there are states, or none that is finite.
    """
    arguments = _arguments(drive, inputs)
    _check(drive, arguments, x, u, row)
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore", errors.NumbaWarning)
            # a division by zero gives no number, where Python's error could not be passed on
            function = numba.njit(drive.function, error_model="numpy", boundscheck=True)
            fast = numba.njit(_wrapped(drive, function, arguments, guarded=True))
            return numba.cfunc(SIGNATURE)(fast), True
    except (errors.NumbaError, errors.UnsupportedBytecodeError):
        return numba.cfunc(SIGNATURE)(_called_back(drive, arguments)), False


def plain_rates(drive: Drive, inputs: Sequence[str]) -> Callable[..., None]:
    """The drive's `rates` in the same form, as Python."""
    return _wrapped(drive, drive.function, _arguments(drive, inputs))


def _arguments(drive: Drive, inputs: Sequence[str]) -> dict[str, Any]:
    """What the generated wrapper refers to, and its three expressions."""
    names = [p.name for p in drive.parameters]
    given = {
        "X": namedtuple("x", drive.states), "P": namedtuple("p", names), "U": namedtuple("u", list(inputs) or ["none"]),
        "x": f"X({', '.join(f'x[{k}]' for k in range(len(drive.states)))})",
        "p": f"P({', '.join(f'row[{k}]' for k in range(len(names)))})",
        "u": "0.0" if not inputs else "u[0]" if len(inputs) == 1
        else f"U({', '.join(f'u[{k}]' for k in range(len(inputs)))})",
    }  # fmt: skip
    return given


def _wrapped(drive: Drive, function: Any, given: dict[str, Any], *, guarded: bool = False) -> Any:
    """`function` as the integrator calls it; what it raises leaves rates that are no numbers, so that the run counts as
    lost, and goes on only where it is not `guarded`: out of compiled code each would be printed."""
    call = [
        f"found = function({given['x']}, {given['u']}, t, {given['p']})",
        *(f"out[{k}] = found[{k}]" for k in range(len(drive.states))),
    ]
    lines = [
        "def wrapped(x, u, t, row, out):",
        *(f"    out[{k}] = nan" for k in range(len(drive.states))),
        *(["    try:", *(f"        {line}" for line in call), "    except Exception:", "        pass"] if guarded
          else (f"    {line}" for line in call)),
    ]  # fmt: skip
    scope = {"function": function, "nan": math.nan, "X": given["X"], "P": given["P"], "U": given["U"]}
    exec("\n".join(lines), scope)
    return scope["wrapped"]


def _called_back(drive: Drive, given: dict[str, Any]) -> Any:
    """The same, called in Python from the compiled integrator. What it raises there could not be passed on: its rates
    are then no numbers, and the run counts as lost."""
    _CALLED_BACK.append((_wrapped(drive, drive.function, given), drive))
    number = len(_CALLED_BACK) - 1

    def wrapped(x, u, t, row, out):
        with numba.objmode(found="float64[:]"):
            found = _python(number, x, u, t, row)
        out[: len(found)] = found

    # compiled by itself first: inside a C callback numba would leave out what Python needs to be called
    inner = numba.njit(SIGNATURE)(wrapped)
    return lambda x, u, t, row, out: inner(x, u, t, row, out)


_CALLED_BACK: list[tuple[Callable[..., None], Drive]] = []
"""Functions that compiled code calls by their number: numba would have to pickle them."""

_TOLD: set[int] = set()
"""Numbers of those of which it was told that they raise."""


def _python(number: int, x: np.ndarray, u: np.ndarray, t: float, row: np.ndarray) -> np.ndarray:
    function, drive = _CALLED_BACK[number]
    out = np.full(len(drive.states), np.nan)
    try:
        function(x, u, t, row, out)
    except (ArithmeticError, ValueError):
        pass
    except Exception as error:
        if number not in _TOLD:
            _TOLD.add(number)
            said = str(said_by_user(drive.path, drive.function, error)).rstrip(".")
            _log.warning("%s, at %.4g s with the states %s: runs in which it does count as lost", said, t, x.tolist())
    return out


def _check(drive: Drive, given: dict[str, Any], x: np.ndarray, u: np.ndarray, row: np.ndarray) -> None:
    kinds = {key: given[key] for key in "XPU"}
    values = {"x": x, "u": u, "row": row}
    arguments = [eval(given[key], {**kinds, **values}) for key in "xup"]
    try:
        found = drive.function(arguments[0], arguments[1], 0.0, arguments[2])
        rates = [float(one) for one in found]
    except (Exception, SystemExit) as error:
        raise said_by_user(drive.path, drive.function, error) from None
    name = f"{drive.path.name}: rates"
    if len(rates) != len(drive.states):
        raise ParameterError(f"{name} must give {len(drive.states)} rates, one a state, got {len(rates)}.")
    if not np.isfinite(rates).all():
        raise ParameterError(f"{name} must give finite numbers, got {rates} at the first sample.")
