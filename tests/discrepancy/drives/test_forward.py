"""The forward form against SciPy's solver stopped at events, and its sticking."""

import dataclasses
import math
from pathlib import Path

import numpy as np
import pytest
from numba.core.dispatcher import Dispatcher
from scipy.integrate import solve_ivp

from discrepancy.drives import forces
from discrepancy.drives.advance import integrator
from discrepancy.drives.channels import Record
from discrepancy.drives.door import subject_of
from discrepancy.fit import fit
from discrepancy.model import NONE
from indexer_env.compiled import kernel_fingerprint
from indexer_env.errors import IndexerError
from tests.discrepancy.drives.made import drive, run_plain, start_of, values

FILE = """
from math import sin

parameters = {"inertia": (0.05, "kg m^2", 0.005), "weight": (1.0, "N m", 0.1), "drag": (0.02, "N m s/rad", 0.01)}
states, joints = ("q", "v"), {"pivot": ("q", "v", "inertia")}
channels = {"time": "t", "q": "q", "u": "u"}
noise = 0.001


def rates(x, u, t, p):
    return x.v, (u - p.weight * sin(x.q) - p.drag * x.v) / p.inertia
"""

WINDOWS = FILE + "windows = 1.3\n"

RATE = 200.0
T = np.arange(800) / RATE
PUSH = 0.35 * np.sin(2.0 * math.pi * 0.31 * T) + 0.2 * np.sin(2.0 * math.pi * 0.73 * T + 1.0)


def solved(friction: float) -> np.ndarray:
    """Angle of the pendulum with Coulomb friction: stopped where the speed is zero, stuck while friction holds."""

    def push(t: float) -> float:
        return float(np.interp(t, T, PUSH))

    def held(t: float, q: float) -> float:
        return push(t) - math.sin(q)

    out, at, state = np.zeros(len(T)), 0.0, [0.3, 0.0]
    while at < T[-1]:
        if state[1] == 0.0 and abs(held(at, state[0])) <= friction:
            grid = np.arange(at, T[-1] + 1e-5, 1e-5)
            later = np.abs(np.interp(grid, T, PUSH) - math.sin(state[0])) > friction
            end = float(grid[later.argmax()]) if later.any() else T[-1] + 1e-9
            inside = (at <= T) & (end >= T)
            out[inside] = state[0]
            at = end
            continue
        side = math.copysign(1.0, state[1] if state[1] else held(at, state[0]))

        def rates(t: float, y: np.ndarray, side: float = side) -> list[float]:
            return [y[1], (push(t) - math.sin(y[0]) - 0.02 * y[1] - side * friction) / 0.05]

        def stops(t: float, y: np.ndarray, side: float = side, begun: float = at) -> float:
            return y[1] * side + (1.0 if t < begun + 1e-6 else 0.0)

        stops.terminal, stops.direction = True, -1.0
        found = solve_ivp(
            rates, (at, T[-1] + 1e-9), state, events=stops, rtol=1e-9, atol=1e-11, max_step=5e-3, dense_output=True
        )
        inside = (at <= T) & (found.t[-1] >= T)
        out[inside] = found.sol(T[inside])[0]
        at, state = found.t[-1], [found.y[0, -1], 0.0 if found.status == 1 else found.y[1, -1]]
    return out


@pytest.fixture(scope="module")
def truth() -> np.ndarray:
    return solved(0.15)


def made(folder: Path, q: np.ndarray, text: str = FILE, **more: object):
    rows = {"q": q, "u": PUSH}
    return subject_of(drive(folder, text), [Record("a.csv", RATE, rows, {"q": "rad", "u": "N m"}, **more)])  # type: ignore[arg-type]


def test_the_integrator_agrees_with_scipy_stopped_at_events(truth: np.ndarray, tmp_path: Path) -> None:
    subject = made(tmp_path, truth)
    model = subject.model
    coulomb = model.hypotheses()["friction.coulomb"][0]
    z = np.concatenate([np.zeros(3), coulomb.coordinates([0.15])])
    got = run_plain(model, coulomb, z, np.array([0.3, 0.0]))
    assert np.abs(got[0] - truth).max() < 2e-6
    stuck = np.flatnonzero(np.diff(truth) == 0.0)
    assert len(stuck) > 20, "it sticks for a while"
    assert np.abs(np.diff(got[0])[stuck]).max() < 1e-12, "and does not creep there"


