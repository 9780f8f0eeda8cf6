"""The columns of a data set: every one with its type, its unit and one sentence, as data.

One row is one record, simulated or measured, whatever batch or shard it was made in. Units and sentences travel in
the Parquet field metadata (keys b"unit", b"description" and b"rows"), the version of this layout in the schema
metadata. `python -m datagen.schema` prints the tree that stands in DATA.md.
"""

from __future__ import annotations

import dataclasses
from dataclasses import dataclass
from typing import Literal, get_args

import pyarrow as pa

FORMAT = "indexer-diagnosis records"
SCHEMA_VERSION = 4
"""Raised whenever a column changes its name, type, unit or meaning, is added or disappears."""

Kind = Literal["simulated", "measured"]
"""What a row is; its column `kind`."""

KINDS: tuple[Kind, ...] = get_args(Kind)


@dataclass(frozen=True)
class Column:
    """One column: Arrow type, unit ("-" for a pure number, "" for text and flags) and one sentence.

    `of` says which rows it belongs to; `nullable` whether it may be null in those. A column of simulated rows holds in
    a measured row what is known of the machine and null otherwise, a column of measured rows is null in simulated ones.
    """

    name: str
    type: pa.DataType
    unit: str
    description: str
    nullable: bool = False
    of: Kind | Literal["both"] = "both"

    def may_be_null(self, kind: Kind) -> bool:
        """Whether a row of this kind may hold null here."""
        return self.nullable or self.of not in ("both", kind)

    def field(self) -> pa.Field:
        """The Arrow field with unit, description and the rows it belongs to as metadata."""
        metadata = {"unit": self.unit, "description": self.description, "rows": self.of}
        return pa.field(self.name, self.type, nullable=self.nullable or self.of != "both", metadata=metadata)


_NUMBER, _COUNT, _TEXT, _FLAG = pa.float64(), pa.int64(), pa.string(), pa.bool_()
_SAMPLES = pa.list_(pa.field("element", pa.float32(), nullable=False))


def _joint(name: str, words: str) -> list[Column]:
    return [
        Column(f"{name}_stiffness", _NUMBER, "N m/rad", f"Stiffness of {words} for positive deflection"),
        Column(f"{name}_damping", _NUMBER, "N m s/rad", f"Viscous damping of {words} in contact"),
        Column(f"{name}_backlash", _NUMBER, "rad", f"Play of {words}, total, without that of effects"),
        Column(f"{name}_stiffness_ratio", _NUMBER, "-", "Its stiffness for negative over positive deflection"),
    ]


def _only(kind: Kind, columns: list[Column]) -> list[Column]:
    """The columns, of rows of this kind only."""
    return [dataclasses.replace(column, of=kind) for column in columns]


