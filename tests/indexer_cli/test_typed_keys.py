"""What a command prints names each parameter by the key that is typed on its line; every command explains itself
without any extra."""

from __future__ import annotations

import dataclasses
import functools
import importlib
import json
import subprocess
import sys
import tomllib
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from hydra import compose, initialize_config_dir
from omegaconf import OmegaConf

from classifier.features import FEATURES
from classifier.network import Mlp
from discrepancy.indexer.windows import Experiment
from discrepancy.records.conditions import Conditions
from indexer_cli.typed_keys import OWNERS, as_typed, dotted
from indexer_cli.verbs import VERBS, Verb
from indexer_env.drive_sensors import DriveSensors
from indexer_env.faults import Faults
from indexer_env.machine import Machine
from indexer_env.operating_point import OperatingPoint
from indexer_env.presets import config_dir
from indexer_env.run import Run
from indexer_env.sensors import Sensor
from indexer_records.measured import Reading

ROOT = Path(__file__).parents[2]
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]


def module_of(verb: Verb) -> ModuleType:
    module = importlib.import_module(verb.module)
    return importlib.import_module(f"{verb.module}.__main__") if hasattr(module, "__path__") else module


COMMANDS = {name: module_of(verb) for name, verb in VERBS.items()}
CLASSES = {
    kind.__name__: kind
    for kind in (
        Machine,
        OperatingPoint,
        Sensor,
        Faults,
        Run,
        DriveSensors,
        Conditions,
        Experiment,
        Mlp,
        *FEATURES.values(),
    )
}


@functools.cache
def keys_of(command: str, *overrides: str) -> set[str]:
    with initialize_config_dir(str(config_dir()), version_base="1.3"):
        config = OmegaConf.to_container(compose(command, list(overrides)))
    assert isinstance(config, dict)
    return dotted(config)


# -------------------------------------------------------------------------------- the table


@pytest.mark.parametrize("command", COMMANDS)
@pytest.mark.parametrize("owner", CLASSES)
def test_a_parameter_of_an_object_is_named_by_its_key(command, owner):
    """Of all fields of the classes that OWNERS names, in each command whose configuration has their section."""
    features = ["features=fft"] if owner == "Fft" and "features" in keys_of(command) else []
    keys = keys_of(command, *features)
    for field in dataclasses.fields(CLASSES[owner]):
        for section in OWNERS[owner]:
            typed = [f"{section}.{field.name}{unit}" for unit in ("", "_rpm", "_deg")]
            found = [key for key in typed if key in keys]
            if found:
                assert as_typed(f"{owner}.{field.name} must", command, keys) == f"{found[0]} must"


@pytest.mark.parametrize("owner", CLASSES)
def test_every_object_has_a_key_in_some_command(owner):
    """Else the test above would look at nothing."""
    features = ["features=fft"] if owner == "Fft" else []
    names = {field.name for field in dataclasses.fields(CLASSES[owner])}
    held = {
        key
        for command in COMMANDS
        for key in keys_of(command, *(features if "features" in keys_of(command) else []))
        for section in OWNERS[owner]
        if key.removeprefix(f"{section}.").removesuffix("_rpm").removesuffix("_deg") in names
        and key.startswith(f"{section}.")
    }
    assert held


@pytest.mark.parametrize("command", COMMANDS)
def test_a_command_s_own_keys_stand_alone(command):
    for key in keys_of(command):
        if "." not in key:
            assert as_typed(f"{command}.{key} must be", command, keys_of(command)) == f"{key} must be"


@pytest.mark.parametrize(
    ("said", "command", "extra", "typed"),
    [
        ("give it (read.unit=UNIT)", "ingest", (), "give it (read.unit=UNIT)"),
        ("give it (read.unit=UNIT)", "explain", ("out=x", "measured=x"), "give it (known.unit=UNIT)"),
        ("Machine.output_joint.damping must", "generate", (), "machine.output_joint.damping must"),
        (
            "friction.coulomb.torque must",
            "generate",
            ("+machine.effects={friction.coulomb:{torque:1}}",),
            "machine.effects.friction.coulomb.torque must",
        ),
        ("motion_law.name must be", "generate", ("machine.motion_law=round",), "machine.motion_law must be"),
        ("classifier.parts must be", "tune", (), "parts must be"),
        # What has no key is left: a file, a method's argument, the parameter of an object that is not configured.
        ("/tmp/read.unit and read.csv", "explain", ("out=x", "measured=x"), "/tmp/read.unit and read.csv"),
        ("Sensor.read.sample_rate must", "generate", (), "Sensor.read.sample_rate must"),
        ("Psd.scale must", "diagnose", (), "Psd.scale must"),
    ],
)
def test_where_parameters_lie(said, command, extra, typed):
    assert as_typed(said, command, keys_of(command, *extra)) == typed


