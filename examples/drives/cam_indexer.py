"""A cam indexing table on its output shaft, simulated forwards. Hidden: dry friction of the table's bearing."""

from math import cos, floor, pi, sin

name = "cam indexer"
parameters = {
    "inertia": (5.0, "kg m^2", 0.3),
    "stiffness": (45000.0, "N m/rad", 5000.0),
    "damping": (28.0, "N m s/rad", 8.0),
}
states, joints = ("q", "v"), {"table": ("q", "v", "inertia")}
channels = {"time": "time", "q": "table", "cam": "cam", "cam_rate": "cam_rate"}


def rates(x, u, t, p):
    turn = u.cam / (2.0 * pi)
    s = min(2.0 * (turn - floor(turn)), 1.0)  # cycloidal rise over half a turn, then dwell; 8 stations
    law = pi / 4.0 * (floor(turn) + s - sin(2.0 * pi * s) / (2.0 * pi))
    slope = 0.25 * (1.0 - cos(2.0 * pi * s)) if s < 1.0 else 0.0
    return x.v, (p.stiffness * (law - x.q) + p.damping * (slope * u.cam_rate - x.v)) / p.inertia
