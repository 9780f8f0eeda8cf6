"""EMPS: a motor and a ball screw move a slide."""

parameters = {"mass": (100.0, "kg", 20.0)}
channels = {"time": "t", "q": ("qm", 1.0, "m"), "force": ("vir", 35.15065, "N")}
held_out = 0.5


def force(q, v, a, u, t, p):
    return p.mass * a
