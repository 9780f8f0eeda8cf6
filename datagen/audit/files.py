"""Which files there are, their sizes, checksums and schemas."""

from __future__ import annotations

import hashlib
import json
import re
from collections.abc import Mapping
from typing import Any

import numpy as np
import pyarrow as pa
import pyarrow.compute as pc
import pyarrow.parquet as pq

from datagen.audit.words import Faults, rows_at_fault
from datagen.campaign import SUBSETS
from datagen.schema import SCHEMA_VERSION, rejected_schema, schema
from datagen.shard import open_shard
from datagen.store import CARD, CROISSANT, REJECTED, SHARD_FOLDER
from indexer_cli.places import Place
from indexer_cli.places.base import TEMPORARY

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


def folder_faults(place: Place, manifest: Mapping[str, Any]) -> Faults:
    """Files that are missing, left over or listed in no manifest."""
    present = set(place.names())
    for name in (REJECTED, CARD, CROISSANT):
        if name not in present:
            yield f"{name}: it must be there, got no such file."
    listed = [entry["name"] for entry in manifest["shards"]]
    if doubled := sorted({name for name in listed if listed.count(name) > 1}):
        yield f"manifest.json: a shard must be listed once, got {doubled[0]} more often."
    for name in sorted(name for name in present - set(listed) if name.startswith(f"{SHARD_FOLDER}/")):
        yield f"{name}: {SHARD_FOLDER}/ must hold the shards of the manifest alone, got a file that it does not list."
    for name in sorted({name.partition("/")[0] for name in present}):
        if name.endswith(TEMPORARY) or name.startswith("unfinished"):
            yield f"{name}: a finished data set must hold nothing left over from its making, got this."
    yield from _example_faults(place, present)
    yield from _croissant_faults(place, manifest)


def _example_faults(place: Place, present: set[str]) -> Faults:
    missing = {"example.csv", "example.json"} - present
    if len(missing) == 1:
        (name,) = missing
        (here,) = {"example.csv", "example.json"} - missing
        yield f"{name}: it must be there beside {here}, got no such file."
    yield from _json_faults("example.json", place.read("example.json"), "class")


def _croissant_faults(place: Place, manifest: Mapping[str, Any]) -> Faults:
    content = place.read(CROISSANT)
    found = list(_json_faults(CROISSANT, content, "distribution"))
    yield from found
    if found or content is None:
        return
    files = {file.get("contentUrl"): file.get("sha256") for file in json.loads(content)["distribution"]}
    for entry in manifest["shards"]:
        if files.get(entry["name"]) != entry["sha256"]:
            rule = f"sha256 of {entry['name']} must be that of the manifest"
            yield f"{CROISSANT}: {rule}, got {files.get(entry['name'])!r}."


def _json_faults(name: str, content: bytes | None, key: str) -> Faults:
    """Faults of a file that need not be there."""
    if content is None:
        return
    try:
        mapping = json.loads(content)
    except (json.JSONDecodeError, UnicodeDecodeError) as error:
        yield f"{name}: it must be JSON, got {error}."
        return
    if not isinstance(mapping, dict) or key not in mapping:
        yield f"{name}: it must be a mapping with {key}, got none."


def shard_faults(place: Place, entry: Mapping[str, Any]) -> Faults:
    """Faults of a shard as a file; where there are any, its rows are not looked at."""
    name, content = entry["name"], place.read(entry["name"])
    if content is None:
        yield f"{name}: it must be there, as the manifest lists it, got no such file."
        return
    if len(content) != entry["bytes"]:
        yield f"{name}: it must have {entry['bytes']} bytes, got {len(content)}; it was cut or changed."
        return
    if (found := hashlib.sha256(content).hexdigest()) != entry["sha256"]:
        yield f"{name}: its SHA-256 must be {entry['sha256']}, got {found}; it was changed."
        return
    with open_shard(place, name) as file:
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


def rejected_faults(place: Place) -> tuple[pa.Table, list[str]]:
    """The table of rejected items and its faults."""
    empty = rejected_schema().empty_table()
    if place.size(REJECTED) is None:
        return empty, []
    try:
        with place.open(REJECTED) as content, pq.ParquetFile(content) as file:
            table = file.read()
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
