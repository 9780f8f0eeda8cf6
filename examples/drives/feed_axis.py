"""A feed axis: motor, ball screw, slide. Hidden: play in the screw."""

name = "feed axis"
parameters = {"mass": (80.0, "kg", 5.0), "viscous": (150.0, "N s/m", 50.0)}
channels = {"time": "time", "q": "position", "force": "force"}
known = {"friction.coulomb": {"force": 40.0}}


def force(q, v, a, u, t, p):
    return p.mass * a + p.viscous * v