def test_hidden_friction_is_found(truth: np.ndarray, tmp_path: Path) -> None:
    """Seed 5, noise of 1 mrad."""
    noisy = truth + 1e-3 * np.random.default_rng(5).standard_normal(len(truth))
    subject = made(tmp_path, noisy)
    # a fit may end in one of several minima, by where it starts
    starts = [start_of(subject, subject.model.hypotheses()["friction.coulomb"][0], start=k) for k in range(2)]
    problem, found = min(((p, fit(p, place, steps=15).place) for p, place in starts), key=lambda one: one[1].cost)
    assert found.level(subject.model) < 1.1
    got = values(problem, found)
    assert got["friction.coulomb.force"] == pytest.approx(0.15, rel=0.02)
    assert got["inertia"] == pytest.approx(0.05, rel=0.02)


def test_a_function_that_numba_cannot_compile_still_works(tmp_path: Path) -> None:
    text = FILE.replace("    return x.v", "    import json\n\n    return json.loads('1.0') * x.v")
    slow, fast = (made(tmp_path, np.interp(T, T, 0.2 * np.sin(3.0 * T)), given) for given in (text, FILE))
    assert any("could not be compiled" in note for note in slow.notes)
    assert not any("could not be compiled" in note for note in fast.notes)
    rows = [one.model.residuals(NONE, one.model.jobs(np.zeros(3))) for one in (slow, fast)]
    np.testing.assert_allclose(rows[0], rows[1], atol=1e-9)


@pytest.mark.parametrize(("effects", "said"), [(("play", "offset"), ["play"]), (("offset",), [])])
def test_what_is_not_looked_for_is_told_where_there_is_any(effects: tuple, said: list[str], tmp_path: Path) -> None:
    notes = made(tmp_path, 0.2 * np.sin(3.0 * T), f"{FILE}effects = {effects}\n").notes
    told = [note for note in notes if note.startswith("Not looked for")]
    assert told == [f"Not looked for, as the forward form does not have them: {name}." for name in said]


@pytest.mark.parametrize(
    ("change", "said"),
    [
        (("p.drag * x.v", "0.02 * x.v"), "the parameter drag must change the motion"),
        (("return x.v, ", "return "), "got TypeError"),
        (("return x.v, ", "return x.v, 0.0, "), "must give 2 rates, one a state, got 3"),
        (("/ p.inertia", "/ p.inertia * float('nan')"), "must give finite numbers"),
        (('"inertia")}', '"mass")}'), "joints"),
        (("p.drag * x.v", "p.drag * x.v + 1e9 * x.v"), "every run is lost at the values stated"),
        (("noise = 0.001", "cutoff = 3.0"), "cutoff must be left out beside rates"),
        (("noise = 0.001", "held = ('torque',)"), "held must be one of u, got 'torque'"),
        (("noise = 0.001", "held = 'u'"), "held must be a tuple of names of channels"),
        (
            ("noise = 0.001", "sessions = True"),
            "sessions must be names of parameters .* got 'offset'; they are inertia",
        ),
        (('("q", "v"), {', '("q", "v", "w"), {'), "got 2|nothing measured tells of the state 'w'"),
    ],
)
def test_a_mistake_is_one_sentence(change: tuple[str, str], said: str, tmp_path: Path) -> None:
    text = FILE.replace(*change)
    assert text != FILE
    with pytest.raises(IndexerError, match=said) as raised:
        made(tmp_path, 0.2 * np.sin(3.0 * T), text)
    assert "\n" not in str(raised.value)


def test_a_parameter_of_each_record(tmp_path: Path) -> None:
    """Two days of one pendulum, drag of 0.02 and 0.05 N m s/rad, by SciPy's solver."""

    def day(drag: float, name: str) -> Record:
        def rates(t: float, y: np.ndarray) -> list[float]:
            return [y[1], (float(np.interp(t, T, PUSH)) - math.sin(y[0]) - drag * y[1]) / 0.05]

        found = solve_ivp(rates, (0.0, T[-1]), [0.3, 0.0], t_eval=T, rtol=1e-8, atol=1e-10, max_step=5e-3)
        return Record(name, RATE, {"q": found.y[0], "u": PUSH}, {"q": "rad", "u": "N m"})

    one = drive(tmp_path, f"{FILE}\nsessions = ('drag',)\n")
    subject = subject_of(one, [day(0.02, "warm.csv"), day(0.05, "cold.csv")])
    problem, place = start_of(subject)
    place = fit(problem, place, steps=6).place
    assert place.level(subject.model) < 0.3
    got = values(problem, place)
    assert [got["record 1.drag"], got["record 2.drag"]] == pytest.approx([0.02, 0.05], rel=0.01)
    (said,) = subject.of_records(subject.model, place)
    assert said.startswith("drag of each record [N m s/rad]: 0.0")
    assert any("has its own: drag" in note for note in subject.notes)