GROUPS: dict[str, list[Column]] = {
    "record": [
        Column("record", _SAMPLES, "column unit", "Samples of one record, first at time 0"),
        Column("sample_rate", _NUMBER, "Hz", "Samples per second of the record"),
        Column("quantity", _TEXT, "", "What was recorded"),
        Column("unit", _TEXT, "", "Unit of the samples, rad/s^2 or m/s^2"),
    ],
    "label": [
        Column("class", _COUNT, "-", "Class, from 1"),
        Column("class_name", _TEXT, "", "The class in words"),
        Column("code", _TEXT, "", "Target of the network, one character 0 or 1 per output"),
        Column("subset", _TEXT, "", "calibration, control or validation"),
        Column("machine_draw", _COUNT, "-", "Which machine; repeats on one machine share it and the subset"),
        Column("remaining_turns", _COUNT, "turns", "Turns until the machine fails; null: not run to failure", True),
    ],
    "quality": [
        Column("clipped_share", _NUMBER, "-", "Share of the samples in flat tops and bottoms at the record's extremes"),
        Column("constant_share", _NUMBER, "-", "Share of the samples in the longest run of equal ones, 1: dead sensor"),
    ],
    "origin": [
        Column("kind", _TEXT, "", "simulated or measured"),
        Column("campaign", _TEXT, "", "Family of the data set"),
        Column("seed", _COUNT, "-", "Seed of the data set"),
        Column("item", _COUNT, "-", "Number of the item, from 0; fixes every draw with the seed"),
    ],
    "source of a measured row": _only("measured", [
        Column("source", _TEXT, "", "File it was read from, below the folder of all files"),
        Column("source_sha256", _TEXT, "", "SHA-256 of that file"),
        Column("source_channel", _TEXT, "", "Channel in the file"),
        Column("source_rate", _NUMBER, "Hz", "Samples per second in the file"),
        Column("source_start", _NUMBER, "s", "Where the record begins in the file"),
        Column("source_duration", _NUMBER, "s", "How long the turn lasted there; the record spreads it evenly"),
        Column("groups", _TEXT, "", "What it was measured with and when, as JSON, e.g. sensor, machine, day"),
    ]),
    "machine, its faults among its effects": _only("simulated", [
        Column("machine_name", _TEXT, "", "Name of the machine it was drawn around"),
        Column("model", _TEXT, "", "A (1 degree of freedom, no input joint), B (2) or B_on_base (3)"),
        Column("reduction_ratio", _NUMBER, "-", "Motor turns per cam turn, i"),
        Column("stations", _COUNT, "-", "Stations of the table, cam turns per table turn"),
        Column("motion_share", _NUMBER, "-", "Share of the cam turn in motion, f"),
        Column("motion_law", _TEXT, "", "Name of the cam's motion law"),
        Column("motion_law_parameters", _TEXT, "", "Its parameters as JSON, {} for a law without"),
        Column("contact_law", _TEXT, "", "What the damping of a joint does at the edge of its play"),
        Column("motor_inertia", _NUMBER, "kg m^2", "J_m, motor"),
        Column("cam_inertia", _NUMBER, "kg m^2", "J_C, cam with the reducer's output side"),
        Column("follower_inertia", _NUMBER, "kg m^2", "J_F, follower turret"),
        Column("table_inertia", _NUMBER, "kg m^2", "J_t, table with its load"),
        Column("housing_inertia", _NUMBER, "kg m^2", "J_b, housing about the table axis"),
        *_joint("input_joint", "joint 1 (reducer and input shaft)"),
        *_joint("output_joint", "joint 2 (indexer and output shaft)"),
        *_joint("base_joint", "joint 3 (base screws)"),
        Column("input_joint_backlash_total", _NUMBER, "rad", "Play of joint 1 as simulated, that of effects included"),
        Column("output_joint_backlash_total", _NUMBER, "rad", "Play of joint 2 as simulated, that of effects included"),
        Column("effects", _TEXT, "", "Effects beyond the base equations, JSON list of {name, ...}"),
    ]),
    "faults, each also among the effects": _only("simulated", [
        Column("fault_roller_crack", _NUMBER, "-", "Loss of stiffness of joint 2 in one sense, 0 intact"),
        Column("fault_cracked_station", _COUNT, "-", "The one station that has it; null: all of them", True),
        Column("fault_screw_looseness", _NUMBER, "-", "Loose base screws, 0 tight to 1"),
        Column("fault_backlash", _NUMBER, "rad", "Play added to joint 1, at the MOTOR shaft"),
    ]),
    "operating point": _only("simulated", [
        Column("motor_speed", _NUMBER, "rad/s", "Commanded speed of the motor shaft"),
        Column("load_torque", _NUMBER, "N m", "T_L, torque against the table's motion"),
        Column("start_angle", _NUMBER, "rad", "Cam angle at time 0; the motion begins at 0"),
    ]),
    "run and warm-up": _only("simulated", [
        Column("simulation_rate", _NUMBER, "Hz", "Samples per second given to the sensor"),
        Column("simulation_samples", _COUNT, "-", "Samples given to the sensor"),
        Column("step", _NUMBER, "s", "Largest step of the integrator; null: each machine's own", True),
        Column("device", _TEXT, "", "The GPU that simulated it, by its name; null: a CPU", True),
        Column("warmup_limit", _COUNT, "turns", "Turns of the table before the record, at most"),
        Column("warmup_tolerance", _NUMBER, "-", "Difference of successive turns that counts as settled"),
        Column("warmup_turns", _COUNT, "turns", "Turns of the table run before the record"),
        Column("warmup_settled", _FLAG, "", "True when the record repeats the turn before it"),
        Column("warmup_difference", _NUMBER, "-", "Record minus the turn before it, rms over rms", True),
    ]),
    "sensor": _only("simulated", [
        Column("sensor_radius", _NUMBER, "m", "Radius of the accelerometer; null: reads the angular one", True),
        Column("sensor_gain", _NUMBER, "-", "Reading over truth"),
        Column("sensor_bracket_hz", _NUMBER, "Hz", "Natural frequency of the bracket; null: rigid", True),
        Column("sensor_bracket_damping", _NUMBER, "-", "Damping ratio of the bracket"),
        Column("sensor_highpass_hz", _NUMBER, "Hz", "Edge of the AC coupling; null: none", True),
        Column("sensor_lowpass_hz", _NUMBER, "Hz", "Edge of the anti-alias filter; null: none", True),
        Column("sensor_lowpass_order", _COUNT, "-", "Order of the anti-alias filter"),
        Column("sensor_sample_rate", _NUMBER, "Hz", "Rate asked for; null: that of the simulation", True),
        Column("sensor_offset", _NUMBER, "column unit", "Reading at rest at time 0"),
        Column("sensor_offset_drift", _NUMBER, "column unit/s", "Drift of the reading at rest"),
        Column("sensor_hum_amplitude", _NUMBER, "column unit", "Amplitude of the mains hum"),
        Column("sensor_hum_hz", _NUMBER, "Hz", "Mains frequency"),
        Column("sensor_hum_phase", _NUMBER, "rad", "Phase of the hum at time 0"),
        Column("sensor_hum_third", _NUMBER, "-", "Third harmonic of the hum over its fundamental"),
        Column("sensor_noise_snr_db", _NUMBER, "dB", "Signal-to-noise ratio; null: not used", True),
        Column("sensor_noise_density", _NUMBER, "column unit/sqrt(Hz)", "One-sided noise density; 0: none"),
        Column("sensor_full_scale", _NUMBER, "column unit", "Range, plus and minus; null: no clipping", True),
        Column("sensor_bits", _COUNT, "-", "Bits of the quantiser over the range; null: none", True),
    ]),
    "signals of the drive, where they were asked for": _only("simulated", [
        *(Column(name, _SAMPLES, unit, words, True) for name, unit, words in (
            ("motor_torque", "N m", "Torque on the motor shaft, sampled with the record"),
            ("motor_current", "A", "Current of the motor"),
            ("motor_angle", "rad", "Encoder of the motor, angle within a turn"),
            ("table_angle", "rad", "Encoder of the table, angle within a turn"),
        )),
        Column("drive_sensors", _TEXT, "", "How they were read, as JSON; null: none was", True),
    ]),
    "versions": [
        Column("schema_version", _COUNT, "-", "Version of this layout"),
        Column("package_version", _TEXT, "", "Version of indexer-diagnosis that made the row"),
        Column("numpy_version", _TEXT, "", "Version of NumPy"),
        Column("scipy_version", _TEXT, "", "Version of SciPy"),
        Column("numba_version", _TEXT, "", "Version of Numba", of="simulated"),
    ],
}  # fmt: skip
"""Columns by group, in file order."""

