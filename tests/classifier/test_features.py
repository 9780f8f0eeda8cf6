import numpy as np
import pytest
import scipy.signal
from hypothesis import given
from hypothesis import strategies as st

from classifier.features import FEATURES, Fft, Psd, Scaling, describe_features, make_features
from indexer_env.errors import ParameterError


def test_parseval_whole_band():
    """The integral of the PSD is the mean square of the windowed segments over that of the window."""
    rate, segment = 1000.0, 1000
    record = np.random.default_rng(0).standard_normal((1, 8200)) + 3.0
    psd = Psd(resolution_hz=1.0, maximum_hz=500.0)
    window = 0.5 * (1 - np.cos(2 * np.pi * np.arange(segment) / segment))
    power = []
    for first in range(0, 8200 - segment + 1, segment // 2):
        part = record[0, first : first + segment]
        power.append(np.sum((window * (part - part.mean())) ** 2) / np.sum(window**2))
    assert len(power) == 15
    assert psd.density(record, rate).sum() * 1.0 == pytest.approx(np.mean(power), rel=1e-12)


@pytest.mark.parametrize("resolution", [0.5, 1.0, 1000 / 501, 64.0])
def test_densities_are_those_of_scipy(resolution):
    """Segments of even and odd length, up to half the rate."""
    records = np.random.default_rng(4).standard_normal((3, 8200)) + 1.0
    psd = Psd(resolution_hz=resolution, maximum_hz=500.0)
    frequencies, densities = scipy.signal.welch(records, 1000.0, nperseg=psd.segment(1000.0))
    assert psd.frequencies(1000.0) == pytest.approx(frequencies)
    assert psd.density(records, 1000.0) == pytest.approx(densities, rel=1e-12)


def test_a_sine_lands_in_its_bin_with_half_its_amplitude_squared():
    time = np.arange(8200) / 1000
    density = Psd().density(2.0 * np.sin(2 * np.pi * 15 * time)[None], 1000.0)[0]
    assert np.argmax(density) == 15
    # A Hann window spreads a line at a bin's centre over that bin and its two neighbours, 1/6 : 4/6 : 1/6.
    assert density[14:17] == pytest.approx(np.array([1, 4, 1]) / 6 * 2.0**2 / 2)
    assert np.delete(density, [14, 15, 16]).max() < 1e-20


def test_an_offset_does_not_reach_the_features():
    record = np.random.default_rng(1).standard_normal((1, 8200))
    assert Psd().compute(record + 100.0, 1000.0) == pytest.approx(Psd().compute(record, 1000.0), rel=1e-9, abs=1e-12)


@pytest.mark.parametrize(("resolution", "count", "spacing"), [(1, 101, 1.0), (0.5, 201, 0.5), (64, 2, 62.5)])
def test_frequencies(resolution, count, spacing):
    frequencies = Psd(resolution_hz=resolution).frequencies(1000.0)
    assert frequencies == pytest.approx(spacing * np.arange(count))


def test_records_do_not_touch_each_other(monkeypatch):
    records = np.random.default_rng(2).standard_normal((7, 2000)).astype(np.float32)
    together = Psd().compute(records, 1000.0)
    assert together.shape == (7, 101)
    monkeypatch.setattr("classifier.features._CHUNK", 3)
    assert np.array_equal(Psd().compute(records, 1000.0), together)
    assert np.array_equal(Psd().compute(records[4:5], 1000.0)[0], together[4])


def test_log_features_are_logarithms_of_the_densities():
    records = np.random.default_rng(3).standard_normal((2, 2000))
    log = Psd(scale="log").compute(records, 1000.0)
    assert 10**log == pytest.approx(Psd().compute(records, 1000.0))
    assert np.isfinite(Psd(scale="log").compute(np.zeros((1, 2000)), 1000.0)).all()


@pytest.mark.parametrize("kind", FEATURES)
def test_features_are_made_again_from_their_description(kind):
    features = FEATURES[kind](maximum_hz=40.0)
    assert make_features(describe_features(features)) == features


@pytest.mark.parametrize(
    ("mapping", "words"),
    [
        ({"kind": "psdd"}, "did you mean 'psd'"),
        ({"kind": "psd", "resolution": 1.0}, "resolution_hz"),
        ({"kind": "psd", "resolution_hz": 0.0}, "resolution_hz must be .*> 0 Hz"),
        ({"kind": "psd", "resolution_hz": "1"}, "resolution_hz must be"),
        ({"kind": "psd", "resolution_hz": 200.0}, "<= features.maximum_hz"),
        ({"kind": "psd", "scale": "dB"}, "one of linear, log"),
    ],
)
def test_bad_features_are_refused(mapping, words):
    with pytest.raises(ParameterError, match=words):
        make_features(mapping)


def test_records_that_cannot_give_the_features_are_refused():
    with pytest.raises(ParameterError, match="half the sample rate = 75 Hz"):
        Psd().compute(np.zeros((1, 1000)), 150.0)
    with pytest.raises(ParameterError, match=r">= 2 Hz for records of 0\.5 s"):
        Psd().compute(np.zeros((1, 500)), 1000.0)


@given(st.integers(0, 2**32 - 1))
def test_scaling_takes_the_fitted_range_to_the_unit_interval(seed):
    values = np.random.default_rng(seed).lognormal(size=(5, 4), sigma=3)
    scaled = Scaling.fit(values).apply(values)
    assert scaled.min(axis=0) == pytest.approx(0, abs=0)
    assert scaled.max(axis=0) == pytest.approx(1, abs=1e-15)


def test_a_feature_that_does_not_vary_becomes_zero():
    scaling = Scaling.fit(np.array([[1.0, 2.0], [1.0, 4.0]]))
    assert np.array_equal(scaling.apply(np.array([[5.0, 3.0]])), [[0.0, 0.5]])


@pytest.mark.parametrize(("low", "high"), [([0.0], [1.0, 2.0]), ([2.0], [1.0]), ([np.nan], [1.0]), ([0.0], [np.inf])])
def test_a_scaling_without_a_range_is_refused(low, high):
    with pytest.raises(ParameterError, match=r"Scaling\.low"):
        Scaling(np.array(low), np.array(high))


def test_a_line_of_the_whole_record_has_its_amplitude():
    """41 periods in 8.2 s: the line at 5 Hz; the mean, and what follows the 8.2 s, count for nothing."""
    time = np.arange(9000) / 1000
    record = np.where(time < 8.2, 3.0 * np.sin(2 * np.pi * 5 * time + 0.4) + 7.0, 1e3)[None]
    fft = Fft(maximum_hz=12.5)
    frequencies, amplitudes = fft.frequencies(1000.0), fft.compute(record, 1000.0)[0]
    assert len(frequencies) == 102 and frequencies[0] == pytest.approx(1 / 8.2)
    assert frequencies[np.argmax(amplitudes)] == pytest.approx(5.0)
    assert amplitudes.max() == pytest.approx(3.0) and np.sort(amplitudes)[-2] < 1e-9


def test_the_periodogram_of_all_lines_has_the_record_s_variance():
    """Parseval, with the line at half the rate counted twice as the docstring says: an odd length has none."""
    record = np.random.default_rng(4).standard_normal((2, 1001)) + 5.0
    fft = Fft(maximum_hz=500.0, duration_s=1.001)
    assert fft.density(record, 1000.0).sum(axis=1) / 1.001 == pytest.approx(record.var(axis=1))


@pytest.mark.parametrize(
    ("mapping", "words"),
    [
        ({"duration_s": 0.0}, "duration_s must be a finite number > 0 s"),
        ({"maximum_hz": 0.1}, "maximum_hz must be >= 1 / features.duration_s"),
        ({"maximum_hz": 600.0}, "half the sample rate"),
        ({"duration_s": 9.0}, "duration_s must be <= 8.2 s"),
        ({"resolution_hz": 1.0}, "resolution_hz"),
    ],
)
def test_an_fft_that_cannot_be_is_refused(mapping, words):
    with pytest.raises(ParameterError, match=words):
        make_features({"kind": "fft", **mapping}).compute(np.zeros((1, 8200)), 1000.0)
