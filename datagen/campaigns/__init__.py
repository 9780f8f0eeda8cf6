"""The families of data sets, one file each; `campaign=NAME` on the command line picks
`conf/campaign/NAME.yaml`.

    table2  the paper's six classes
    bench   its 20 cases
    random  machines drawn by laws: whatever they are made of
    wear    run to failure
    own     one's own machine
    grid    every combination of values, made by `cells`
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from datagen.campaign import Campaign
from datagen.campaigns.bench import Bench
from datagen.campaigns.grid import Grid
from datagen.campaigns.own import Own
from datagen.campaigns.random import Random
from datagen.campaigns.table2 import Table2
from datagen.campaigns.wear import Wear
from indexer_env.build import from_mapping
from indexer_env.checks import check_choice
from indexer_env.errors import refuse

CAMPAIGNS: dict[str, type[Campaign]] = {family.name: family for family in (Table2, Bench, Random, Wear, Grid, Own)}
"""Family by the `name` that its YAML gives."""


def make_campaign(mapping: Mapping[str, Any]) -> Campaign:
    """The campaign of a mapping {name: FAMILY, ...settings of the family}."""
    if "name" not in mapping:
        raise refuse("campaign", "name", "one of " + ", ".join(CAMPAIGNS), None)
    check_choice("campaign", "name", mapping["name"], CAMPAIGNS)
    family = CAMPAIGNS[mapping["name"]]
    settings = {key: value for key, value in mapping.items() if key != "name"}
    return from_mapping(family, settings, owner="campaign")
