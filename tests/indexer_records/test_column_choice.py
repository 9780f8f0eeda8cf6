"""Each channel has the rate and the time that its file states for it, and not those of another."""

from __future__ import annotations

import h5py
import numpy as np
import pytest
import pyuff
import scipy.io
from nptdms import ChannelObject, TdmsWriter

from indexer_env.errors import SignalError
from indexer_records.measured import Reading, read_recording, read_signal

COUNT = 200
FAST, SLOW = np.arange(COUNT) / 25600.0, np.arange(COUNT) / 1000.0
WAVE = np.round(np.sin(0.3 * np.arange(COUNT)), 6)


def refusal(path, **options) -> str:
    with pytest.raises(SignalError) as caught:
        read_signal(path, **options)
    return str(caught.value)


def mat(path, variables):
    scipy.io.savemat(path, variables)
    return path


def hdf5(path, content, **attributes):
    with h5py.File(path, "w") as file:
        for name, values in content.items():
            file[name] = values
        for place, rate in attributes.items():
            file[place].attrs["fs"] = rate
    return path


def rate(path, channel) -> float:
    return read_signal(path, signal_column=channel, unit="g").sample_rate


# -------------------------------------------------------------------------------------------- rates


def test_each_structure_of_a_mat_has_its_own_rate(tmp_path):
    runs = {"run1": {"fs": 1000.0, "acc": WAVE}, "run2": {"fs": 25600.0, "sub": {"acc": WAVE}}}
    path = mat(tmp_path / "a.mat", runs)
    assert (rate(path, "run1.acc"), rate(path, "run2.sub.acc")) == (1000.0, 25600.0)


def test_each_group_of_an_hdf5_has_its_own_rate(tmp_path):
    content = {"A/fs": 1000.0, "A/acc": WAVE, "B/fs": 25600.0, "B/sub/acc": WAVE, "C/acc": WAVE}
    path = hdf5(tmp_path / "a.h5", content, C=500.0)
    assert (rate(path, "A/acc"), rate(path, "B/sub/acc"), rate(path, "C/acc")) == (1000.0, 25600.0, 500.0)


def test_the_rate_of_a_group_far_above_counts(tmp_path):
    path = hdf5(tmp_path / "a.h5", {"A/b/c/acc": WAVE, "acc": WAVE}, A=500.0)
    assert rate(path, "A/b/c/acc") == 500.0
    assert "has no time column" in refusal(path, signal_column="acc", unit="g")


@pytest.mark.parametrize("ending", ["mat", "h5"])
def test_rates_elsewhere_are_taken_only_where_they_agree(tmp_path, ending):
    def written(first: float, second: float):
        if ending == "mat":
            return mat(tmp_path / "a.mat", {"p": {"fs": first}, "q": {"fs": second}, "acc": WAVE})
        return hdf5(tmp_path / "a.h5", {"p/fs": first, "q/fs": second, "acc": WAVE})

    assert rate(written(1000.0, 1000.0), "acc") == 1000.0
    assert "give the sampling rate (read.sample_rate=HZ)" in refusal(
        written(1000.0, 500.0), signal_column="acc", unit="g"
    )


def test_a_rate_that_the_column_of_time_contradicts_is_refused_until_one_is_chosen(tmp_path):
    path = mat(tmp_path / "a.mat", {"acc": WAVE, "t": FAST, "fs": 25.6})
    said = refusal(path, unit="g")
    assert "one sampling rate of 'acc', got 25.6 Hz and, by its time column 't', 25600 Hz; name that column" in said
    assert read_signal(path, unit="g", time_column="t").sample_rate == pytest.approx(25600.0)
    assert read_signal(path, unit="g", sample_rate=25600.0).sample_rate == pytest.approx(25600.0)
    assert read_signal(path, unit="g", sample_rate=25.6).sample_rate == 25.6
    assert "leave read.sample_rate out" in refusal(path, unit="g", sample_rate=1000.0)


@pytest.mark.parametrize("time", [FAST * 1.0005, 1.0 * np.arange(COUNT), FAST[:-1]], ids=["clock", "counter", "other"])
def test_a_rate_is_contradicted_by_no_clock_no_counter_and_no_time_of_another_channel(tmp_path, time):
    assert rate(mat(tmp_path / "a.mat", {"acc": WAVE, "t": time, "fs": 25600.0}), "acc") == 25600.0


# -------------------------------------------------------------------------------------------- columns of time


def test_each_group_has_its_own_time(tmp_path):
    path = hdf5(tmp_path / "a.h5", {"A/time": SLOW, "A/acc": WAVE, "B/time": FAST, "B/acc": WAVE})
    assert rate(path, "A/acc") == pytest.approx(1000.0)
    assert rate(path, "B/acc") == pytest.approx(25600.0)


