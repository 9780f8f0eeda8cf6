"""Which files there are, their sizes, checksums and schemas."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq

from datagen.audit.words import Faults, rows_at_fault
from datagen.campaign import SUBSETS
from datagen.places.local import file_sha256
from datagen.schema import SCHEMA_VERSION, rejected_schema, schema
from datagen.shard import open_shard
from datagen.store import CARD, CROISSANT, REJECTED, SHARD_FOLDER

MANIFEST_KEYS: dict[str, type] = {
    "campaign": str, "seed": int, "count": int, "versions": dict, "config": dict, "records": int, "rejected": int,
    "classes": dict, "subsets": dict, "shards": list,
}  # fmt: skip
SHARD_KEYS: dict[str, type] = {
    "name": str, "rows": int, "first_item": int, "last_item": int, "bytes": int, "sha256": str
}  # fmt: skip


def manifest_faults(manifest: Mapping[str, Any]) -> Faults:
    """Faults of the manifest's own form; where there are any, nothing else can be judged."""
    yield from _keys("manifest.json", manifest, MANIFEST_KEYS)
    shards = manifest.get("shards")
    for number, entry in enumerate(shards if isinstance(shards, list) else []):
        if not isinstance(entry, dict):
            yield f"manifest.json: shards must hold mappings, got {entry!r}."
            continue
        yield from _keys(f"manifest.json, shard {number}", entry, SHARD_KEYS)
        if not re.fullmatch(rf"{SHARD_FOLDER}/shard-\d{{5,}}\.parquet", str(entry.get("name"))):
            rule = f"name must be {SHARD_FOLDER}/shard-NUMBER.parquet"
            yield f"manifest.json, shard {number}: {rule}, got {entry.get('name')!r}."


def _keys(owner: str, mapping: Mapping[str, Any], kinds: Mapping[str, type]) -> Faults:
    for name, kind in kinds.items():
        if type(mapping.get(name)) is not kind:
            yield f"{owner}: {name} must be given as {kind.__name__}, got {mapping.get(name)!r}."


def folder_faults(folder: Path, manifest: Mapping[str, Any]) -> Faults:
    """Files that are missing, left over or listed in no manifest."""
    for name in (REJECTED, CARD, CROISSANT):
        if not (folder / name).is_file():
            yield f"{name}: it must be there, got no such file."
    listed = [entry["name"] for entry in manifest["shards"]]
    if doubled := sorted({name for name in listed if listed.count(name) > 1}):
        yield f"manifest.json: a shard must be listed once, got {doubled[0]} more often."
    present = {path.relative_to(folder).as_posix() for path in (folder / SHARD_FOLDER).rglob("*") if path.is_file()}
    for name in sorted(present - set(listed)):
        yield f"{name}: {SHARD_FOLDER}/ must hold the shards of the manifest alone, got a file that it does not list."
    for path in sorted(folder.glob("*")):
        if path.suffix == ".part" or path.name.startswith("unfinished"):
            yield f"{path.name}: a finished data set must hold nothing left over from its making, got this."
    yield from _example_faults(folder)
    yield from _croissant_faults(folder, manifest)


def _example_faults(folder: Path) -> Faults:
    csv, truth = folder / "example.csv", folder / "example.json"
    if csv.is_file() != truth.is_file():
        here, missing = (csv, truth) if csv.is_file() else (truth, csv)
        yield f"{missing.name}: it must be there beside {here.name}, got no such file."
    if truth.is_file():
        yield from _json_faults(truth, "class")


def _croissant_faults(folder: Path, manifest: Mapping[str, Any]) -> Faults:
    path = folder / CROISSANT
    if not path.is_file():
        return
    found = list(_json_faults(path, "distribution"))
    yield from found
    if found:
        return
    files = {file.get("contentUrl"): file.get("sha256") for file in json.loads(path.read_text())["distribution"]}
    for entry in manifest["shards"]:
        if files.get(entry["name"]) != entry["sha256"]:
            rule = f"sha256 of {entry['name']} must be that of the manifest"
            yield f"{CROISSANT}: {rule}, got {files.get(entry['name'])!r}."