def test_records_are_laid_out_for_the_report(truth: np.ndarray, tmp_path: Path) -> None:
    subject = made(tmp_path, truth)
    view = subject.view(subject.model)
    assert view.measured[view.inside].size == subject.model.counts.sum()
    assert {axis.name for axis in view.axes} == {"direction", "position", "speed", "time"}
    names = [m.name for m in subject.measurements(subject.model)]
    assert "the same motion again" in names and len(names) == 3
    # a larger motion is larger about the middle of the stroke, wherever the encoder's zero lies
    moved = made(tmp_path, truth + 5.0)
    (larger,) = (m.model for m in moved.measurements(moved.model) if "2 times" in m.name)
    states, q = larger.courses[0].states, moved.model.courses[0].states[:, 0]
    assert np.ptp(states[:, 0]) == pytest.approx(2.0 * np.ptp(q))
    assert 0.5 * (states[:, 0].max() + states[:, 0].min()) == pytest.approx(
        0.5 * (q.max() + q.min()), abs=0.02 * np.ptp(q)
    )
    assert "drive: my_drive.py" in subject.files(subject.model, start_of(subject)[1])["machine.yaml"]


def _against(effect: str, sizes: dict[str, float], fixed: dict[str, float], rates, start: list[float], tmp_path: Path):
    """Angle by the integrator with an effect, and by SciPy's with `rates(t, y)`, y the angle, its rate and more."""
    subject = made(tmp_path, 0.4 + 0.2 * np.sin(3.0 * T))
    model = subject.model
    one = next(h for h in model.hypotheses()[effect] if all(h.fixed.get(k) == v for k, v in fixed.items()))
    values_ = [sizes[p.name.removeprefix(f"{effect}.")] for p in one.parameters]
    z = np.concatenate([np.zeros(3), one.coordinates(values_)])
    got = run_plain(model, one, z, np.array([0.3, 0.0]))[0]
    found = solve_ivp(rates, (0.0, T[-1]), start, t_eval=T, rtol=1e-10, atol=1e-12, max_step=2e-3)
    plain = run_plain(model, NONE, np.zeros(3), np.array([0.3, 0.0]))[0]
    return got, found.y[0], plain


def test_a_load_on_a_spring_swings_as_scipy_says(tmp_path: Path) -> None:
    share, omega, damping = 0.4, 9.0, 0.08

    def rates(t: float, y: np.ndarray) -> list[float]:
        q, v, x, w = y
        pulled = -2.0 * damping * omega * (w - v) - omega**2 * (x - q)
        push = float(np.interp(t, T, PUSH)) - math.sin(q) - 0.02 * v
        return [v, (push / 0.05 - share * pulled) / (1.0 - share), w, pulled]

    sizes = {"share": share, "inverse_square": omega**-2, "damping": damping}
    got, truth, plain = _against("compliance", sizes, {}, rates, [0.3, 0.0, 0.3, 0.0], tmp_path)
    assert np.abs(got - truth).max() < 1e-5 < 1e-2 < np.abs(plain - truth).max()

    noisy = truth + 1e-3 * np.random.default_rng(6).standard_normal(len(truth))
    subject = made(tmp_path, noisy, WINDOWS)
    one = subject.model.hypotheses()["compliance"][0]
    near = dataclasses.replace(one, starts=((0.3, 1.1 * omega**-2, 0.05),), effects=())
    problem, place = start_of(subject, near)
    found = fit(problem, place, steps=20).place
    assert found.level(subject.model) < 1.2, "windows begin while the load swings"
    assert values(problem, found)["compliance.share"] == pytest.approx(share, rel=0.1)


def test_a_transmission_that_wavers_moves_the_load_as_scipy_says(tmp_path: Path) -> None:
    """u = x' f at the load's angle x = q + e sin(n q + φ), its speed and its acceleration, x' = dx/dq."""
    e, n, phase = 0.03, 2.0, 0.4

    def rates(t: float, y: np.ndarray) -> list[float]:
        q, v = y
        first, second = e * n * math.cos(n * q + phase), -e * n * n * math.sin(n * q + phase)
        x, w = q + e * math.sin(n * q + phase), (1.0 + first) * v
        push = float(np.interp(t, T, PUSH)) / (1.0 + first) - math.sin(x) - 0.02 * w
        return [v, (push / 0.05 - second * v * v) / (1.0 + first)]

    sizes = {"amplitude": e, "phase": phase}
    got, truth, plain = _against("drive.transmission_error", sizes, {"order": n}, rates, [0.3, 0.0], tmp_path)
    assert np.abs(got - truth).max() < 1e-5 < 1e-2 < np.abs(plain - truth).max()


