"""The data card: README.md with the head that the Hugging Face Hub reads, pictures, and Croissant metadata.

`write_card` is called once, when the manifest is known. All it writes follows from the data set, save the card's last
section (time and hardware).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq
import yaml

from datagen.croissant import croissant
from datagen.schema import GROUPS, RECORD
from datagen.store import CARD, CROISSANT, PICTURES, REJECTED, as_json
from indexer_cli.places import Place

LICENCE = "mit"
"""Of simulated data, as of the program that made them; measured ones belong to whoever measured."""

_SHOWN = [RECORD, "class", "class_name", "item", "sample_rate", "quantity", "unit", "source_channel"]

MOST_PICTURES = 12
MOST_REASONS = 10
_SIZES = ((10**3, "n<1K"), (10**4, "1K<n<10K"), (10**5, "10K<n<100K"), (10**6, "100K<n<1M"), (10**7, "1M<n<10M"))


@dataclass(frozen=True)
class PublishedFiles:
    """Splits of the Hub with the pattern of each one's files."""

    splits: tuple[tuple[str, str], ...] = (("train", "data/*.parquet"),)

    @property
    def by_subset(self) -> bool:
        """Whether the splits are the subsets."""
        return self.splits[0][0] != "train"

    def configs(self) -> list[dict[str, Any]]:
        """What stands in the head of a card."""
        files = [{"split": split, "path": pattern} for split, pattern in self.splits]
        return [{"config_name": "default", "data_files": files}]


_WHOLE = PublishedFiles()
"""A data set as it was made: one split, as each shard holds rows of all subsets."""


def write_card(
    place: Place, manifest: Mapping[str, Any], run: Mapping[str, Any], files: PublishedFiles = _WHOLE
) -> None:
    """Write README.md, croissant.json and pictures/ beside a data set's other files.

    Parameters
    ----------
    place : Place
        Folder or URL of the data set.
    manifest : mapping
        Its manifest.
    run : mapping
        What run.json holds, for the last section; empty where it was not recorded.
    files : PublishedFiles
        Which files are which split.

    Raises
    ------
    StoreError
        A file cannot be read or written.
    """
    # Not at the top: Matplotlib takes half a second to load, which every start of a command would wait for.
    from datagen.pictures import picture

    samples = _one_row_of_each_class(place, manifest)
    for row in samples:
        heading = f"class {row['class']}: {row['class_name']} (item {row['item']})"
        place.publish(_picture_name(row), picture(row, heading))
    about = {"name": title(manifest), "description": _description(manifest)}
    if not _is_measured(manifest):
        about["license"] = f"https://spdx.org/licenses/{LICENCE.upper()}.html"
    place.publish(CROISSANT, as_json(croissant(manifest, about)))
    place.publish(CARD, card(place, manifest, samples, run, files).encode())


def card(
    place: Place,
    manifest: Mapping[str, Any],
    samples: list[dict[str, Any]],
    run: Mapping[str, Any],
    files: PublishedFiles = _WHOLE,
) -> str:
    """The text of README.md; `samples` are the rows that have a picture."""
    sections = {
        "": _description(manifest),
        "Classes and subsets": "\n".join(_counts(manifest)),
        "Pictures": "\n".join(_pictures(samples)),
        "Rejected items": "\n".join(_rejected(place, manifest)),
        "How to read it": _READING_SPLITS if files.by_subset else _READING,
        "Columns": "\n".join(_columns()),
        "How it was made": _made(manifest),
        "Licence": "Not stated." if _is_measured(manifest) else "MIT, as the program that made it.",
        "Time and hardware": "\n".join(_sessions(run)),
    }
    body = "\n\n".join(f"## {name}\n\n{text}" if name else text for name, text in sections.items())
    head = yaml.safe_dump(_head(manifest, files), sort_keys=False, allow_unicode=True)
    return f"---\n{head}---\n\n# {title(manifest)}\n\n{body}\n"


def title(manifest: Mapping[str, Any]) -> str:
    """Name of the data set."""
    return f"Cam indexing machine, {manifest['campaign']}, seed {manifest['seed']}"


def _is_measured(manifest: Mapping[str, Any]) -> bool:
    """Whether the data set was ingested, from so many files, and not simulated."""
    return "files" in manifest


def _head(manifest: Mapping[str, Any], files: PublishedFiles) -> dict[str, Any]:
    """The YAML head, in the words of the Hub."""
    return {
        "pretty_name": title(manifest),
        "license": "unknown" if _is_measured(manifest) else LICENCE,
        "task_categories": ["tabular-classification"],
        "tags": ["time-series", "vibration", "fault-diagnosis", "cam-indexer", "backlash"],
        "size_categories": [next((name for size, name in _SIZES if manifest["records"] < size), "n>10M")],
        "configs": files.configs(),
    }


def _description(manifest: Mapping[str, Any]) -> str:
    return (
        f"{manifest['records']} labelled records of the acceleration of a cam indexing table with play and faults. "
        "One row is one record with its class, the machine's parameters, the faults' severities and how it was made or "
        "measured; units are SI and rad and stand in each column's metadata."
    )


