"""Few records are enough to refuse what is far outside their range, and to accept others of their make."""

import dataclasses

import numpy as np
import pyarrow as pa
import pytest

from classifier.dataset import Dataset
from classifier.tasks.need import NotAvailable
from classifier.tasks.range import LEAST, MARGIN, REFUSED, Range, octaves
from datagen.recipes import Recipe, make
from datagen.shard import read_shards
from indexer_experiments.compare.recipes import drawn

NOTHING = np.empty(0)


def outside(part, records):
    return part.assess(NOTHING, NOTHING, np.atleast_2d(records))["is_outside"]


def test_twelve_records_refuse_what_is_strange_and_accept_the_rest_of_the_bench(few, strange_records):
    dataset, held = few
    part = Range.fit(dataset, NOTHING, NOTHING, 0)
    assert {name: bool(outside(part, record)[0]) for name, record in strange_records.items()} == dict.fromkeys(
        strange_records, True
    )
    assert not outside(part, held).any()
    level = part.assess(NOTHING, NOTHING, strange_records["ten times"][None])["level"]
    assert level == pytest.approx(10.0, rel=0.2)


def test_a_strange_spectrum_of_the_usual_level_is_refused_by_its_octaves(few, strange_records):
    part = Range.fit(few[0], NOTHING, NOTHING, 0)
    level = dataclasses.replace(part, reach=np.where(np.arange(len(part.reach)) == 0, part.reach, 99.0))
    for name in ("noise", "tone"):
        assert outside(part, strange_records[name]) and not outside(level, strange_records[name])


def test_the_highest_octave_is_the_recorder_s(few):
    """What is above a quarter of the rate is not judged, so that another anti-alias filter is no novelty."""
    part, record = Range.fit(few[0], NOTHING, NOTHING, 0), few[1][0]
    assert not outside(part, record + 0.02 * record.std() * np.resize([1.0, -1.0], record.size))


def with_records(dataset, records, machines=None):
    """A data set of these records alone, all for calibration."""
    table = pa.table({} if machines is None else {"machine_draw": machines})
    count = len(records)
    fields = {"subsets": np.full(count, "calibration"), "classes": np.ones(count, dtype=int), "table": table}
    # Its checks ask for the other subsets too.
    made = object.__new__(Dataset)
    made.__dict__.update({**dataset.__dict__, **fields, "records": records})
    return made


def with_levels(dataset, levels, machines=None):
    """White noise of these root mean squares in place of the records; seed 1."""
    noise = np.random.default_rng(1).standard_normal((len(levels), 1024))
    return with_records(dataset, np.asarray(levels)[:, None] * noise, machines)


@pytest.mark.parametrize("count", [LEAST, 10, 40])
def test_records_of_the_same_law_are_refused_as_seldom_as_promised(few, count):
    """Levels scatter by a quarter; 300 drawings of `count` records and one more, seed 2; three standard errors."""
    rng, refused = np.random.default_rng(2), []
    for _ in range(300):
        levels = np.exp(0.25 * rng.standard_normal(count + 1))
        part = Range.fit(with_levels(few[0], levels[:count]), NOTHING, NOTHING, 0)
        refused.append(outside(part, levels[count] * rng.standard_normal(1024))[0])
    assert np.mean(refused) <= REFUSED + 3 * np.sqrt(REFUSED / 300)


def test_files_of_many_turns_count_no_more_than_files_of_few(few):
    """Files' levels scatter by a quarter; one of 100 turns and five of two, and a turn of one more, seed 2."""
    rng, refused = np.random.default_rng(2), []
    files = np.repeat(np.arange(6), [100, 2, 2, 2, 2, 2])
    for _ in range(300):
        levels = np.exp(0.25 * rng.standard_normal(7))
        part = Range.fit(with_levels(few[0], levels[files], files), NOTHING, NOTHING, 0)
        refused.append(outside(part, levels[6] * rng.standard_normal(1024))[0])
    assert np.mean(refused) <= REFUSED + 3 * np.sqrt(REFUSED / 300)


