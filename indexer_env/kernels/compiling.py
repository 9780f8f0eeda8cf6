"""How the kernels are compiled: three decorators, one for each role a function plays."""

from __future__ import annotations

from numba import njit

scalar = njit(error_model="numpy", forceinline=True, _nrt=False)
"""For plain scalar functions: inlined into the loops that call them."""

lanes = njit(error_model="numpy", forceinline=True, _nrt=False)
"""For functions over a range of lanes: inlined too, so that a whole block's trip count is a constant."""

outlined = njit(error_model="numpy", _nrt=False)
"""For rare work inside the loops (landing on an edge, loading a law piece): compiled once, called."""
