"""What to ingest and how: checked before a file is opened."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

from datagen.campaign import SUBSETS
from indexer_env.build import from_mapping
from indexer_env.checks import check_integer, check_number
from indexer_env.errors import refuse
from indexer_env.signal import MINIMUM_SAMPLES
from indexer_records.conditions import Pulse, RecordConditions, TurnGrid
from indexer_records.measured import Reading

CAMPAIGN = "measured"
"""What the column `campaign` of these rows holds."""


@dataclass(frozen=True)
class Split:
    """How files without a subset of their own get one.

    Attributes
    ----------
    by : str
        What stays together: "file", or a group (a column of the labels table), e.g. "machine".
    calibration, control, validation : float
        Shares of the files or groups of each class [-], 0 to 1; what counts is their ratio.
    """

    by: str = "file"
    calibration: float = 0.6
    control: float = 0.2
    validation: float = 0.2

    def __post_init__(self) -> None:
        if not isinstance(self.by, str) or not self.by:
            raise refuse("split", "by", "file or the name of a group", self.by)
        for name in SUBSETS:
            check_number("split", name, getattr(self, name), low=0.0, high=1.0, unit="-")
        if sum(self.shares.values()) == 0.0:
            rule = f"> 0 where {SUBSETS[1]} and {SUBSETS[2]} are 0"
            raise refuse("split", SUBSETS[0], rule, self.calibration, "files without a subset need one")

    @property
    def shares(self) -> dict[str, float]:
        """Share by subset."""
        return {name: float(getattr(self, name)) for name in SUBSETS}


@dataclass(frozen=True)
class Settings:
    """All that decides the bytes of the data set beside the files and labels themselves.

    Attributes
    ----------
    sample_rate : float or None
        Rate of the records [Hz], > 0; None: the lowest of the files.
    period : float or None
        Nominal duration of a turn of the table [s], > 0; None: from `motor_turns` and the known motor speed, and where
        these and a pulse are not given either, each file is one record.
    motor_turns : float or None
        Turns of the motor in one turn of the table, i·S, > 0: 205 for the reference machine.
    pulse, read, known, split
        See there.
    seed : int
        Of the split, >= 0.
    shard_items : int
        Turns in one file, >= 1.
    """

    sample_rate: float | None = None
    period: float | None = None
    motor_turns: float | None = None
    pulse: Pulse = Pulse()
    read: Reading = field(default_factory=Reading)
    known: RecordConditions = RecordConditions()
    split: Split = Split()
    seed: int = 0
    shard_items: int = 512

    def __post_init__(self) -> None:
        check_integer("ingest", "seed", self.seed, low=0, high=2**63 - 1)
        check_integer("ingest", "shard_items", self.shard_items, low=1)
        for name, unit in (("sample_rate", "Hz"), ("period", "s"), ("motor_turns", "")):
            if getattr(self, name) is not None:
                check_number("ingest", name, getattr(self, name), low=0.0, low_open=True, unit=unit)
        if self.period is not None and self.motor_turns is not None:
            raise refuse("ingest", "motor_turns", "left out where a period is given", self.motor_turns)
        if self.motor_turns is not None and self.known.motor_speed is None:
            rule = "given with known.motor_speed_rpm, from which the period follows"
            raise refuse("ingest", "motor_turns", rule, self.motor_turns, "give that or period=SECONDS")
        self.pulse.check_named()
        if self.pulse.column is not None and not self.turns_are_cut:
            remedy = "or give motor_turns=NUMBER and known.motor_speed_rpm=NUMBER"
            raise refuse("ingest", "period", "the duration of one turn of the table in s", None, remedy)
        if self.sample_rate is None or not self.turns_are_cut:
            return
        if not MINIMUM_SAMPLES <= self.turn_duration * self.sample_rate < 2**31 / self.shard_items:
            rule = f"long enough for {MINIMUM_SAMPLES} samples and short enough for 2^31 in one file"
            raise refuse("ingest", "period", rule, f"{self.turn_duration:g} s at {self.sample_rate:g} Hz")

    @property
    def turns_are_cut(self) -> bool:
        """Whether files are cut to turns; else each is one record."""
        return self.period is not None or self.motor_turns is not None

    @property
    def turn_duration(self) -> float:
        """Nominal duration of a turn [s]; of settings that hold one."""
        if self.period is not None:
            return float(self.period)
        assert self.motor_turns is not None and self.known.motor_speed is not None
        return 2.0 * math.pi * self.motor_turns / self.known.motor_speed

    @property
    def grid(self) -> TurnGrid:
        """The records; of settings that hold their rate and duration."""
        assert self.sample_rate is not None
        return TurnGrid(float(self.sample_rate), self.turn_duration, self.pulse)


_PARTS = {"pulse": Pulse, "read": Reading, "known": RecordConditions, "split": Split}
PLACES = ("measured", "labels", "out", "overwrite")
"""Keys of the command that say where things are; they decide no byte of a shard."""


def settings_from(config: Mapping[str, Any]) -> Settings:
    """The settings of a composed conf/ingest.yaml; raises ParameterError for whatever breaks a rule."""
    values = {key: value for key, value in config.items() if key not in PLACES}
    parts = {key: from_mapping(kind, _said(values.pop(key)), key) for key, kind in _PARTS.items()}
    return from_mapping(Settings, {**values, **parts}, "ingest")


def _said(part: Any) -> Any:
    """A part without what is null, so that null may stand beside keys of another unit: motor_speed_rpm."""
    return {key: value for key, value in part.items() if value is not None} if isinstance(part, Mapping) else part
