"""Under what a record was taken: what is known beside its samples, and the pulse that marks its turns."""

from __future__ import annotations

from dataclasses import dataclass

from indexer_env.checks import check_choice, check_number
from indexer_env.errors import refuse


@dataclass(frozen=True)
class RecordConditions:
    """What is known of a record beside its samples; None where it is not.

    Attributes
    ----------
    motor_speed : float or None
        Mean speed of the motor shaft [rad/s], > 0.
    load_torque : float or None
        Torque against the table's motion [N m].
    sensor_radius : float or None
        Radius of the accelerometer [m], > 0.
    machine : str or None
        Name of the machine.
    """

    motor_speed: float | None = None
    load_torque: float | None = None
    sensor_radius: float | None = None
    machine: str | None = None

    def __post_init__(self) -> None:
        for name, unit in (("motor_speed", "rad/s"), ("sensor_radius", "m")):
            if getattr(self, name) is not None:
                check_number("known", name, getattr(self, name), low=0.0, low_open=True, unit=unit)
        if self.load_torque is not None:
            check_number("known", "load_torque", self.load_torque, unit="N m")
        if not isinstance(self.machine, str | type(None)):
            raise refuse("known", "machine", "a text or null", self.machine, "quote it: known.machine='\"...\"'")


@dataclass(frozen=True)
class Pulse:
    """The once-per-turn pulse.

    Attributes
    ----------
    column : str or None
        Its channel; None: no pulse, the turns follow each other by the period.
    threshold : float or None
        Level of the edge in the file's unit; None: half-way between the smallest and the largest value, see
        `turns.pulse_edges`.
    edge : str
        rising or falling: which edge begins a turn.
    tolerance : float
        By which share a turn may be shorter or longer than the period [-], in (0, 0.5).
    """

    column: str | None = None
    threshold: float | None = None
    edge: str = "rising"
    tolerance: float = 0.02

    def __post_init__(self) -> None:
        if not isinstance(self.column, str | type(None)):
            raise refuse("pulse", "column", "a text or null", self.column, "quote it: pulse.column='\"...\"'")
        if self.threshold is not None:
            check_number("pulse", "threshold", self.threshold)
        check_choice("pulse", "edge", self.edge, ("rising", "falling"))
        check_number("pulse", "tolerance", self.tolerance, low=0.0, low_open=True, high=0.5, high_open=True)

    def check_named(self) -> None:
        """Refuse what says where a pulse begins while no channel is named that has one."""
        for name, usual in (("threshold", None), ("edge", "rising")):
            value = getattr(self, name)
            if self.column is None and value != usual:
                rule, remedy = "left out where no pulse.column is given", "name it, pulse.column=NAME"
                raise refuse("pulse", name, rule, value, remedy)


@dataclass(frozen=True)
class TurnGrid:
    """The records that turns become.

    Attributes
    ----------
    rate : float
        Of the records [Hz], > 0.
    turn_duration : float
        Nominal duration of a turn [s], > 0.
    pulse : Pulse
        By which turns are cut, and how far off the nominal duration they may be.
    """

    rate: float
    turn_duration: float
    pulse: Pulse = Pulse()

    @property
    def samples(self) -> int:
        """Samples of a record."""
        return round(self.turn_duration * self.rate)