def test_a_file_s_own_reading_is_named_as_its_class_has_it():
    """What `indexer_records.measured` says as read.NAME is a field of Reading and a key of ingest."""
    source = "".join(
        (ROOT / "indexer_records" / f"{name}.py").read_text() for name in ("measured", "acceleration_units")
    )
    names = {field.name for field in dataclasses.fields(Reading)}
    said = {part.split("=")[0].split()[0].rstrip(".,;)\"'") for part in source.split("read.")[1:]}
    assert said & names >= {"signal_column", "time_column", "sample_rate", "unit", "scale"}
    assert {f"read.{name}" for name in names} <= keys_of("ingest")


# -------------------------------------------------------------------------------- the commands


@pytest.fixture
def call(run_command, tmp_path, monkeypatch):
    """Run a command in a folder with a measured file of two channels; gives exit code and what it complained of."""
    monkeypatch.chdir(tmp_path)
    values = np.random.default_rng(0).normal(size=(1200, 2))
    (tmp_path / "files" / "a").mkdir(parents=True)
    rows = [f"{index / 1000:.3f},{x:.4f},{y:.4f}" for index, (x, y) in enumerate(values)]
    (tmp_path / "files" / "a" / "a.csv").write_text("\n".join(["time [s],acc x [g],acc y [g]", *rows]))

    def run(command: str, *arguments: str) -> tuple[int, str]:
        code, _, err = run_command(COMMANDS[command], *arguments)
        return code, err

    return run


TORQUE = "machine.effects.friction.coulomb.torque"
TRAINING = ("data=none", "out=x")
RECORDS = ("measured=files", "out=x", "known.motor_speed_rpm=1500", "known.load_torque=2")


@pytest.mark.parametrize(
    ("argument", "told"),
    [
        ("read.unt=g", "read.unt must be a key of read, got an unknown key; did you mean 'unit'."),
        ("period=0,5", "period must be one value, got '0,5'; write 0.5 with a decimal point, or write it in []"),
        ("period=a,5", "period must be one value, got 'a,5'; write it in [] for a list"),
    ],
)
def test_a_slip_of_the_pen_is_told_by_the_key_that_was_typed(call, argument, told):
    code, err = call("ingest", "measured=files", "out=x", argument)
    assert code == 2 and err.startswith(f"error: {told}")


