"""What may be missing at each joint of an indexing machine, as forms: free in size, free over one variable.

joint    a torque over cam phase, table angle, speed or time, alone or in proportion to what the joint carries
sensor   a gain or an offset that changes with time
scans    lines of fixed frequency, resonances, bursts that ring (`scans`)

Nothing here is a law of the library. A torque that varies freely over its variable holds all laws over it, so what is
compared is the variable and the joint alone.
"""

from __future__ import annotations

import math

import numpy as np

from discrepancy.indexer.setting import Setting
from discrepancy.indexer.windows import START_PHASE
from discrepancy.origin import Form, Laid, Residue

_PHASES = 48
"""Places of a torque over the cam turn, 7.5° apart: half as many miss a quarter of what a pulse of 15° shakes."""

_MARKS = 72
"""The same of an error of the cam's profile, which acts by its slope and curvature: 5°, as chatter marks of 18 waves a
turn need. Of marks of 15 waves 48 places show 84 % of the ln E that 72 do."""

_ANGLES = 36
"""Places of a torque over the table's turn, 10° apart, or two for each station if that is more: what lies beside the
table does not know how many stations it has. With two a station a dry patch of a fifth of the turn, on a machine of
four, is better told by a friction that is free in every turn of the cam."""

_PLACES = 9
"""Places of a torque over a speed, as many as a table has."""

_SLOW = 4
"""Places of what changes slowly over a record."""

_FREE = 0.1
"""s between the places of a torque that is free over time."""

_STILL = 0.03, 0.003
"""Of the table's largest speed: below it friction is undecided, as the library's own is below 0.002. A table that rings
in its dwell is told by the first one, a table that sticks there by the second: where a dry patch lets it do one or the
other, the first alone sees a friction that differs from turn to turn."""

_NEAR = 1e-4
"""Turns; step of the differences that give e' and e''."""

_TURN = 2.0 * math.pi


def forms_of(setting: Setting, residue: Residue) -> tuple[list[Form], list[tuple[Form, float]]]:
    """All forms but those that must be looked for, and torques free over time with their ln E."""
    motion, laid, machine = setting.motion, setting.laid, setting.machine
    w, n = laid.inside.shape
    carried_2, carried_1 = (motion[name] / setting.rms(motion[name]) for name in ("torque_2", "torque_1"))
    rate = setting.rate
    speed = motion["table_rate"] / np.abs(motion["table_rate"]).max()
    frictions = [(speed / np.sqrt(speed**2 + still**2))[..., None] for still in _STILL]
    twisting = motion["rate_2"] / max(float(np.quantile(np.abs(motion["rate_2"][laid.inside]), 0.99)), 1e-300)
    force = setting.table[:, None] * motion["table_acc"] / setting.rms(motion["torque_2"])
    phase = _spline(motion["cam"] / _TURN, _PHASES)
    angle = _spline(motion["table"] / _TURN, max(_ANGLES, 2 * machine.stations))
    station = _stations(motion["cam"], laid.inside, machine.stations)
    slow = _over(_share(laid), _SLOW)
    moments = np.arange(n)[None, :] * laid.step[:, None] / _FREE
    free = _places(moments[..., None] - np.arange(-1, math.ceil(float(moments.max())) + 2))
    one = np.ones((w, n))[..., None]

    by_phase, by_phase_2, inertia, by_angle, by_speed, free_table, *by_friction = _read(
        setting, "table", phase, phase * rate[..., None] ** 2, station * force[..., None], angle,
        _over(0.1 + 0.9 * np.clip(speed, -0.1, 1.0), _PLACES), free, *(angle * one for one in frictions), *frictions,
    )  # fmt: skip
    dry, rubbing = by_friction[: len(_STILL)], by_friction[len(_STILL) :]
    track, softer, uneven, slowly, damping, turning = _read(
        setting, "joint 2", phase, phase * carried_2[..., None], station * carried_2[..., None],
        slow * carried_2[..., None], _over(0.5 + 0.5 * np.clip(twisting, -1.0, 1.0), _PLACES),
        one * carried_2[..., None],
    )  # fmt: skip
    at_cam, at_cam_2, softer_1, slowly_1, free_cam = _read(
        setting, "cam", phase, phase * rate[..., None] ** 2, phase * carried_1[..., None], slow * carried_1[..., None],
        free,
    )  # fmt: skip
    ground = _profile(setting)
    read = setting.read(motion["table_acc"][..., None])
    own = np.eye(w)
    records = (laid.groups[:, None] == np.unique(laid.groups)).astype(float)
    rows = [
        ("output", "phase", "a torque on the table that follows the cam's phase", by_phase),
        ("output", "phase", "a torque on the table that follows the cam's phase and grows with speed", by_phase_2),
        ("output", "phase", "a torque in the output joint that follows the cam's phase", track),
        ("output", "phase", "a stiffness of the output joint that follows the cam's phase", softer),
        ("output", "phase", "a free error of the cam's profile", ground),
        ("output", "station", "a table inertia that differs between stations", inertia),
        ("output", "station", "a stiffness of the output joint that differs between stations", uneven),
        ("output", "station", "a torque on the table that follows its angle", by_angle),
        ("output", "speed", "a torque on the table that follows its speed", by_speed),
        ("output", "speed", "a torque in the output joint that follows the rate of its deflection", damping),
        ("output", "time", "a stiffness of the output joint that changes slowly", spread(slowly, records)),
        ("output", "time", "a stiffness of the output joint that differs from turn to turn", spread(turning, own)),
        ("input", "phase", "a torque on the cam shaft that follows the cam's phase", at_cam),
        ("input", "phase", "a torque on the cam shaft that follows the cam's phase and grows with speed", at_cam_2),
        ("input", "phase", "a stiffness of the input joint that follows the cam's phase", softer_1),
        ("input", "time", "a stiffness of the input joint that changes slowly", spread(slowly_1, records)),
        ("sensor", "time", "a gain of the sensor that changes slowly", spread(read * slow, records)),
        ("sensor", "time", "a gain of the sensor that differs from turn to turn", spread(read, own)),
        ("sensor", "time", "an offset of the sensor that changes slowly", spread(slow, records)),
        *(("output", "station", "a friction of the table that follows its angle", one) for one in dry),
        *(
            ("output", "time", "a friction of the table that differs from turn to turn", spread(one, own))
            for one in rubbing
        ),
    ]  # fmt: skip
    forms = [Form(joint, kind, name, residue.clean(x)) for joint, kind, name, x in rows]
    nothing = np.zeros((0, 0))
    at_any_time = [
        (Form("output", "time", "a torque on the table that follows nothing but time", nothing), free_table),
        (Form("input", "time", "a torque on the cam shaft that follows nothing but time", nothing), free_cam),
    ]
    return forms, [(form, residue.evidence_by_window(x)) for form, x in at_any_time]


