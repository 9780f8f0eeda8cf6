"""Several channels of a file as one record: their names in the column, their samples in the array."""

import numpy as np
import pytest

from indexer_records.channels import by_channel, channels_of, channels_text


@pytest.mark.parametrize("names", [("acc",), ("ax", "ay"), ("[0]",), ('["ax", "ay"]',), ("[", "x|y"), ("größe", "b")])
def test_names_come_back_from_the_text(names):
    assert channels_of(channels_text(names)) == names


def test_one_channel_is_written_as_its_name_and_a_simulated_row_has_one():
    assert channels_text(["group/acc [x"]) == "group/acc [x"
    assert channels_of(None) == ("",)


def test_samples_stand_channel_after_channel():
    records = np.arange(12).reshape(2, 6)
    assert by_channel(records, 1) is records
    assert by_channel(records, 2)[1].tolist() == [[6, 7, 8], [9, 10, 11]]
