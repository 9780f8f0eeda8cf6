"""From which size on a quantity is an alert, an alarm, a danger."""

from __future__ import annotations

from dataclasses import dataclass

from indexer_env.checks import check_number
from indexer_env.errors import refuse

LEVELS = ("normal", "alert", "alarm", "danger")
"""Levels in rising order: look when convenient, plan the repair, stop and repair."""


@dataclass(frozen=True)
class Limits:
    """Limits of one quantity, in its unit; each above the one before.

    Attributes
    ----------
    alert, alarm, danger : float
        Least size of each level.
    deadband : float
        Share of a limit [-] by which the size must fall below it before the level ends, in [0, 1).
    """

    alert: float
    alarm: float
    danger: float
    deadband: float = 0.2

    def __post_init__(self) -> None:
        for name in LEVELS[1:]:
            check_number("limits", name, getattr(self, name), low=0.0, low_open=True)
        if not self.alert < self.alarm < self.danger:
            rule = "limits that rise: alert < alarm < danger"
            raise refuse("limits", "alarm", rule, [self.alert, self.alarm, self.danger])
        check_number("alarms", "deadband", self.deadband, low=0.0, high=1.0, high_open=True)

    def level(self, value: float, held: int) -> int:
        """The level (0 to 3) of a size, given the level that holds now: a level is kept within its deadband."""
        for level in (3, 2, 1):
            limit = getattr(self, LEVELS[level])
            if value >= (limit if level > held else limit * (1.0 - self.deadband)):
                return level
        return 0

    @property
    def end(self) -> float:
        """The size at which the part's life is over."""
        return self.danger


def limits_of_key(owner: str, name: str, steps: object, deadband: float) -> Limits:
    """The limits that stand under a key of the configuration, in the quantity's unit.

    Raises
    ------
    ParameterError
        Not three numbers > 0 that rise; the sentence names the key.
    """
    numbers = list(steps) if isinstance(steps, list | tuple) else []
    rising = all(isinstance(step, float | int) for step in numbers) and min(numbers, default=0.0) > 0.0
    if len(numbers) != 3 or not rising or not numbers[0] < numbers[1] < numbers[2]:
        raise refuse(owner, name, "three numbers > 0 that rise, [alert, alarm, danger], or null", steps)
    return Limits(*numbers, deadband=deadband)
