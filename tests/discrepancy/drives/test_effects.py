"""Each standard effect: nothing at its null, its own signature, and found again in a record that its equation made."""

import dataclasses
import math
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest
from numba.core.dispatcher import Dispatcher

from discrepancy.drives.channels import Record
from discrepancy.drives.door import subject_of
from discrepancy.drives.effects import EFFECTS
from discrepancy.drives.effects.coupling import _carried, contact, dragged
from discrepancy.drives.effects.friction import dahl
from discrepancy.fit import fit
from discrepancy.jobs import Jobs
from discrepancy.model import NONE
from indexer_env.compiled import kernel_fingerprint
from indexer_experiments.challenge.drives.motions import reference
from indexer_experiments.challenge.drives.plant import simulate_plant
from tests.discrepancy.drives.made import FILE, drive, motion, record, start_of, subject, values

ROTARY = """
parameters = {"mass": (90.0, "kg m^2", 15.0)}
channels = {"time": "t", "q": "q", "force": "f"}


def force(q, v, a, u, t, p):
    return p.mass * a
"""

WIDE = f"{FILE}\ncutoff = 20.0\n"


def _middle(q: np.ndarray) -> float:
    return 0.5 * float(q.min() + q.max())


def _every(model) -> tuple:
    w = np.arange(len(model.counts))
    return np.zeros_like(w), w, np.zeros((len(w), 0))


MADE = {
    "friction.viscous": (lambda t, q, v, a: 40.0 * v, {"coefficient": 40.0}),
    "friction.quadratic": (lambda t, q, v, a: 150.0 * np.abs(v) * v, {"coefficient": 150.0}),
    "friction.coulomb": (lambda t, q, v, a: 8.0 * np.sign(v), {"force": 8.0}),
    "friction.asymmetric": (lambda t, q, v, a: 8.0 * np.sign(v) ** 2, {"force": 8.0}),
    "friction.stribeck": (lambda t, q, v, a: 9.0 * np.sign(v) / (1.0 + (v / 0.03) ** 2), {"force": 9.0, "speed": 0.03}),
    "friction.load": (lambda t, q, v, a: 0.2 * np.abs(95.0 * a) * np.sign(v), {"coefficient": 0.2}),
    "friction.time": (lambda t, q, v, a: 0.9 * t * np.sign(v), {"rate": 0.9}),
    "friction.presliding": (lambda t, q, v, a: 8.0 * dahl(q, 0.004), {"force": 8.0, "distance": 0.004}),
    "offset": (lambda t, q, v, a: 6.0 + 0.0 * t, {"force": 6.0}),
    "spring.linear": (lambda t, q, v, a: 80.0 * q, {"stiffness": 80.0}),
    "spring.cubic": (lambda t, q, v, a: 9e3 * q**3, {"stiffness": 9e3}),
    "spring.bilinear": (lambda t, q, v, a: 400.0 * np.maximum(q - 0.05, 0.0), {"stiffness": 400.0}),
    "end_stop": (
        lambda t, q, v, a: 900.0 * (np.maximum(q - 0.1, 0.0) + np.minimum(q + 0.1, 0.0)), {"stiffness": 900.0}),
    "sensor.offset_drift": (lambda t, q, v, a: 1.3 * t, {"rate": 1.3}),
    "cogging": (lambda t, q, v, a: 5.0 * np.sin(100.0 * q + 0.7), {"force": 5.0, "wavenumber": 100.0}),
    "inertia.position": (
        lambda t, q, v, a: 30.0 * (np.sin(22.0 * q + 0.7) * a + 11.0 * np.cos(22.0 * q + 0.7) * v**2),
        {"inertia": 30.0, "wavenumber": 22.0}),
    "sensor.mains_hum": (lambda t, q, v, a: 3.0 * np.sin(2.0 * math.pi * 5.3 * t + 0.4), {"amplitude": 3.0}),
}  # fmt: skip


def test_names_sizes_and_alikes_belong_together() -> None:
    for name, effect in EFFECTS.items():
        assert effect.name == name and effect.sentence.endswith(".") and effect.equation and effect.source
        assert set(effect.alike) <= set(EFFECTS), name
        assert sum(size.null is not None for size in effect.sizes) == 1, name
        for size in effect.sizes:
            inside = [start for start in size.starts if not size.low <= start <= size.high]
            assert not inside, (name, size.name)