def _counts(manifest: Mapping[str, Any]) -> Iterator[str]:
    for name, tally in (("class", manifest["classes"]), ("subset", manifest["subsets"])):
        yield from ("", f"| {name} | records |", "|---|---:|")
        yield from (f"| {key} | {records} |" for key, records in tally.items())
    yield ""
    yield "Subsets are split by machine (column `machine_draw`), never by row. The column `subset` tells them apart."
    if manifest.get("not_settled"):
        yield (
            f"In {manifest['not_settled']} records the turn does not repeat the one before it (column "
            "`warmup_settled`), as play makes successive turns differ."
        )


def _one_row_of_each_class(place: Place, manifest: Mapping[str, Any]) -> list[dict[str, Any]]:
    """The first row of each class, at most MOST_PICTURES, by class."""
    wanted = sum(1 for count in manifest["classes"].values() if count)
    found: dict[int, dict[str, Any]] = {}
    for entry in manifest["shards"]:
        if len(found) >= wanted:
            break
        with place.open(entry["name"]) as stream, pq.ParquetFile(stream) as file:
            for group in range(file.num_row_groups):
                classes = file.read_row_group(group, ["class"]).column(0)
                if new := sorted(set(pc.unique(classes).to_pylist()) - set(found)):  # type: ignore[attr-defined]
                    rows = file.read_row_group(group, _SHOWN)
                    places = [pc.index(classes, number).as_py() for number in new]
                    found.update(zip(new, rows.take(pa.array(places)).to_pylist(), strict=True))
    return [found[number] for number in sorted(found)[:MOST_PICTURES]]


def _picture_name(row: Mapping[str, Any]) -> str:
    return f"{PICTURES}/class-{row['class']}.png"


def _pictures(samples: list[dict[str, Any]]) -> Iterator[str]:
    yield "One record of each class, and its power spectral density."
    for row in samples:
        yield ""
        words = f"class {row['class']}, {row['class_name']}: record and spectrum of item {row['item']}"
        yield f"![{words}]({_picture_name(row)})"


def _rejected(place: Place, manifest: Mapping[str, Any]) -> Iterator[str]:
    if not manifest["rejected"]:
        yield f"None. Items without a record would stand in `{REJECTED}`, each with its reason."
        return
    yield f"{manifest['rejected']} of {manifest['count']} items have no record; `{REJECTED}` says why of each."
    yield ""
    yield "| item | class | stage | reason |"
    yield "|---:|---|---|---|"
    with place.open(REJECTED) as stream, pq.ParquetFile(stream) as file:
        rows = file.read(["item", "class_name", "stage", "reason"]).slice(0, MOST_REASONS).to_pylist()
    for row in rows:
        yield f"| {row['item']} | {row['class_name']} | {row['stage']} | {row['reason'].replace('|', chr(92) + '|')} |"
    if manifest["rejected"] > len(rows):
        yield f"| … | | | {manifest['rejected'] - len(rows)} more |"


_READING = """```python
from datagen.shard import read_shards          # all in memory: records (n, samples) and a table of the other columns
from datagen.batches import RecordStream       # shuffled batches for PyTorch, streamed
import pandas; pandas.read_parquet("data")     # or Polars, DuckDB, pyarrow.dataset, Ray Data: any Parquet tool
from datasets import load_dataset; load_dataset("parquet", data_dir="data", split="train")
```

`indexer check FOLDER` asserts the checksums and all that is promised of the rows; `indexer remake
FOLDER item=N` makes a simulated row again from its own columns, bit for bit."""


_READING_SPLITS = """```python
from datasets import load_dataset; load_dataset("FOLDER")             # splits calibration, control and validation
import pandas; pandas.read_parquet("data")                             # all of them; the column `subset` tells which
```

Learn from calibration, choose settings by control, judge once on validation. This is a copy for readers:
`indexer check` and `indexer remake` work on the data set that it was published from."""


def _columns() -> Iterator[str]:
    for group, columns in GROUPS.items():
        yield from ("", f"**{group}**", "", "| column | unit | what |", "|---|---|---|")
        for column in columns:
            yield f"| `{column.name}` | {column.unit} | {column.description} |"


def _made(manifest: Mapping[str, Any]) -> str:
    versions = ", ".join(f"{name} {version}" for name, version in manifest["versions"].items())
    config = yaml.safe_dump(dict(manifest["config"]), sort_keys=False, allow_unicode=True).strip()
    return (
        f"Campaign `{manifest['campaign']}`, seed {manifest['seed']}, {manifest['count']} items, by {versions}. "
        f"The configuration:\n\n```yaml\n{config}\n```"
    )


def _sessions(run: Mapping[str, Any]) -> Iterator[str]:
    if not run:
        yield "Not recorded."
        return
    yield f"{run['seconds']} s in all, interrupted {run['interruptions']} times."
    for session in run["sessions"]:
        yield ""
        yield from (f"- {name}: {value}" for name, value in session.items() if value is not None)
