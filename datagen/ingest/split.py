"""Files -> subsets and machine draws: what belongs together stays together."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence

import numpy as np

from datagen.campaign import Label
from datagen.ingest.settings import Split
from datagen.ingest.sources import FILE, Source
from indexer_env.errors import ParameterError, refuse


def labels_of(sources: Sequence[Source], split: Split, seed: int) -> list[Label]:
    """The label of each file.

    Classes are numbered from 1 by their sorted names; the code has one character per class, 1 at its own. A machine
    draw is what the split keeps together: a file, or all files with one value of the group `split.by`; draws are
    numbered from 0 in sorted order. Subsets: as the labels table says, else by share. Law: the draws of each set of
    classes, in the order of `numpy.random.Generator(PCG64(seed)).permutation`, are dealt so that each subset comes as
    near to its share as it can and has one draw at least where there are enough. Draws of several classes whose set has
    fewer draws than there are subsets are dealt together.

    Raises
    ------
    ParameterError
        A file lacks the group; a draw is in two subsets; some files have a subset in the table and others none.
    """
    names = sorted({source.class_name for source in sources})
    units = [_unit(source, split.by) for source in sources]
    draws = {unit: number for number, unit in enumerate(sorted(set(units)))}
    subsets = _given(sources, units, split.by) or _dealt(sources, units, split, seed)
    labels = []
    for source, unit in zip(sources, units, strict=True):
        place = names.index(source.class_name)
        code = "".join("1" if index == place else "0" for index in range(len(names)))
        labels.append(Label(place + 1, source.class_name, code, subsets[unit], draws[unit]))
    return labels


def groups_text(source: Source) -> str:
    """The column `groups` of a file."""
    return json.dumps(dict(sorted(source.groups.items())), ensure_ascii=False)


def _unit(source: Source, by: str) -> str:
    if by == FILE:
        return source.name
    if not source.groups.get(by):
        known = ", ".join([FILE, *source.groups])
        raise refuse("split", "by", f"one of {known}, with a value for each file", by, f"{source.name} has none")
    return source.groups[by]


def _given(sources: Sequence[Source], units: Sequence[str], by: str) -> dict[str, str]:
    """Subset of each unit as the labels table says; empty where it says none."""
    subsets: dict[str, str] = {}
    for source, unit in zip(sources, units, strict=True):
        if (source.subset is None) != (sources[0].subset is None):
            raise ParameterError(
                f"the labels table must give a subset to all files or to none, got {source.subset} for {source.name} "
                f"and {sources[0].subset} for {sources[0].name}."
            )
        if source.subset is not None and subsets.setdefault(unit, source.subset) != source.subset:
            raise ParameterError(
                f"all files of {by} {unit!r} must be in one subset, got {subsets[unit]} and {source.subset} "
                f"({source.name}); a network would be judged on machines that it has seen."
            )
    return subsets


def _dealt(sources: Sequence[Source], units: Sequence[str], split: Split, seed: int) -> dict[str, str]:
    classes: dict[str, set[str]] = {}
    for source, unit in zip(sources, units, strict=True):
        classes.setdefault(unit, set()).add(source.class_name)
    strata: dict[tuple[str, ...], list[str]] = {}
    for unit in sorted(classes):
        strata.setdefault(tuple(sorted(classes[unit])), []).append(unit)
    # A set of classes that too few machines have would go to the largest share alone.
    reach = sum(share > 0.0 for share in split.shares.values())
    rare = [names for names, members in strata.items() if len(names) > 1 and len(members) < reach]
    if rare:
        strata[()] = sorted(unit for names in rare for unit in strata.pop(names))
    rng = np.random.Generator(np.random.PCG64(seed))
    subsets: dict[str, str] = {}
    for stratum in sorted(strata):
        members = strata[stratum]
        places = [name for name, number in _counts(len(members), split.shares).items() for _ in range(number)]
        shuffled = [members[index] for index in rng.permutation(len(members))]
        subsets.update(zip(shuffled, places, strict=True))
    return subsets


def _counts(number: int, shares: Mapping[str, float]) -> dict[str, int]:
    """How many of `number` each subset gets: one each as far as they reach, the largest share first, then the one that
    lacks most."""
    order = sorted((name for name in shares if shares[name] > 0.0), key=lambda name: -shares[name])
    total = sum(shares.values())
    counts = {name: int(place < number) for place, name in enumerate(order)}
    while sum(counts.values()) < number:
        counts[max(order, key=lambda name: shares[name] / total * number - counts[name])] += 1
    return counts
