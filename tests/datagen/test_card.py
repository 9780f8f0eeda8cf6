"""The card and the Croissant file say what the data set holds, and say it in the words that the tools read."""

from __future__ import annotations

import json
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest
import yaml
from PIL import Image

from datagen.campaigns import make_campaign
from datagen.card import write_card
from datagen.generate import generate
from datagen.schema import COLUMNS
from datagen.shard import read_manifest, read_shards
from indexer_cli.places import open_place
from tests.patience import PATIENCE

HEADINGS = [
    "Classes and subsets", "Pictures", "Rejected items", "How to read it", "Columns", "How it was made", "Licence",
    "Time and hardware",
]  # fmt: skip


@pytest.fixture(scope="module")
def card(dataset) -> str:
    return (dataset / "README.md").read_text(encoding="utf-8")


def test_head_is_what_the_hub_reads(card):
    head = yaml.safe_load(card.split("---\n")[1])
    assert head["license"] == "mit" and head["pretty_name"] == "Cam indexing machine, table2, seed 3"
    assert head["size_categories"] == ["n<1K"] and head["task_categories"] == ["tabular-classification"]
    assert head["configs"][0]["data_files"] == [{"split": "train", "path": "data/*.parquet"}]


def test_headings_and_counts(card, dataset):
    assert [line[3:] for line in card.splitlines() if line.startswith("## ")] == HEADINGS
    manifest = read_manifest(dataset)
    for name, count in manifest["classes"].items():
        assert f"\n| {name} | {count} |\n" in card
    assert "\n| calibration | 8 |\n| control | 6 |\n| validation | 6 |\n" in card
    assert all(f"| `{name}` |" in card for name in COLUMNS)


def test_pictures_are_there_and_not_empty(card, dataset):
    for number in range(1, 7):
        assert f"](pictures/class-{number}.png)" in card
        pixels = np.asarray(Image.open(dataset / "pictures" / f"class-{number}.png").convert("L"))
        assert pixels.shape[0] > 300 and pixels.shape[1] > 800
        assert 0.005 < (pixels < 160).mean() < 0.5


def test_only_the_last_section_depends_on_the_run(card, dataset, tmp_path):
    """Another machine and time, the same data set."""
    folder = tmp_path / "set"
    folder.mkdir()
    for name in ("data", "rejected.parquet"):
        (folder / name).symlink_to(dataset / name)
    session = {"seconds": None, "processor": "abacus"}
    write_card(open_place(folder), read_manifest(dataset), {"seconds": 7.0, "interruptions": 1, "sessions": [session]})
    other = (folder / "README.md").read_text(encoding="utf-8")
    start = "## Time and hardware"
    assert other.split(start)[0] == card.split(start)[0] and "- processor: abacus" in other.split(start)[1]
    for name in ("croissant.json", "pictures/class-1.png"):
        assert (folder / name).read_bytes() == (dataset / name).read_bytes()


def test_rejected_items_stand_in_the_card_with_their_reasons(order, settings, tmp_path):
    settings["draws"]["machine"]["output_joint"]["stiffness"]["around"] = 1.5
    manifest = generate(replace(order, campaign=make_campaign(settings), count=40), tmp_path / "wild")
    text = (tmp_path / "wild" / "README.md").read_text(encoding="utf-8")
    section = text.split("## Rejected items")[1].split("\n## ")[0]
    assert f"{manifest['rejected']} of 40 items have no record" in section
    assert "stiffness must be" in section and section.count("\n| ") == 1 + min(10, manifest["rejected"])


READ_WITH_MLCROISSANT = """
import json, sys
import mlcroissant
opened = mlcroissant.Dataset(sys.argv[1])
found = [{**row, "records/code": row["records/code"].decode()} for row in opened.records("records")]
keys = ("records/item", "records/code", "records/record", "records/remaining_turns")
issues = opened.metadata.ctx.issues
print(json.dumps({"errors": list(issues.errors), "warnings": list(issues.warnings),
                  "rows": [[row[key] for key in keys] for row in found]}))
"""


def test_croissant_is_valid_and_its_records_are_read(dataset):
    """In a process of its own: the library's log handler closes the standard error that it once saw."""
    command = [sys.executable, "-c", READ_WITH_MLCROISSANT, str(dataset / "croissant.json")]
    done = subprocess.run(command, capture_output=True, text=True, timeout=PATIENCE, check=False)
    assert done.returncode == 0, done.stderr
    told = json.loads(done.stdout)
    assert told["errors"] == [] and "not standard" not in done.stderr
    assert all("datePublished" in warning for warning in told["warnings"])
    data = read_shards(dataset)
    assert [row[0] for row in told["rows"]] == list(range(20))
    assert told["rows"][7][1] == data.row(7)["code"] and told["rows"][7][3] is None
    np.testing.assert_array_equal(np.float32(told["rows"][7][2]), data.records[7])


def test_croissant_names_every_file_and_column(dataset):
    content = json.loads((dataset / "croissant.json").read_text())
    shards = {entry["name"]: entry for entry in read_manifest(dataset)["shards"]}
    files = [entry for entry in content["distribution"] if entry["@type"] == "cr:FileObject"]
    assert {file["contentUrl"]: file["sha256"] for file in files} == {
        name: entry["sha256"] for name, entry in shards.items()
    }
    fields = {field["name"]: field for field in content["recordSet"][0]["field"]}
    assert list(fields) == list(COLUMNS)
    assert fields["step"]["description"].endswith("[s]") and fields["record"]["repeated"] is True