def _json_faults(path: Path, key: str) -> Faults:
    try:
        content = json.loads(path.read_text(encoding="utf-8"))
    except (json.JSONDecodeError, UnicodeDecodeError) as error:
        yield f"{path.name}: it must be JSON, got {error}."
        return
    if not isinstance(content, dict) or key not in content:
        yield f"{path.name}: it must be a mapping with {key}, got none."


def shard_faults(folder: Path, entry: Mapping[str, Any]) -> Faults:
    """Faults of a shard as a file; where there are any, its rows are not looked at."""
    path, name = folder / entry["name"], entry["name"]
    if not path.is_file():
        yield f"{name}: it must be there, as the manifest lists it, got no such file."
        return
    if path.stat().st_size != entry["bytes"]:
        yield f"{name}: it must have {entry['bytes']} bytes, got {path.stat().st_size}; it was cut or changed."
        return
    if (found := file_sha256(path)) != entry["sha256"]:
        yield f"{name}: its SHA-256 must be {entry['sha256']}, got {found}; it was changed."
        return
    with open_shard(path) as file:
        yield from schema_faults(name, file.schema_arrow, schema())
        if file.metadata.num_rows != entry["rows"]:
            yield f"{name}: it must have {entry['rows']} rows, as the manifest says, got {file.metadata.num_rows}."


def schema_faults(name: str, found: pa.Schema, expected: pa.Schema) -> Faults:
    """Every column that is missing, too many, or differs in type or metadata; then their order."""
    for column in expected.names:
        if column not in found.names:
            yield f"{name}: column {column} must be there, got none."
        elif not found.field(column).equals(expected.field(column), check_metadata=False):
            yield f"{name}: column {column} must be {_kind(expected.field(column))}, got {_kind(found.field(column))}."
        elif (metadata := found.field(column).metadata or {}) != expected.field(column).metadata:
            told = {key.decode(): value.decode() for key, value in metadata.items()}
            yield f"{name}: column {column} must carry the unit, description and rows of the schema, got {told}."
    for column in found.names:
        if column not in expected.names:
            yield f"{name}: its columns must be those of schema version {SCHEMA_VERSION}, got {column} as well."
    if set(found.names) == set(expected.names) and found.names != expected.names:
        yield f"{name}: its columns must be in the order of the schema, got {found.names[0]} first."
    if found.metadata != expected.metadata:
        yield f"{name}: it must carry format and schema version {SCHEMA_VERSION}, got {found.metadata}."


def _kind(field: pa.Field) -> str:
    return f"{field.type}{'' if field.nullable else ', never null'}"


def rejected_faults(folder: Path) -> tuple[pa.Table, list[str]]:
    """The table of rejected items and its faults."""
    path, empty = folder / REJECTED, rejected_schema().empty_table()
    if not path.is_file():
        return empty, []
    try:
        table = pq.ParquetFile(path).read()
    except (pa.ArrowInvalid, OSError) as error:
        return empty, [f"{REJECTED}: it must be Parquet, got {str(error).splitlines()[0]}."]
    if faults := list(schema_faults(REJECTED, table.schema, rejected_schema())):
        return empty, faults
    return table, list(_rejected_rows(table))


def _rejected_rows(table: pa.Table) -> Faults:
    items = table.column("item").to_numpy()
    before = np.concatenate(([-1], items[:-1]))
    rule = "item must be above that of the row before"
    yield from rows_at_fault(REJECTED, items, items <= before, rule, lambda at: int(items[at]))
    sentence = pc.match_substring_regex(table.column("reason"), r"\.$").to_numpy()  # type: ignore[attr-defined]
    rule = "reason must be a sentence"
    yield from rows_at_fault(REJECTED, items, ~sentence, rule, lambda at: table["reason"][at].as_py())
    subset = pc.is_in(table.column("subset"), value_set=pa.array(SUBSETS)).to_numpy()  # type: ignore[attr-defined]
    rule = "subset must be one of " + ", ".join(SUBSETS)
    yield from rows_at_fault(REJECTED, items, ~subset, rule, lambda at: table["subset"][at].as_py())