def _profile(setting: Setting) -> np.ndarray:
    """Readings (w, n, k) of a motion law β + e(α) with a free e over the cam's phase: joint 2 is twisted by e less,
    what it carries acts on the cam by β' + e', and the turret is turned against the housing by e more."""
    motion, machine = setting.motion, setting.machine
    turns, rate, turret = motion["cam"] / _TURN, motion["cam_rate"], machine.follower_inertia
    _, b1, b2 = machine.motion_law.evaluate(motion["cam"], machine.stations, machine.motion_share)
    e = _spline(turns, _MARKS)
    before, after = (_spline(turns + d, _MARKS) for d in (-_NEAR, _NEAR))
    e1 = (after - before) / (2.0 * _NEAR * _TURN)
    e2 = (after - 2.0 * e + before) / (_NEAR * _TURN) ** 2
    acc, shaken = motion["cam_acc"], motion.get("housing_acc", 0.0)
    carried = motion["torque_2"] - turret * (b2 * rate**2 + 2.0 * b1 * acc + shaken)
    twisted = motion["k2"][..., None] * e + (motion["r2"] * rate)[..., None] * e1
    turned = carried[..., None] * e1 - (turret * b1 * rate**2)[..., None] * e2
    pushed = -turret * (acc[..., None] * e1 + (rate**2)[..., None] * e2)
    parts = (-twisted, "joint 2"), (turned, "cam"), (pushed, "housing")
    return np.sum([setting.readings(*part) for part in parts], axis=0)


def _read(setting: Setting, joint: str, *torques: np.ndarray) -> list[np.ndarray]:
    """Readings of several torques (w, n, k), which are advanced together."""
    ends = np.cumsum([one.shape[2] for one in torques])[:-1]
    return np.split(setting.readings(np.concatenate(torques, axis=2), joint), ends, axis=2)


def _places(distance: np.ndarray) -> np.ndarray:
    """Cubic B-splines at distances from their places, in distances between places."""
    d = np.abs(distance)
    return np.where(d < 1.0, 2.0 / 3.0 - d**2 + 0.5 * d**3, np.clip(2.0 - d, 0.0, None) ** 3 / 6.0)


def _spline(turns: np.ndarray, count: int) -> np.ndarray:
    """Splines (w, n, k) at even places of a turn that is closed."""
    distance = (turns[..., None] * count - np.arange(count) + 0.5 * count) % count - 0.5 * count
    return _places(distance)


def _over(share: np.ndarray, count: int) -> np.ndarray:
    """Splines (w, n, k) at even places from 0 to 1 and one beyond either end, without which they hold no straight
    line."""
    return _places(share[..., None] * (count - 1) - np.arange(-1, count + 1))


def _share(laid: Laid) -> np.ndarray:
    """Time (w, n) in parts of its record's length."""
    ends = {g: float(laid.time[laid.groups == g].max()) for g in np.unique(laid.groups).tolist()}
    return laid.time / np.array([ends[g] for g in laid.groups.tolist()])[:, None]


def _stations(cam: np.ndarray, inside: np.ndarray, stations: int) -> np.ndarray:
    """1 (w, n, stations) where a window leaves a station, else 0."""
    middle = cam[np.arange(len(cam)), inside.sum(axis=1) // 2] / _TURN
    leaves = np.floor(middle + 1.0 - START_PHASE).astype(int) % stations
    return np.repeat(np.eye(stations)[leaves][:, None], cam.shape[1], axis=1)


def spread(readings: np.ndarray, owner: np.ndarray) -> np.ndarray:
    """Readings (w, n, k) with sizes of each owner's own (w, n, k owners); owner (w, owners) is 1 where it is that."""
    return (readings[..., None] * owner[:, None, None, :]).reshape(*readings.shape[:2], -1)
