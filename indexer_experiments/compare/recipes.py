"""Data sets of the comparison, as command lines of `datagen`."""

from __future__ import annotations

from datagen.recipes import Recipe


def but(recipe: Recipe, name: str, *overrides: str) -> Recipe:
    """A recipe with further arguments, of which the last on a key counts."""
    return Recipe(f"{recipe.name}-{name}", recipe.overrides + overrides)


def drawn(count: int, half_width: float = 0.1) -> Recipe:
    """Machines within ± half_width of the reference machine (paper §4.1: 0.1) with faults of any size, each fault in
    every second machine. The bench's sensor; subsets of 6, 2 and 2 machines of every ten.
    """
    sides, names = ("input_joint", "output_joint"), ("stiffness", "damping")
    joints = (f"machine.{side}.{name}" for side in sides for name in names)
    draws = {
        **dict.fromkeys(joints, f"{{around:{half_width:g}}}"),
        "operating_point.start_angle_deg": "{uniform:[0,2880]}",
        "operating_point.load_torque": "{around:0.1}",
    }
    return Recipe(
        f"drawn-{count}-{100 * half_width:g}percent",
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
    return Recipe(f"varied-{count}", ("campaign=random", f"campaign.machines={count}", "sensor=bench"))


TABLE2 = Recipe("table2", ("campaign=table2", "sensor=bench"))
BENCH = Recipe("bench", ("campaign=bench",))


def wear(lives: int) -> Recipe:
    """Machines run to failure, each recorded 30 times, by the bench's sensor."""
    return Recipe(
        f"wear-{lives}", ("campaign=wear", f"campaign.lives={lives}", "campaign.records_per_life=30", "sensor=bench")
    )
