"""Print the standard effects of drives: ``python -m discrepancy.drives.effects``."""

from discrepancy.drives.effects import EFFECTS

for effect in EFFECTS.values():
    print(f"{effect.name}: {effect.sentence}\n    {effect.equation}\n    {effect.source}")
    for size in effect.sizes:
        print(f"    {size.name} [{size.dimension or '-'}] {size.meaning}")
