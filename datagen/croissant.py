"""Croissant metadata (mlcommons.org/croissant/1.0): what the files are, their checksums, and every column."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import pyarrow as pa

from datagen.schema import COLUMNS, SAMPLED, Column
from datagen.store import SHARD_FOLDER

CONFORMS_TO = "http://mlcommons.org/croissant/1.0"
_PARQUET = "application/x-parquet"
_PAPER = "Detection of various failure causes in complex mechanical systems by the use of Artificial Neural Networks"
_RECORDS, _SHARDS = "records", "shards"

_CONTEXT = {
    "@language": "en",
    "@vocab": "https://schema.org/",
    "citeAs": "cr:citeAs",
    "column": "cr:column",
    "conformsTo": "dct:conformsTo",
    "cr": "http://mlcommons.org/croissant/",
    "rai": "http://mlcommons.org/croissant/RAI/",
    "data": {"@id": "cr:data", "@type": "@json"},
    "dataType": {"@id": "cr:dataType", "@type": "@vocab"},
    "dct": "http://purl.org/dc/terms/",
    "equivalentProperty": "cr:equivalentProperty",
    "examples": {"@id": "cr:examples", "@type": "@json"},
    "extract": "cr:extract",
    "field": "cr:field",
    "fileObject": "cr:fileObject",
    "fileProperty": "cr:fileProperty",
    "fileSet": "cr:fileSet",
    "format": "cr:format",
    "includes": "cr:includes",
    "isLiveDataset": "cr:isLiveDataset",
    "jsonPath": "cr:jsonPath",
    "key": "cr:key",
    "md5": "cr:md5",
    "parentField": "cr:parentField",
    "path": "cr:path",
    "recordSet": "cr:recordSet",
    "references": "cr:references",
    "regex": "cr:regex",
    "repeated": "cr:repeated",
    "replace": "cr:replace",
    "samplingRate": "cr:samplingRate",
    "sc": "https://schema.org/",
    "separator": "cr:separator",
    "source": "cr:source",
    "subField": "cr:subField",
    "transform": "cr:transform",
}
"""The context that version 1.0 prescribes."""


def croissant(manifest: Mapping[str, Any], about: Mapping[str, str]) -> dict[str, Any]:
    """The metadata of a data set, as JSON-LD; `about` holds its name, description and, where known, its license.

    Every shard is a file with its SHA-256; one record set reads all of them, a field for each column, with its unit in
    the description. It holds no date, so that the same order gives the same bytes.
    """
    return {
        "@context": _CONTEXT,
        "@type": "sc:Dataset",
        "conformsTo": CONFORMS_TO,
        **about,
        "citeAs": _PAPER,
        "version": f"{manifest['schema_version']}.0.0",
        "distribution": [
            {
                "@type": "cr:FileSet",
                "@id": _SHARDS,
                "name": _SHARDS,
                "description": "All records, in the order of their items.",
                "encodingFormat": _PARQUET,
                "includes": f"{SHARD_FOLDER}/*.parquet",
            },
            *(_file(entry) for entry in manifest["shards"]),
        ],
        "recordSet": [
            {
                "@type": "cr:RecordSet",
                "@id": _RECORDS,
                "name": _RECORDS,
                "description": "One row is one record.",
                "key": {"@id": f"{_RECORDS}/item"},
                "field": [_field(column) for column in COLUMNS.values()],
            }
        ],
    }


def _file(entry: Mapping[str, Any]) -> dict[str, Any]:
    return {
        "@type": "cr:FileObject",
        "@id": entry["name"],
        "name": entry["name"],
        "contentUrl": entry["name"],
        "contentSize": f"{entry['bytes']} B",
        "encodingFormat": _PARQUET,
        "sha256": entry["sha256"],
    }


def _field(column: Column) -> dict[str, Any]:
    unit = f" [{column.unit}]" if column.unit else ""
    return {
        "@type": "cr:Field",
        "@id": f"{_RECORDS}/{column.name}",
        "name": column.name,
        "description": f"{column.description}{unit}",
        "dataType": _data_type(column.type),
        **({"repeated": True} if column.name in SAMPLED else {}),
        "source": {"fileSet": {"@id": _SHARDS}, "extract": {"column": column.name}},
    }


def _data_type(kind: pa.DataType) -> str:
    if pa.types.is_list(kind) or pa.types.is_floating(kind):
        return "sc:Float"
    if pa.types.is_integer(kind):
        return "sc:Integer"
    return "sc:Boolean" if pa.types.is_boolean(kind) else "sc:Text"