@pytest.mark.parametrize(
    ("times", "told"),
    [(SLOW, ""), (SLOW + 4e-4, ""), (SLOW + 0.25, "got some 0.25 s later"), (SLOW * 1.02 - 1.0, "s earlier")],
)
def test_a_pulse_by_another_clock_is_refused(tmp_path, times, told):
    path = hdf5(tmp_path / "a.h5", {"A/time": SLOW, "A/acc": WAVE, "B/time": times, "B/mark": WAVE})
    reading = Reading(signal_column="acc", unit="g")
    if not told:
        assert read_recording(path, reading, "mark").pulse is not None
        return
    with pytest.raises(SignalError, match="'B/mark' must be sampled at the same times as 'A/acc'.*" + told):
        read_recording(path, reading, "mark")
    with pytest.raises(SignalError, match=r"must be sampled at the same times|must have one length, rate"):
        read_recording(path, Reading(signal_column=("acc", "mark"), unit="g"))


@pytest.mark.parametrize("late", [0.0, 0.25])
@pytest.mark.parametrize("dated", [0, 1, 2])
def test_a_pulse_of_a_tdms_that_starts_at_another_time_is_refused(tmp_path, late, dated):
    """By its offset where not all channels have a date, else by date and offset together."""
    channels = []
    for number, (name, after) in enumerate({"acc": 0.0, "mark": late}.items()):
        stated = {"wf_increment": 1e-3, "unit_string": "g", "wf_start_offset": after if dated < 2 else 0.0}
        if number < dated:
            since = np.timedelta64(round(1e6 * after) if dated == 2 else 0, "us")
            stated["wf_start_time"] = np.datetime64("2026-11-02T10:00:00") + since
        channels.append(ChannelObject("run", name, WAVE, properties=stated))
    with TdmsWriter(tmp_path / "a.tdms") as writer:
        writer.write_segment(channels)
    reading = Reading(signal_column="acc")
    if late:
        with pytest.raises(SignalError, match=r"'run/mark' must be sampled at the same times .*got some 0.25 s later"):
            read_recording(tmp_path / "a.tdms", reading, "mark")
    else:
        assert read_recording(tmp_path / "a.tdms", reading, "mark").pulse is not None


def test_a_tdms_without_an_interval_of_its_own_has_no_rate(tmp_path):
    """LabVIEW writes wf_increment = 1 s where nobody sets it."""
    stated = {"wf_increment": 1.0, "unit_string": "g"}
    with TdmsWriter(tmp_path / "a.tdms") as writer:
        writer.write_segment([ChannelObject("run", "acc", WAVE, properties=stated)])
    assert "give the sampling rate (read.sample_rate=HZ)" in refusal(tmp_path / "a.tdms")
    assert read_signal(tmp_path / "a.tdms", sample_rate=1000.0).sample_rate == 1000.0


def test_each_structure_has_its_own_time(tmp_path):
    path = mat(tmp_path / "a.mat", {"p": {"time": SLOW, "acc": WAVE}, "q": {"t": FAST, "acc": WAVE}})
    assert rate(path, "p.acc") == pytest.approx(1000.0)
    assert rate(path, "q.acc") == pytest.approx(25600.0)


def test_the_time_in_a_structure_is_not_taken_for_the_record(tmp_path):
    signal = read_signal(mat(tmp_path / "a.mat", {"run": {"time": SLOW, "y": WAVE}}), unit="m/s^2")
    assert signal.sample_rate == pytest.approx(1000.0)
    np.testing.assert_array_equal(signal.values, WAVE)


def test_times_that_are_equally_near_must_be_named(tmp_path):
    path = mat(tmp_path / "a.mat", {"time_a": SLOW, "acc_a": WAVE, "time_b": FAST, "acc_b": WAVE})
    said = refusal(path, signal_column="acc_b", unit="g")
    assert "2 columns that may be the time of 'acc_b' ('time_a', 'time_b')" in said and "read.time_column=NAME" in said
    named = read_signal(path, signal_column="acc_b", time_column="time_b", unit="g")
    assert named.sample_rate == pytest.approx(25600.0)


def history(name, **changes):
    return pyuff.prepare_58(**{
        **dict(
            func_type=1, id1=name, rsp_node=1, rsp_dir=1, ref_node=1, ref_dir=1, data=WAVE.copy(), x=SLOW,
            abscissa_spacing=1, abscissa_min=0.0, abscissa_inc=1e-3, num_pts=COUNT, ord_data_type=4,
            abscissa_spec_data_type=17, ordinate_spec_data_type=12, orddenom_spec_data_type=0,
            ordinate_axis_units_lab="g", abscissa_axis_units_lab="s",
        ),
        **changes,
    })  # fmt: skip


def test_each_uneven_data_set_of_a_uff_has_its_own_time(tmp_path):
    path = tmp_path / "a.uff"
    sets = [
        history("X", abscissa_spacing=0, abscissa_inc=0.0),
        history("Y", abscissa_spacing=0, abscissa_inc=0.0, x=FAST),
    ]
    pyuff.UFF(str(path)).write_sets(sets, mode="overwrite")
    assert rate(path, "X") == pytest.approx(1000.0)
    assert rate(path, "Y") == pytest.approx(25600.0)