@pytest.mark.parametrize(
    ("command", "arguments", "key"),
    [
        ("generate", ("out=x", "count=0"), "count"),
        ("generate", ("out=x", "operating_point.motor_speed_rpm=-1"), "operating_point.motor_speed_rpm"),
        ("generate", ("out=x", "machine.input_joint.stiffness=-1"), "machine.input_joint.stiffness"),
        ("generate", ("out=x", "sensor.lowpass_hz=600"), "sensor.lowpass_hz"),
        ("generate", ("out=x", "run.step=-1"), "run.step"),
        ("simulate", ("out=x", "drive_sensors.signals=[motor_torqe]"), "drive_sensors.signals"),
        (
            "generate",
            ("out=x", "+machine.effects.friction.coulomb.torque=a"),
            "machine.effects.friction.coulomb.torque",
        ),
        ("ingest", ("measured=files", "out=x", "period=1"), "read.signal_column=NAME"),
        ("ingest", ("measured=files", "out=x", "period=-1"), "period"),
        ("ingest", ("measured=files", "out=x", "period=1", "known.motor_speed_rpm=-1"), "known.motor_speed_rpm"),
        ("check", ("data=none", "remake=-1"), "remake"),
        ("remake", ("data=none", "item=x"), "item"),
        ("train", (*TRAINING, "features.resolution_hz=-2"), "features.resolution_hz"),
        ("train", (*TRAINING, "trainer.momentum=3"), "trainer.momentum"),
        ("train", (*TRAINING, "parts=some"), "parts"),
        ("tune", (*TRAINING, "seed=a"), "seed"),
        ("tune", (*TRAINING, "parts=some"), "parts"),
        ("leaveout", (*TRAINING, "by=sensor", "features.scale=loud"), "features.scale"),
        ("leaveout", (*TRAINING, "by=3"), "by"),
        ("transfer", ("model=none", *TRAINING, "counts=3"), "counts"),
        ("compare", ("study=baselines", "out=x", "records=3"), "records"),
        ("export", ("model=none", "out=x.txt"), "out"),
        ("diagnose", ("model=none", "measured=files", "known.motor_speed_rpm=-1"), "known.motor_speed_rpm"),
        ("study", ("out=x", "claims=none"), "claims"),
        ("challenge", ("out=x", "count=0", "seed=1"), "count"),
        ("explain", (*RECORDS, "known.noise=-1"), "known.noise"),
        ("explain", (*RECORDS, "seconds=-1"), "seconds"),
        ("explain", (*RECORDS, "tolerance=2"), "tolerance"),
        ("explain", (*RECORDS, "known.start_angle_deg=a"), "known.start_angle_deg"),
        ("explain", RECORDS, "known.signal_column=NAME"),
        ("explain", RECORDS[:2], "known.NAME=VALUE"),
    ],
)
def test_a_refusal_names_the_key_as_it_is_typed(call, command, arguments, key):
    code, err = call(command, *arguments)
    words = err.replace("(", " ").replace(")", " ").replace(",", " ").split()
    assert code == 2 and key in [word.rstrip(".;") for word in words], err


EXTRAS = {"sklearn", "optuna", "onnx", "onnxruntime", "tensorboard", "ray", "s3fs", "h5py", "nptdms", "pyuff"}
EXTRAS |= {"soundfile", "minari", "stable_baselines3", "pygame", "jax", "pandas", "polars"}


NEED_AN_EXTRA = {
    "compare": (("study=baselines", "out=nothing-is-written"), "sklearn"),
    "tune": (("data=none", "out=nothing-is-written"), "tune"),
    "export": (("model=none", "out=nothing-is-written.onnx"), "onnx"),
}
"""Verb -> what it is given, and the extra without which it cannot work."""

PROBE = """
import contextlib, importlib, io, json, sys
extras, calls = json.loads(sys.argv[1])
sys.modules.update(dict.fromkeys(extras))
said = []
for module, arguments in calls:
    sys.argv, code = ["command", *arguments], 0
    with contextlib.redirect_stdout(io.StringIO()) as out, contextlib.redirect_stderr(io.StringIO()) as err:
        try:
            importlib.import_module(module).main()
        except SystemExit as stop:
            code = stop.code
    said.append((code, out.getvalue(), err.getvalue()))
print(json.dumps(said))
"""


@pytest.fixture(scope="module")
def without_extras() -> dict[tuple[str, ...], tuple[int, str, str]]:
    """Exit code, stdout and stderr of commands where whatever only an extra installs cannot be imported.

    In one process, as each loads the same libraries."""
    assert not EXTRAS & {dependency.split(">")[0].lower() for dependency in PROJECT["dependencies"]}
    calls = [(name, "--help") for name in COMMANDS] + [(name, *given) for name, (given, _) in NEED_AN_EXTRA.items()]
    asked = json.dumps((sorted(EXTRAS), [(COMMANDS[name].__name__, given) for name, *given in calls]))
    done = subprocess.run(
        [sys.executable, "-c", PROBE, asked], cwd=ROOT, capture_output=True, text=True, timeout=600, check=False
    )
    assert (done.returncode, done.stderr) == (0, "")
    return dict(zip(calls, map(tuple, json.loads(done.stdout)), strict=True))


@pytest.mark.parametrize("command", COMMANDS)
def test_help_needs_no_extra(command, without_extras):
    code, out, err = without_extras[command, "--help"]
    assert (code, err) == (0, "") and out.startswith(f"NAME\n    indexer {command}:")


@pytest.mark.parametrize("command", NEED_AN_EXTRA)
def test_without_an_extra_a_command_says_what_to_install(command, without_extras):
    given, extra = NEED_AN_EXTRA[command]
    code, _, err = without_extras[command, *given]
    assert code == 2 and err.count("\n") == 1
    assert f"pip install 'indexer-diagnosis[{extra}]'" in err