@pytest.mark.parametrize("name", sorted(name for name, effect in EFFECTS.items() if effect.load != "seen"))
def test_an_effect_at_its_null_is_nothing(name: str, tmp_path) -> None:
    unit = {"q": "rad", "force": "N m"}
    made = subject(tmp_path, lambda t, q, v, a: 95.0 * a + 3.0 * np.sign(v) + 20.0 * q, ROTARY, units=unit)
    model = made.model
    if name in model.left_out:
        assert name in ("inertia", "sensor.gain")
        return
    base = model.compared(0, NONE, np.zeros(1))[0]
    size = next(k for k, s in enumerate(EFFECTS[name].sizes) if s.null is not None)
    for hypothesis in model.hypotheses()[name]:
        for start in hypothesis.starts[:3]:
            there = np.concatenate([[0.0], hypothesis.coordinates(start)])
            off = there.copy()
            off[1 + size] = hypothesis.coordinates([hypothesis.parameters[size].nominal if k == size else s
                                                    for k, s in enumerate(start)])[size]  # fmt: skip
            gone = model.compared(0, hypothesis, off)[0]
            np.testing.assert_allclose(gone, base, atol=1e-9)
        starts = [np.concatenate([[0.0], hypothesis.coordinates(start)]) for start in hypothesis.starts]
        moved = [model.compared(0, hypothesis, there) for there in starts]
        assert any(np.abs(row - base).max() > 1e-3 or rest.any() for row, rest in moved), "a start is something"


@pytest.mark.parametrize("name", sorted(MADE))
def test_an_effect_is_found_again(name: str, tmp_path) -> None:
    """Seed 3: 95 kg where 90 ± 15 were known; noise of 0.05 N a sample."""
    extra, truth = MADE[name]
    made = subject(tmp_path, lambda t, q, v, a: 95.0 * a + extra(t, q - _middle(q), v, a), WIDE)
    hypothesis = made.model.hypotheses()[name][0]
    best = None
    for start in range(min(6, len(hypothesis.starts))):
        problem, place = start_of(made, hypothesis, start=start)
        found = fit(problem, place, steps=25).place
        best = found if best is None or found.cost < best.cost else best
    got = values(problem, best)
    alone = made.model.residuals(NONE, Jobs(np.zeros((1, 1)), *_every(made.model)))
    assert best.squares.sum() < 0.01 * (alone**2).sum()
    assert got["mass"] == pytest.approx(95.0, rel=0.01)
    for key, value in truth.items():
        assert got[f"{name}.{key}"] == pytest.approx(value, rel=0.05), (key, got)


def test_a_late_force_is_found(tmp_path) -> None:
    late = 0.012
    made = subject(tmp_path, lambda t, q, v, a: 95.0 * np.interp(t + late, t, a))
    problem, place = start_of(made, made.model.hypotheses()["delay"][0], start=1)
    got = values(problem, fit(problem, place, steps=25).place)
    assert got["delay.delay"] == pytest.approx(late, rel=0.02)


def test_friction_at_rest_takes_what_holds(tmp_path) -> None:
    """While the drive stands still the force may be anything up to the dry friction; beyond it counts."""
    t, q, *_ = motion()
    still = (t > 5.0) & (t < 8.0)
    k = int(np.argmax(still))
    q = np.where(still, q[k], np.where(t >= 8.0, q - q[int(8.0 * 500)] + q[k], q))

    def levels(push: float) -> np.ndarray:
        given = np.where(still, push, 95.0 * np.gradient(np.gradient(q, t), t) + 8.0 * np.sign(np.gradient(q, t)))
        one = record(lambda *_: given)
        rows = {"q": q, "force": one.rows["force"]}
        made = subject_of(drive(tmp_path, WIDE), [dataclasses.replace(one, rows=rows, noise=0.05)])
        place = start_of(made, made.model.hypotheses()["friction.coulomb"][0])[1]
        z = np.array([made.model.parameters[0].coordinate(95.0), place.hypothesis.coordinates([8.0])[0]])
        residual = made.model._residual(place.hypothesis, z, 0)
        at = made.model.tracks[0].t[made.model.tracks[0].at]
        return np.abs(residual[(at > 5.5) & (at < 7.5)])

    assert levels(6.0).max() == 0.0
    assert levels(-7.5).max() == 0.0
    assert levels(10.0).min() > 2.0


