"""Several records at one cut-off, and the noise of all that is measured in the noise of the comparison."""

import math
from pathlib import Path

import numpy as np
import pytest
import scipy.signal

from discrepancy.drives.channels import Record
from discrepancy.drives.door import subject_of
from discrepancy.drives.track import tracks_of
from tests.discrepancy.drives.made import FILE, drive, motion, start_of

PRESSED = """
parameters = {"mass": (95.0, "kg", 10.0), "area": (1e-3, "m^2", 1e-4)}
channels = {"time": "t", "q": "q", "force": "f", "pressure": "pressure"}


def force(q, v, a, u, t, p):
    return p.mass * a + p.area * u
"""


def _swinging(frequency: float, noise: float = 0.0) -> Record:
    """30 s of one sine of 0.1 m at 500 Hz; seed 1."""
    t, w = np.arange(15_000) / 500.0, 2.0 * math.pi * frequency
    q, rng = 0.1 * np.sin(w * t), np.random.default_rng(1)
    rows = {"q": q + noise * rng.standard_normal(len(t)), "force": -95.0 * w**2 * q}
    return Record(f"{frequency:g}_hz.csv", 500.0, rows, {"q": "m", "force": "N"})


def test_a_slow_record_leaves_a_fast_one_as_it_is(tmp_path: Path) -> None:
    """0.2 and 4 Hz: the cut-off holds the force of both."""
    records = [_swinging(0.2), _swinging(4.0)]
    tracks, _ = tracks_of(drive(tmp_path), records)
    for track, record in zip(tracks, records, strict=True):
        assert track.measured.var() > 0.9 * record.rows["force"].var()


def test_the_noise_of_a_slow_record_does_not_set_the_cut_off(tmp_path: Path) -> None:
    """0.1 mm of noise is as much as the slow record's acceleration at 2 Hz and above. The cut-off falls to where the
    fast record's motion is; it does not rise to where noise passes for motion."""
    (slow, fast), _ = tracks_of(drive(tmp_path), [_swinging(0.2, 1e-4), _swinging(4.0, 1e-4)])
    assert fast.cutoff == pytest.approx(4.0, rel=0.05)
    assert 95.0 * slow.motion_noise[2] < 1.0


def _level(folder: Path, text: str, rows: dict[str, np.ndarray], units: dict[str, str], cutoff: float = 20.0) -> float:
    made = subject_of(drive(folder, f"{text}\ncutoff = {cutoff}\n"), [Record("a.csv", 500.0, rows, units)])
    return start_of(made)[1].level(made.model)


def test_the_noise_of_an_input_counts(tmp_path: Path) -> None:
    """A pressure of 1 bar read within 2 kPa, which is 2 N, beside 0.2 N of the force's own; all values true. Seed 1."""
    t, q, _, a = motion()
    rng = np.random.default_rng(1)
    pressure = 1e5 * np.sin(2.0 * t)
    read = pressure + 2e3 * rng.standard_normal(len(t))
    force = 95.0 * a + 1e-3 * pressure + 0.2 * rng.standard_normal(len(t))
    units = {"q": "m", "force": "N", "pressure": "Pa"}
    assert 0.8 < _level(tmp_path, PRESSED, {"q": q, "force": force, "pressure": read}, units) ** 2 < 1.3


def test_the_noise_of_the_motion_counts_through_effects_that_are_known(tmp_path: Path) -> None:
    """A known spring of 100 kN/m turns 0.3 mm of the encoder's noise into 30 N a sample. Seed 1."""
    _, q, _, a = motion()
    rows = {"q": q + 3e-4 * np.random.default_rng(1).standard_normal(len(q)), "force": 90.0 * a + 1e5 * q}
    text = f"{FILE}\ncutoff = 3.0\nknown = {{'spring.linear': {{'stiffness': 1e5}}}}\n"
    model = subject_of(drive(tmp_path, text), [Record("a.csv", 500.0, rows, {"q": "m", "force": "N"})]).model
    (track,) = model.tracks
    alone = math.hypot(track.noise, 90.0 * track.motion_noise[2])
    assert model.noise[0] == pytest.approx(math.hypot(alone, 1e5 * track.motion_noise[0]), rel=1e-3)
    assert model.noise[0] > 1.5 * alone


