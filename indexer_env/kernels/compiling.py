"""How the kernels are compiled: four decorators, one for each role a function plays, and how many lanes they have.

All other modules here import each other by relative names, so that they can be loaded a second time beside another
module of this name: indexer_env.cuda.kernels has them for the threads of a GPU.


Nothing is allocated in the kernels, so their arrays are not counted as references (`_nrt`), which took a fifth of the
time; nor are they called from C, so numba's entry for that (`no_cfunc_wrapper`), a second copy of each function that is
inlined, is left out.
"""

from __future__ import annotations

import numpy as np
from numba import njit

LANES = np.uint64(32)
"""Machines that advance together: enough vectors in flight to hide latency, few enough to stay in the L1 cache."""

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
