"""What was composed before changes nothing that is composed later."""

from pathlib import Path

import pytest
from hydra import compose, initialize_config_dir

from indexer_cli.arguments import with_files
from indexer_env.presets import config_dir
from tests import compositions


@pytest.mark.parametrize("machine", ["machine=reference", f"machine={config_dir() / 'machine' / 'reference.yaml'}"])
def test_a_composition_leaves_the_next_one_as_it_was(machine: str, tmp_path: Path) -> None:
    """With a file of one's own Hydra has read the root before it knows of that file."""
    compositions.files.clear()
    compositions.merged.clear()
    for given, noise in (("known.noise=1", 1), ("known.noise=2", 2), ("out=y", None)):
        overrides = [machine, "held_out=[b.csv]"] if noise else []
        with initialize_config_dir(str(config_dir()), version_base="1.3"):
            config = compose("explain", with_files(["measured=a", "out=x", given, *overrides], tmp_path))
        assert config.known.noise == noise and config.held_out == (["b.csv"] if noise else [])
