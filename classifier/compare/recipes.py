"""Data sets of the comparison: each is a command line of `datagen`, made once and kept."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from hydra import compose, initialize_config_dir
from omegaconf import OmegaConf

from datagen.generate import generate
from datagen.order import order_from
from indexer_env.presets import config_dir


@dataclass(frozen=True)
class Recipe:
    """A kind of data set; its seed is given when it is made.

    name       of its folders
    overrides  arguments of ``python -m datagen``
    """

    name: str
    overrides: tuple[str, ...]

    def but(self, name: str, *overrides: str) -> Recipe:
        """The same with further arguments, of which the last on a key counts."""
        return Recipe(name, self.overrides + overrides)


def make(recipe: Recipe, seed: int, folder: Path) -> Path:
    """The data set of a recipe below a folder; one that is there is not made again.

    Raises as `datagen.generate.generate` does.
    """
    with initialize_config_dir(str(config_dir()), version_base="1.3"):
        config = OmegaConf.to_container(compose("datagen", [*recipe.overrides, f"seed={seed}", "out=."]), resolve=True)
    assert isinstance(config, dict)
    place = folder / f"{recipe.name}-{seed}"
    generate(order_from({str(key): value for key, value in config.items()}), place)
    return place


def drawn(count: int, half_width: float = 0.1) -> Recipe:
    """Machines within ± half_width of the reference machine (paper §4.1: 0.1), each with faults of any size: every fault
    is there in every second machine. The bench's sensor; subsets of 6, 2 and 2 machines of every ten.
    """
    joints = (
        f"machine.{joint}.{name}" for joint in ("input_joint", "output_joint") for name in ("stiffness", "damping")
    )
    draws = {
        **dict.fromkeys(joints, f"{{around:{half_width:g}}}"),
        "operating_point.start_angle_deg": "{uniform:[0,2880]}",
        "operating_point.load_torque": "{around:0.1}",
    }
    return Recipe(
        "drawn",
        (
            "campaign=grid",
            f"campaign.repeats={count}",
            "campaign.split={calibration:6,control:2,validation:2}",
            "sensor=bench",
            "faults.roller_crack={choice:[0,{uniform:[0.1,0.6]}]}",
            "faults.screw_looseness={choice:[0,{uniform:[0.1,1]}]}",
            "faults.backlash_deg={choice:[0,{uniform:[1,20]}]}",
            *(f"+campaign.draws.{path}={law}" for path, law in draws.items()),
        ),
    )


def varied(count: int) -> Recipe:
    """The campaign `random`: machines of half to twice the inertia, other speeds and loads, effects that are no faults,
    quiet and noisy sensors."""
    return Recipe("varied", ("campaign=random", f"campaign.machines={count}", "sensor=bench"))


TABLE2 = Recipe("table2", ("campaign=table2", "sensor=bench"))
BENCH = Recipe("bench", ("campaign=bench",))
