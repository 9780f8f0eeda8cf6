"""Every data set of the comparison is an order that datagen takes."""

import pytest
from hydra import compose, initialize_config_dir
from omegaconf import OmegaConf

from datagen.order import Order, order_from
from indexer_env.presets import config_dir
from indexer_experiments.compare.novelty import NEW_MACHINES, new_machine
from indexer_experiments.compare.recipes import BENCH, TABLE2, but, drawn, varied, wear
from indexer_experiments.compare.robustness import CHANGES

CHANGED = {name: but(drawn(60), "changed", *change) for name, change in CHANGES.items()}
STRANGE = {name: new_machine(name, 60) for name in NEW_MACHINES}
PLAIN = {recipe.name: recipe for recipe in (TABLE2, BENCH, drawn(60), drawn(60, 0.2), varied(60), wear(4))}


def order(recipe) -> Order:
    with initialize_config_dir(str(config_dir()), version_base="1.3"):
        config = OmegaConf.to_container(compose("generate", [*recipe.overrides, "seed=0", "out=."]), resolve=True)
    assert isinstance(config, dict)
    return order_from({str(key): value for key, value in config.items()})


@pytest.mark.parametrize("recipe", [*CHANGED.values(), *STRANGE.values(), *PLAIN.values()], ids=lambda each: each.name)
def test_a_recipe_is_an_order_with_turns_of_one_length(recipe):
    assert order(recipe).run.samples == 8200


def test_no_two_recipes_are_the_same_but_for_the_one_that_changes_nothing():
    for recipes in (CHANGED, STRANGE):
        assert len({order(recipe).fingerprint for recipe in recipes.values()}) == len(recipes)
    assert order(CHANGED["as trained"]).fingerprint == order(drawn(60)).fingerprint


def test_folders_of_different_recipes_differ():
    names = [recipe.name for recipe in (*STRANGE.values(), drawn(60), drawn(60, 0.2), drawn(61), varied(60), wear(4))]
    assert len(set(names)) == len(names)