def test_a_dragged_load_stays_in_its_play() -> None:
    q = np.array([0.0, 1.0, 2.0, 1.5, 1.0, 0.0, 0.5])
    np.testing.assert_allclose(dragged(q, 1.0), [0.0, 0.5, 0.5, 0.0, -0.5, -0.5, 0.0])


@pytest.mark.parametrize("law", [0.0, 1.0, 2.0])
def test_play_begins_at_nothing_though_the_acceleration_is_read_with_an_offset(law: float, tmp_path) -> None:
    """An accelerometer that reads 0.25 m/s² too much: a play of 1e-12 of the stroke is hardly more than none."""
    text = FILE.replace('"q": "q",', '"q": "q", "a": "a",')
    _, q, _, a = motion()
    rows = {"q": q, "a": a + 0.25, "force": 95.0 * a}
    made = subject_of(drive(tmp_path, text), [Record("a.csv", 500.0, rows, {"q": "m", "a": "m/s^2", "force": "N"})])
    one = next(h for h in made.model.hypotheses()["play.contact"] if h.fixed["law"] == law)
    without, hardly, some = (
        made.model.compared(0, one, np.concatenate([[0.0], one.coordinates([play, 0.5, 0.0])]))[0]
        for play in (0.0, 1e-13, 1e-3)
    )
    assert np.abs(hardly - without).max() < 0.01 < 0.5 < np.abs(some - without).max()


def test_presliding_is_exact_along_a_path() -> None:
    """z = 1 - exp(-q/d) from rest, however coarse the samples are."""
    for count in (3, 30, 300):
        q = np.linspace(0.0, 0.05, count)
        assert dahl(q, 0.02)[-1] == pytest.approx(1.0 - math.exp(-2.5), rel=1e-12)


def test_the_ends_of_standstills_are_known_no_better_than_samples_tell(tmp_path) -> None:
    """A drive that stands between its moves, at 50 Hz: with the right friction the model is near the noise, though a
    start lies its kernel's reach before it is seen. Seed 1; the plant has a solver of its own."""
    rng = np.random.default_rng(1)
    path = 0.1 * reference("steps", 12000, 5.0, rng)
    run = simulate_plant({"mass": 95.0, "coulomb": 60.0}, path, 1000.0, (95.0 * 3600.0, 95.0 * 96.0), steps=25)
    force = run.force + 0.2 * rng.standard_normal(len(run.force))
    rows = {"q": run.q[::20], "force": force[::20]}
    made = subject_of(drive(tmp_path), [Record("a.csv", 50.0, rows, {"q": "m", "force": "N"})])
    problem, place = start_of(made, made.model.hypotheses()["friction.coulomb"][0])
    found = fit(problem, place, steps=25).place
    assert found.level(made.model) < 1.5
    assert values(problem, found)["friction.coulomb.force"] == pytest.approx(60.0, rel=0.02)


def test_a_compliance_is_looked_for_where_the_record_rings(tmp_path) -> None:
    """A load of 50 kg that rings at 7.1 rad/s with 1 % of damping after every move; seed 2."""
    rng = np.random.default_rng(2)
    omega = 27.0
    path = 0.1 * reference("steps", 12000, 5.0, rng)
    truth = {"mass": 45.0, "load": 50.0, "stiffness": 50.0 * omega**2, "damping": 50.0 * 0.02 * omega}
    run = simulate_plant(truth, path, 1000.0, (95.0 * 3600.0, 95.0 * 96.0), steps=25)
    force = run.force + 0.5 * rng.standard_normal(len(run.force))
    rows = {"q": run.q[::4], "force": force[::4]}
    made = subject_of(drive(tmp_path), [Record("a.csv", 250.0, rows, {"q": "m", "force": "N"})])
    first = made.model.hypotheses()["compliance"][0]
    assert any(1.0 / math.sqrt(start[1]) == pytest.approx(omega, rel=0.02) for start in first.starts[:3])


