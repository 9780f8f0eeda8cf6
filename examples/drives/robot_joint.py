"""A geared robot joint that lifts an arm. Hidden: friction that builds up over a short way."""

import numpy as np

name = "robot joint"
parameters = {"inertia": (2.0, "kg m^2", 0.2), "viscous": (3.0, "N m s/rad", 1.0), "weight": (40.0, "N m", 4.0)}
channels = {"time": "time", "q": "angle", "force": "torque"}


def force(q, v, a, u, t, p):
    return p.inertia * a + p.viscous * v + p.weight * np.sin(q)
