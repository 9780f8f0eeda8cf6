"""A pick-and-place head, upright. Hidden: the tray that it presses on."""

name = "pick-and-place head"
parameters = {"mass": (3.5, "kg", 0.3), "viscous": (20.0, "N s/m", 8.0)}
channels = {"time": "time", "q": "position", "force": "force"}
known = {"friction.coulomb": {"force": 4.0}}


def force(q, v, a, u, t, p):
    return p.mass * (a + 9.81) + p.viscous * v