def test_a_gain_that_known_friction_can_do_is_not_looked_for(tmp_path) -> None:
    known = FILE.replace('"f"}', '"f"}\nknown = {"friction.coulomb": {"force": 8.0}}')
    made = subject(tmp_path, lambda t, q, v, a: 95.0 * a + 8.0 * np.sign(v), known)
    assert made.model.left_out == ("inertia", "sensor.gain")


@pytest.mark.parametrize(("over_cutoff", "most"), [(0.2, 0.01), (0.5, 0.03), (1.0, 0.08)])
def test_a_load_without_play_moves_with_its_joint(over_cutoff: float, most: float) -> None:
    """A sine at a frequency over that of the cut-off, of which a period has 16 samples."""
    t, w = np.arange(3200) / 16.0, 2.0 * math.pi * over_cutoff
    m: Any = SimpleNamespace(q=np.sin(w * t), v=w * np.cos(w * t), a=-(w**2) * np.sin(w * t), step=1.0 / 16.0)
    left = (_carried(m, 1e-9, 0.0, 0) - m.a)[160:]
    assert float(np.sqrt(np.mean(left**2))) < most * w**2 / math.sqrt(2.0)


def test_a_transmission_that_wavers_passes_a_constant_load_on_by_its_ratio() -> None:
    """Virtual work: F dq = c d(q + e sin(n q + φ))."""
    q = np.linspace(0.0, 7.0, 200)
    m, p = SimpleNamespace(q=q, v=1.0 + 0.0 * q, a=0.0 * q), SimpleNamespace(amplitude=0.05, order=2.0, phase=0.3)
    found = EFFECTS["drive.transmission_error"].law(m, p, lambda q, v, a: np.full_like(q, 10.0))
    np.testing.assert_allclose(found, 10.0 * 0.05 * 2.0 * np.cos(2.0 * q + 0.3), atol=1e-12)


def test_an_effect_of_ones_own_follows_the_models_parameters(tmp_path) -> None:
    """One that calls `base`: its force at another mass is not that of the mass before."""
    text = FILE + (
        "\nfrom discrepancy.drives import DriveEffect, Size\n"
        "own_effects = (DriveEffect('gear', 'Gears lose a share.', 'F += c f', 'ours',\n"
        "    (Size('share', 'c', '', (0.1,), 0.0, 5.0, 0.0),), \n"
        "    lambda m, p, base: p.share * base(m.q, m.v, m.a) * m.v),)\n"
    )
    models = [subject(tmp_path, lambda t, q, v, a: 95.0 * a, text).model for _ in range(2)]
    one = models[0].hypotheses()["gear"][0]
    light, heavy = (np.array([z, *one.coordinates([0.123])]) for z in (0.0, 1.0))
    models[0].compared(0, one, light)
    np.testing.assert_array_equal(models[0].compared(0, one, heavy)[0], models[1].compared(0, one, heavy)[0])


@pytest.mark.skipif(not isinstance(contact(), Dispatcher), reason="nothing is compiled")
def test_a_load_behind_play_is_compiled_anew_where_a_kernel_has_changed() -> None:
    """numba's key of it holds the hash of all kernel sources."""
    (held,) = (cell.cell_contents for cell in contact().py_func.__closure__)
    assert held == kernel_fingerprint()


@pytest.mark.parametrize(
    ("name", "force"),
    [
        ("sensor.mains_hum", lambda t, q, v, a: 5.0 * np.sin(2.0 * math.pi * 25.0 * t + 0.3)),
        ("cogging", lambda t, q, v, a: 5.0 * np.sin(400.0 * q + 0.3)),
    ],
)
def test_a_wave_near_the_cut_off_has_its_own_size(name: str, force, tmp_path) -> None:
    """The force is measured through the motion's kernel, and so is the wave that it is compared with: of a line of 25
    Hz at a cut-off of 17.6 Hz 4.2 of 5 N were told."""
    made = subject(tmp_path, lambda t, q, v, a: 95.0 * a + force(t, q, v, a), FILE + "\ncutoff = 17.6\n")
    problem, place = start_of(made, made.model.hypotheses()[name][0])
    found = values(problem, fit(problem, place, steps=20).place)
    assert abs(found[f"{name}.{'amplitude' if 'hum' in name else 'force'}"]) == pytest.approx(5.0, rel=0.01)