@pytest.mark.parametrize(("label", "step"), [("ms", 1.0), ("s", 1e-3), ("NONE", 1e-3), ("SEC", 1e-3)])
def test_the_step_of_a_uff_is_in_the_unit_of_its_abscissa(tmp_path, label, step):
    path = tmp_path / "a.uff"
    entry = history("X", abscissa_inc=step, x=step * np.arange(COUNT), abscissa_axis_units_lab=label)
    pyuff.UFF(str(path)).write_sets(entry, mode="overwrite")
    assert rate(path, "X") == pytest.approx(1000.0)


def test_a_uff_over_an_angle_has_no_rate_of_its_own(tmp_path):
    path = tmp_path / "a.uff"
    pyuff.UFF(str(path)).write_sets(history("X", abscissa_axis_units_lab="rad"), mode="overwrite")
    assert "sample_rate" in refusal(path)
    assert read_signal(path, sample_rate=1000.0).sample_rate == 1000.0


def test_a_name_that_begins_with_time_is_a_record_where_it_has_the_unit_of_one(tmp_path):
    path = tmp_path / "a.csv"
    rows = [f"{k / 1000},{value}" for k, value in enumerate(WAVE)]
    path.write_text("\n".join(["Time [s],Time Waveform [g]", *rows, ""]))
    assert read_signal(path).sample_rate == pytest.approx(1000.0)


# -------------------------------------------------------------------------------------------- a rate in place of a time


def test_a_clock_gives_way_to_a_rate(tmp_path):
    path = tmp_path / "a.csv"
    rows = [f"2024-01-01 12:00:{k / 1000:06.3f},{value}" for k, value in enumerate(WAVE)]
    path.write_text("\n".join(["timestamp,acc [m/s^2]", *rows, ""]))
    assert "repair the cell or cut the record before it, or give the sampling rate in its place" in refusal(path)
    signal = read_signal(path, sample_rate=1000.0)
    assert signal.sample_rate == 1000.0
    np.testing.assert_array_equal(signal.values, WAVE)


def test_the_first_column_without_a_header_is_no_time_where_a_rate_is_given(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text("\n".join(f"{value},{2 * value}" for value in WAVE))
    assert "2 columns that may be the record" in refusal(path, sample_rate=1000.0, unit="g")
    for name, factor in (("column 1", 1.0), ("column 2", 2.0)):
        signal = read_signal(path, sample_rate=1000.0, unit="m/s^2", signal_column=name)
        np.testing.assert_allclose(signal.values, factor * WAVE)


def test_a_time_that_ascends_still_states_the_rate(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text("\n".join(f"{time:.3f},{value}" for time, value in zip(SLOW, WAVE, strict=True)))
    assert "leave read.sample_rate out" in refusal(path, sample_rate=500.0, unit="g")


@pytest.mark.parametrize("first", [0, 1])
def test_a_column_that_counts_samples_is_no_time_where_a_rate_is_given(tmp_path, first):
    path = tmp_path / "a.csv"
    path.write_text("\n".join(f"{first + k},{value}" for k, value in enumerate(WAVE)))
    assert "or give the sampling rate where it counts samples" in refusal(path, unit="g")
    signal = read_signal(path, sample_rate=1000.0, signal_column="column 2", unit="m/s^2")
    assert signal.sample_rate == 1000.0
    np.testing.assert_array_equal(signal.values, WAVE)


def test_milliseconds_that_count_samples_still_state_the_rate(tmp_path):
    path = tmp_path / "a.csv"
    path.write_text("\n".join(["time [ms],acc [g]", *(f"{k},{value}" for k, value in enumerate(WAVE))]))
    assert "leave read.sample_rate out" in refusal(path, sample_rate=500.0)


def test_a_time_that_is_named_stands_above_the_rate_of_the_file(tmp_path):
    path = mat(tmp_path / "a.mat", {"fs": 1000.0, "time": np.arange(COUNT) / 2000.0, "acc": WAVE})
    assert "must state one sampling rate" in refusal(path, unit="g")
    assert read_signal(path, unit="g", time_column="time").sample_rate == pytest.approx(2000.0)


# -------------------------------------------------------------------------------------------- the pulse


@pytest.mark.parametrize("beside", [{}, {"mark": WAVE}])
def test_the_only_acceleration_is_no_pulse(tmp_path, beside):
    path = mat(tmp_path / "a.mat", {"time": SLOW, "acc": WAVE, **beside})
    with pytest.raises(SignalError, match=r"pulse\.column must be another channel than the record, got 'acc'"):
        read_recording(path, Reading(unit="g"), "acc")


def test_a_pulse_named_without_its_group_is_no_record(tmp_path):
    path = hdf5(tmp_path / "a.h5", {"A/vib": WAVE, "A/tacho": np.sign(WAVE)}, A=1000.0)
    recording = read_recording(path, Reading(unit="g"), "tacho")
    assert recording.channels == ("A/vib",)
    assert recording.pulse is not None
    np.testing.assert_array_equal(recording.pulse, np.sign(WAVE))