def _pink(size: int) -> np.ndarray:
    """Noise of density 1/f and rms 1; seed 2."""
    k = np.fft.rfftfreq(size, 1.0 / size)
    row = np.fft.irfft(np.fft.rfft(np.random.default_rng(2).standard_normal(size)) / np.sqrt(np.maximum(k, 1.0)), size)
    return row / row.std()


def _filtered(size: int) -> np.ndarray:
    """White noise behind a low-pass of 15 Hz, rms 1, at 500 Hz; seed 2."""
    row = scipy.signal.lfilter(*scipy.signal.butter(2, 15.0 / 250.0), np.random.default_rng(2).standard_normal(size))
    return row / row.std()


@pytest.mark.parametrize(("made", "falls"), [(_pink, True), (_filtered, True), (None, False)])
def test_noise_that_falls_with_frequency_is_read_just_above_the_cut_off(made, falls: bool, tmp_path: Path) -> None:
    """2 N, all values true: the level is right within a factor of two, and a note says so.
    Read off the top of the band the noise would be 10 and more than 100 times too small; white noise stays as it is."""
    t, q, _, a = motion(40.0)
    row = np.random.default_rng(2).standard_normal(len(t)) if made is None else made(len(t))
    rows = {"q": q, "force": 90.0 * a + 2.0 * row}
    text = f"{FILE}\ncutoff = 12.0\n"
    subject = subject_of(drive(tmp_path, text), [Record("a.csv", 500.0, rows, {"q": "m", "force": "N"})])
    problem, place = start_of(subject)
    assert 0.5 < place.level(problem.model) < 2.0
    assert any("noise falls with frequency in a.csv" in note for note in subject.notes) == falls
    # a motion that could be asked for next has the noise of this one, in a band that is as wide as it is fast
    own = subject.model.noise[0]
    asked = {one.name: one.model.noise[0] for one in subject.measurements(subject.model)}
    assert asked["the same motion again"] == pytest.approx(own, rel=1e-6)
    slow, fast = (asked[f"the same path at {pace:g} times the speed"] for pace in (0.5, 2.0))
    assert slow < 0.75 * own and fast > 1.4 * own


@pytest.mark.parametrize("speed", [0.0, 0.02])
def test_a_record_at_a_standstill_or_a_constant_speed_changes_no_band(speed: float, tmp_path: Path) -> None:
    """Of its position's noise alone no band of a motion follows; seeds 1 and 2. It made the cut-off three times as
    high, behind which a compliance was found that is none."""
    rng, t = np.random.default_rng(2), np.arange(2000) / 500.0
    moving = _swinging(0.5, noise=2e-6)
    q = 0.05 + speed * t + 2e-6 * rng.standard_normal(len(t))
    rows = {"q": q, "force": 7.0 + 0.5 * rng.standard_normal(len(t))}
    still = Record("still.csv", 500.0, rows, {"q": "m", "force": "N"})
    alone, beside = (tracks_of(drive(tmp_path), records)[0][0].cutoff for records in ([moving], [moving, still]))
    # a short record asks for enough samples to compare, too
    assert beside <= max(alone, 240 / 5.0 * 500.0 / len(t))


def test_noise_that_is_stated_is_taken_as_it_is(tmp_path: Path) -> None:
    """White noise of 0.5 N at 500 Hz, of which 3.75 Hz leave 0.06 N: what friction does at reversals above that looks
    like noise that falls with frequency. Seeds 5 to 9."""
    found = []
    for seed in range(5, 10):
        rng = np.random.default_rng(seed)
        t, q, v, a = motion(shift=seed)
        force = 95.0 * a + 20.0 * np.sign(v) + 0.5 * rng.standard_normal(len(t))
        record = Record("a.csv", 500.0, {"q": q, "force": force}, {"q": "m", "force": "N"})
        model = subject_of(drive(tmp_path, FILE + "\ncutoff = 3.75\nnoise = 0.5\n"), [record]).model
        assert model.noise[0] == pytest.approx(0.06, rel=0.05) and not model.falling
        falling = subject_of(drive(tmp_path, FILE + "\ncutoff = 3.75\n"), [record]).model.noise[0]
        found.append(falling)
    assert max(found) > 0.5, "or nothing is shown here"
