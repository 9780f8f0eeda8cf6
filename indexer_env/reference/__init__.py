"""The reference solver: slow, obvious, right. It shares no code with the compiled kernels and is there to check them.

Reading order
-------------
cam         the motion law in closed form, one smooth function per stretch of the cam turn
contact     one joint: its regions, the guards at their edges, its line in each region
tables      tables as splines of SciPy
equations   the equations of motion with all effects, smooth while no edge is crossed
edges       the first edge that a step crosses
solve       DOP853 from edge to edge; `simulate_reference`

SI units and radians. Between two edges (of a play, of the motion law's formula, of a bump, of a cam turn) the equations
are one smooth system; SciPy's DOP853 (Dormand and Prince, order 8) integrates it, and starts anew at each edge.
"""

from __future__ import annotations

from indexer_env.reference.solve import simulate_reference

__all__ = ["simulate_reference"]