COLUMNS: dict[str, Column] = {column.name: column for group in GROUPS.values() for column in group}
RECORD = "record"
SAMPLED = tuple(name for name, column in COLUMNS.items() if column.type == _SAMPLES)
"""Columns of samples: the record first, then the signals of the drive."""

REJECTED_COLUMNS = [
    *(COLUMNS[name] for name in ("seed", "item", "class", "class_name", "code", "subset", "machine_draw")),
    Column("stage", _TEXT, "", "Where it failed: machine (its values were refused), simulation, file or turn"),
    Column("reason", _TEXT, "", "One sentence: what, rule, value"),
    Column("draws", _TEXT, "", "What it differs in from the base, as JSON, SI units; measured: where it stands"),
]
"""Columns of rejected.parquet."""

_METADATA = {b"format": FORMAT.encode(), b"schema_version": str(SCHEMA_VERSION).encode()}


def schema() -> pa.Schema:
    """The Arrow schema of a shard."""
    return pa.schema([column.field() for column in COLUMNS.values()], metadata=_METADATA)


def rejected_schema() -> pa.Schema:
    """The Arrow schema of the table of rejected items."""
    return pa.schema([column.field() for column in REJECTED_COLUMNS], metadata=_METADATA)


def tree() -> str:
    """The columns as one commented tree, as it stands in DATA.md."""
    lines = []
    for name, columns in [
        *GROUPS.items(),
        ("rejected.parquet, one row per item that has no record", REJECTED_COLUMNS),
    ]:
        lines += ["", f"# {name}"]
        for column in columns:
            kind = "list<float32>" if column.name in SAMPLED else str(column.type).replace("double", "float64")
            kind += "?" if column.nullable else ""
            rows = {"both": "", "simulated": "s", "measured": "m"}[column.of]
            unit = f"[{column.unit}]" if column.unit else ""
            lines.append(f"{column.name:<29}{kind:<15}{rows:<3}{unit:<27}{column.description}".rstrip())
    return "\n".join(lines[1:])


if __name__ == "__main__":
    print(tree())
