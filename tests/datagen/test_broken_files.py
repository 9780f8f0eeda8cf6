"""A measured file that is damaged anywhere becomes a Signal or is refused in one sentence."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from indexer_env.errors import SignalError
from indexer_records.measured import read_signal

GOOD = "time [s],acceleration [m/s^2]\n" + "".join(f"{k / 1000.0:.3f},{k % 7 - 3}\n" for k in range(40))


@given(
    st.lists(
        st.tuples(
            st.integers(0, len(GOOD) - 1),
            st.integers(0, 4),
            st.one_of(
                st.binary(max_size=4),
                st.sampled_from([b",", b";", b"\n", b'"', b"-", b"e", b"\r", b"1", b"\0"]),
            ),
        ),
        min_size=1,
        max_size=6,
    )
)
def test_a_broken_file_is_a_signal_or_a_sentence_never_a_traceback(tmp_path_factory, edits):
    content = GOOD.encode()
    for place, removed, added in edits:
        content = content[:place] + added + content[place + removed :]
    path = tmp_path_factory.getbasetemp() / "fuzzed.csv"
    path.write_bytes(content)
    try:
        signal = read_signal(path)
    except SignalError as error:
        assert "\n" not in str(error)
    else:
        assert np.isfinite(signal.values).all() and signal.sample_rate > 0
