"""A driven pendulum, simulated forwards. Hidden: the motor acts late."""

from math import sin

parameters = {"inertia": (0.05, "kg m^2", 0.005), "weight": (1.0, "N m", 0.1), "drag": (0.02, "N m s/rad", 0.005)}
states, joints = ("q", "v"), {"pivot": ("q", "v", "inertia")}
channels = {"time": "time", "q": "angle", "u": "torque"}


def rates(x, u, t, p):
    return x.v, (u - p.weight * sin(x.q) - p.drag * x.v) / p.inertia