def test_limits_are_no_narrower_than_a_calibration_of_the_sensor(few):
    """Ten times the same record: another 5 % higher is still taken, one 6 % higher is not."""
    record = few[1][0].astype(np.float64)
    part = Range.fit(with_records(few[0], np.tile(record, (10, 1))), NOTHING, NOTHING, 0)
    assert part.reach == pytest.approx(np.full(len(part.reach), MARGIN))
    assert not outside(part, 1.045 * record) and outside(part, 1.06 * record)


def test_turns_of_one_file_count_as_one(few):
    with pytest.raises(NotAvailable, match="5 independent records of calibration and control, 6 needed"):
        Range.fit(with_levels(few[0], np.linspace(1, 2, 30), np.repeat(np.arange(5), 6)), NOTHING, NOTHING, 0)
    Range.fit(with_levels(few[0], np.linspace(1, 2, 30), np.repeat(np.arange(6), 5)), NOTHING, NOTHING, 0)


def test_a_tone_lies_in_its_octave():
    """Of 1000 Hz the octaves begin at 125 … 250 Hz; a tone of 45 Hz is strongest from 31 to 62 Hz."""
    tone = np.sin(2 * np.pi * 45 * np.arange(8192) / 1000)
    level, *found = octaves(tone[None])[0]
    assert level == pytest.approx(np.log10(np.sqrt(0.5)), abs=1e-3)
    assert int(np.argmax(found)) == 2


def test_it_comes_back_bit_for_bit(few, strange_records):
    part = Range.fit(few[0], NOTHING, NOTHING, 0)
    again = Range.restore(part.body(), part.arrays())
    for name, column in part.assess(NOTHING, NOTHING, few[1]).items():
        assert np.array_equal(again.assess(NOTHING, NOTHING, few[1])[name], column)


@pytest.mark.slow
@pytest.mark.parametrize(
    "recipe",
    [
        Recipe("bench", ("campaign=bench",)),
        drawn(300),
        Recipe("varied", ("campaign=random", "sensor=bench", "campaign.machines=300")),
    ],
    ids=lambda recipe: recipe.name,
)
@pytest.mark.parametrize("count", [6, 10])
def test_how_often_few_records_refuse_wrongly_and_rightly(recipe, count, tmp_path_factory, few):
    """Limits of `count` records of two or three classes, 300 drawings: shares refused of the other records of these
    classes, as they are and changed, and of noise and a tone of that level (docs/explanation/classifier.md); seed 0."""
    folder = tmp_path_factory.getbasetemp() / "rates"
    data = read_shards(
        folder / f"{recipe.name}-0" if (folder / f"{recipe.name}-0").is_dir() else make(recipe, 0, folder)
    )
    names = np.array(data.table.column("class_name").to_pylist())
    rng, found = np.random.default_rng(0), {}
    time = np.arange(data.records.shape[1]) / 1000.0
    for _ in range(300):
        classes = rng.choice(np.unique(names), rng.choice([2, 3]), replace=False)
        rows = [rng.permutation(np.flatnonzero(names == name))[: -(-count // len(classes)) + 4] for name in classes]
        taught = np.concatenate([some[:-4] for some in rows])[:count]
        others = data.records[np.concatenate([some[-4:] for some in rows])].astype(np.float64)
        part = Range.fit(with_records(few[0], data.records[taught]), NOTHING, NOTHING, 0)
        level = others.std(axis=1, keepdims=True)
        tried = {
            "held out": others,
            "times 10": 10.0 * others,
            "times 0.1": 0.1 * others,
            "times 1.3": 1.3 * others,
            "noise": level * rng.standard_normal(others.shape),
            "tone of 33 Hz": np.sqrt(2.0) * level * np.sin(2.0 * np.pi * 33.0 * time),
        }
        for name, records in tried.items():
            found.setdefault(name, []).extend(outside(part, records))
    shares = {name: float(np.mean(values)) for name, values in found.items()}
    print(recipe.name, count, {name: f"{100 * share:.1f} %" for name, share in shares.items()})
    assert shares["held out"] <= 2 * REFUSED
    assert min(shares[name] for name in ("times 10", "times 0.1", "tone of 33 Hz")) == 1.0
    assert shares["noise"] > (0.8 if count < 10 else 0.99)