def test_an_inertia_that_varies_moves_as_scipy_says(tmp_path: Path) -> None:
    """(J + J(q)) q̈ + q̇² J'(q)/2 = u - sin q - 0.02 q̇."""
    varied, k, phase = 0.02, 9.0, 0.4

    def rates(t: float, y: np.ndarray) -> list[float]:
        q, v = y
        push = float(np.interp(t, T, PUSH)) - math.sin(q) - 0.02 * v
        push -= 0.5 * varied * k * math.cos(k * q + phase) * v * v
        return [v, push / (0.05 + varied * math.sin(k * q + phase))]

    sizes = {"inertia": varied, "wavenumber": k, "phase": phase}
    got, truth, plain = _against("inertia.position", sizes, {}, rates, [0.3, 0.0], tmp_path)
    assert np.abs(got - truth).max() < 1e-5 < 1e-2 < np.abs(plain - truth).max()


def test_friction_by_load_is_that_of_the_inverse_form(tmp_path: Path) -> None:
    """While it moves u = f + μ |f| sign(v), f = J a + G sin q + c v, for the motion that comes out."""
    subject = made(tmp_path, 0.4 + 0.2 * np.sin(3.0 * T))
    model = subject.model
    one = model.hypotheses()["friction.load"][0]
    q = run_plain(model, one, np.concatenate([np.zeros(3), one.coordinates([0.3])]), np.array([0.3, 0.0]))[0]
    v, a = np.gradient(q, 1.0 / RATE), np.gradient(np.gradient(q, 1.0 / RATE), 1.0 / RATE)
    f = 0.05 * a + np.sin(q) + 0.02 * v
    left = PUSH - f - 0.3 * np.abs(f) * np.sign(v)
    moving = np.abs(v) > 0.1
    moving[:5] = moving[-5:] = False
    # where a speed or a force changes its sign the differences smear
    assert moving.sum() > 200 and float(np.median(np.abs(left[moving]))) < 1e-3
    assert float(np.median(np.abs(PUSH - f)[moving])) > 3e-2


def test_a_line_on_the_command_is_found(tmp_path: Path) -> None:
    """Seed 7: 0.2 N m at 6.7 Hz are read that do not act."""

    def rates(t: float, y: np.ndarray) -> list[float]:
        acting = float(np.interp(t, T, PUSH)) - 0.2 * math.sin(2.0 * math.pi * 6.7 * t + 0.8)
        return [y[1], (acting - math.sin(y[0]) - 0.02 * y[1]) / 0.05]

    found = solve_ivp(rates, (0.0, T[-1]), [0.3, 0.0], t_eval=T, rtol=1e-9, atol=1e-11, max_step=2e-3)
    subject = made(tmp_path, found.y[0] + 1e-3 * np.random.default_rng(7).standard_normal(len(T)), WINDOWS)
    zero = subject.model.residuals(NONE, subject.model.jobs(np.zeros(3)))
    one = subject.model.hypotheses(zero)["sensor.mains_hum"][0]
    assert one.starts[0][1] == pytest.approx(6.7, abs=0.1)
    problem, place = start_of(subject, one)
    place = fit(problem, place, steps=25).place
    assert place.level(subject.model) < 1.2
    assert values(problem, place)["sensor.mains_hum.amplitude"] == pytest.approx(0.2, rel=0.1)


@pytest.mark.skipif(not isinstance(integrator(), Dispatcher), reason="nothing is compiled")
def test_the_integrator_is_compiled_anew_where_what_it_calls_has_changed() -> None:
    """numba's key of it holds the hash of all sources."""
    (held,) = (cell.cell_contents for cell in integrator().py_func.__closure__)
    sources = [Path(forces.__file__).with_name(f"{name}.py") for name in ("advance", "forces")]
    assert held == kernel_fingerprint(*sources)


@pytest.mark.parametrize(
    ("table", "term", "compiled"),
    [
        ("import numpy as np\nTABLE = np.zeros(4)", "TABLE[int(1000.0 * abs(x.q - 0.3))]", True),
        ("TABLE = {0: 0.0}", "TABLE[int(1000.0 * abs(x.q - 0.3))]", False),
    ],
)
def test_a_table_read_beyond_its_end_loses_the_run_and_is_told_once(table, term, compiled, tmp_path, caplog, capfd):
    """Compiled code read on in foreign memory, and Python printed a traceback for each step."""
    q = 0.3 + 0.4 * np.sin(2.0 * math.pi * T)
    text = table + FILE.replace("- p.drag * x.v)", f"- p.drag * x.v + {term})")
    one = Record("a.csv", RATE, {"q": q, "u": PUSH}, {"q": "rad", "u": "N m"})
    with pytest.raises(IndexerError, match="every run is lost at the values stated"):
        subject_of(drive(tmp_path, text), [one])
    told = [one for one in caplog.messages if "KeyError in line" in one]
    assert len(told) == (0 if compiled else 1) and "Traceback" not in capfd.readouterr().err
