"""How the kernels are compiled: four decorators, one for each role a function plays.

Nothing is allocated in the kernels, so their arrays are not counted as references (`_nrt`), which took a fifth of the
time; nor are they called from C, so numba's entry for that (`no_cfunc_wrapper`), a second copy of each function that is
inlined, is left out.
"""

from __future__ import annotations

from numba import njit

_SETTINGS = {"error_model": "numpy", "_nrt": False, "no_cfunc_wrapper": True}

scalar = njit(**_SETTINGS, forceinline=True)
"""For plain scalar functions: inlined into the loops that call them."""

lanes = njit(**_SETTINGS, forceinline=True)
"""For functions over a range of lanes: inlined too, so that a whole block's trip count is a constant."""

outlined = njit(**_SETTINGS)
"""For rare work inside the loops (landing on an edge, loading a law piece): compiled once, called."""

merged = njit(**_SETTINGS, inline="always")
"""For large functions with one caller: they become part of it before anything is compiled. As functions of their own
they would be optimised, with all that they call, once for themselves and once more in their caller."""
