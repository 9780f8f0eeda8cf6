import numpy as np

from datagen.recipes import Recipe, make
from indexer_experiments.recipes import labelled_by_code


def test_a_data_set_is_made_once_and_is_what_its_command_makes(table2, tmp_path):
    place = make(table2, 3, tmp_path)
    before = {path: path.stat().st_mtime_ns for path in place.rglob("*.parquet")}
    assert before and make(table2, 3, tmp_path) == place
    assert {path: path.stat().st_mtime_ns for path in place.rglob("*.parquet")} == before
    data = labelled_by_code(place)
    assert data.records.shape == (54, 1200) and data.sample_rate == 1000.0
    assert {name: int(rows.sum()) for name, rows in data.subsets.items()} == {
        "calibration": 18, "control": 18, "validation": 18,
    }  # fmt: skip
    assert len(np.unique(data.targets, axis=0)) == 6


def test_the_command_line_is_quoted_for_a_shell():
    recipe = Recipe("x", ("campaign=grid", "+campaign.axes.machine.table_inertia=[4,5]"))
    assert recipe.command(7) == "indexer generate campaign=grid '+campaign.axes.machine.table_inertia=[4,5]' seed=7"
