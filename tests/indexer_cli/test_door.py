"""The command `indexer`: its list, its pages and what it answers without a verb."""

import importlib
import os
import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest
import yaml
from hydra import compose, initialize_config_dir
from omegaconf import OmegaConf

from datagen.new import number_or_text
from indexer_cli.__main__ import main
from indexer_cli.arguments import flags_first, root_keys, with_files, with_key
from indexer_cli.completion import SHELLS, candidates
from indexer_cli.manual import keys_of, manual, overview
from indexer_cli.verbs import VERBS, config_folder
from indexer_cli.yaml_keys import read_page
from indexer_env.presets import config_dir

CONF = config_dir()
ROOTS = sorted(path for path in CONF.glob("*.yaml") if not path.read_text().startswith("# @package"))
POSITIONAL = {"check": "data", "remake": "data", "publish": "data", "new": "what"}


@pytest.fixture
def call(monkeypatch, capsys):
    """Run `indexer` with these arguments: exit code, stdout, stderr."""

    def run(*arguments):
        monkeypatch.setattr(sys, "argv", ["indexer", *arguments])
        try:
            main()
            code = 0
        except SystemExit as stop:
            code = stop.code
        return code, *capsys.readouterr()

    return run


def test_verbs_and_root_configurations_are_the_same():
    assert {path.stem for path in ROOTS} == set(VERBS)
    assert config_folder() == CONF


@pytest.mark.parametrize("verb", VERBS.values(), ids=lambda verb: verb.name)
def test_a_verb_leads_to_the_main_of_its_configuration(verb):
    module = importlib.import_module(verb.module)
    if hasattr(module, "__path__"):
        module = importlib.import_module(f"{verb.module}.__main__")
    assert module.main.config_name == verb.name
    assert module.main.positional == POSITIONAL.get(verb.name)


def test_the_list_has_a_line_for_each_verb(call):
    code, out, err = call()
    assert (code, err) == (0, "")
    for name in VERBS:
        (line,) = [line for line in out.splitlines() if line.startswith(f"  {name} ")]
        assert line.endswith(".") and len(line) <= 120
    assert call("--help")[1] == out


@pytest.mark.parametrize("arguments", [("--help",), ("generate", "--help"), ("--complete", "generate", "mach")])
def test_help_loads_nothing_heavy(arguments):
    """Whole seconds lie between a page and numpy, Hydra or torch."""
    program = (
        "import sys; from indexer_cli.__main__ import main; main(); "
        "print([name for name in ('numpy', 'hydra', 'torch', 'yaml', 'indexer_env') if name in sys.modules])"
    )
    done = subprocess.run([sys.executable, "-c", program, *arguments], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "[]"


@pytest.mark.parametrize("name", VERBS)
def test_a_page_has_every_part_and_every_key(name, call, monkeypatch):
    monkeypatch.setenv("COLUMNS", "100")
    code, page, _ = call(name, "--help")
    assert code == 0 and page == call("help", name)[1]
    headings = ["NAME", "SYNOPSIS", "DESCRIPTION", "KEYS", "EVERY VERB", "EXIT CODES"]
    assert [line for line in page.splitlines() if line in headings] == headings
    shown = {line.strip().partition("=")[0].removesuffix(" (must be given)") for line in page.splitlines()}
    config = yaml.safe_load((CONF / f"{name}.yaml").read_text())
    for key in root_keys(name):
        assert key in shown or f"  {key}." in page, key
    for key, value in config.items():
        if value == "???":
            assert f"    {key} (must be given)" in page.splitlines()
            assert f" {key}=..." in page.split("DESCRIPTION")[0]
    assert max(map(len, page.splitlines())) <= 135


@pytest.mark.parametrize("name", VERBS)
def test_a_page_has_three_examples_that_compose(name, tmp_path):
    machine_file = CONF / "machine" / "reference.yaml"
    lines = [line.strip() for line in read_page(CONF / f"{name}.yaml").header]
    examples = [line for line in lines if line.startswith(f"indexer {name}")]
    assert len(examples) == 3
    for example in examples:
        arguments = with_key(POSITIONAL.get(name), flags_first(shlex.split(example)[2:]))
        arguments = [re.sub(r"^machine=\w+\.yaml$", f"machine={machine_file}", argument) for argument in arguments]
        if arguments and arguments[0] == "-m":  # the first job of the sweep
            arguments = [re.sub(r"(=[^,\[{]+),.*", r"\1", argument) for argument in arguments[1:]]
        with initialize_config_dir(str(CONF), version_base="1.3"):
            config = compose(name, with_files(arguments, tmp_path))
        assert not OmegaConf.missing_keys(config), example


FILES = sorted({*ROOTS, CONF / "recording.yaml"}) + [
    CONF / choice.name / f"{choice.default}.yaml"
    for root in ROOTS
    for choice in read_page(root).choices
    if not choice.name.startswith("override ")
]


@pytest.mark.parametrize("path", dict.fromkeys(FILES), ids=lambda path: str(path.relative_to(CONF)))
def test_keys_are_read_as_yaml_reads_them_and_each_has_a_meaning(path):
    def flat(mapping, prefix=""):
        for key, value in mapping.items():
            if isinstance(value, dict) and value and f"{prefix}{key}" not in written:
                yield from flat(value, f"{prefix}{key}.")
            else:
                yield f"{prefix}{key}", value

    page = read_page(path)
    written = {key.name: yaml.safe_load(key.default) for key in page.keys if key.default is not None}
    expected = dict(flat({key: value for key, value in yaml.safe_load(path.read_text()).items() if key != "defaults"}))
    assert written == expected
    assert [key.name for key in page.keys if key.default is not None and len(key.meaning) < 3] == []


def test_a_line_that_is_no_key_is_refused(tmp_path):
    (tmp_path / "odd.yaml").write_text("a: 1  # one\nnot a key\n")
    with pytest.raises(ValueError, match="one key a line, got 'not a key'"):
        read_page(tmp_path / "odd.yaml")


def test_a_sign_inside_quotes_is_no_comment(tmp_path):
    (tmp_path / "quoted.yaml").write_text("a: 'x # y'  # a text\n         # that goes on\n")
    (key,) = read_page(tmp_path / "quoted.yaml").keys
    assert (key.default, key.meaning) == ("'x # y'", "a text")
    (tmp_path / "long.yaml").write_text("a: 1  # a number\n      # that goes on\n")
    (key,) = read_page(tmp_path / "long.yaml").keys
    assert key.meaning == "a number that goes on"


def test_version(call):
    code, out, _ = call("--version")
    assert code == 0 and out.startswith("indexer ") and out.strip().rpartition(" ")[2][0].isdigit()


@pytest.mark.parametrize(
    ("arguments", "sentence"),
    [
        (("generat",), "error: the first word must be a verb, got 'generat'; did you mean 'generate'."),
        (("qqq",), "error: the first word must be a verb, got 'qqq'; indexer --help lists them."),
        (("help", "trian"), "error: the first word must be a verb, got 'trian'; did you mean 'train'."),
        (("--completion", "fish"), "error: --completion must be followed by bash or zsh, got 'fish'."),
        (("train", "--bogus"), "error: the command line must hold KEY=VALUE pairs, got '--bogus'; see --help"),
    ],
)
def test_a_mistake_gets_one_sentence(arguments, sentence, call):
    code, out, err = call(*arguments)
    assert (code, out) == (2, "") and err.startswith(sentence) and err.count("\n") == 1


def test_completion_offers_verbs_keys_and_names():
    assert candidates(["ge"]) == ["generate "]
    assert set(candidates([""])) == {f"{name} " for name in VERBS}
    assert candidates(["train", "trainer=traincg"]) == [f"trainer=traincg{end} " for end in "bfp"]
    assert candidates(["generate", "machine.output_joint.st"]) == [
        "machine.output_joint.stiffness=",
        "machine.output_joint.stiffness_ratio=",
    ]
    assert candidates(["generate", "faults.b"]) == ["faults.backlash_deg="]
    assert candidates(["help", "tr"]) == ["train ", "transfer "]
    assert candidates(["nothing", "x"]) == [] and candidates(["train", "data=x"]) == []
    for name in VERBS:
        alone = {f"{word} " for word in VERBS[name].words}
        assert {f"{key}=" for key in keys_of(name)} | alone == set(candidates([name, ""]))


def test_completion_offers_lone_words_and_flags():
    assert candidates(["new", "mach"])[0] == "machine " and "machine=" in candidates(["new", "mach"])
    assert "machine " not in candidates(["new", "machine", "mach"])
    assert candidates(["train", "-"]) == ["--help ", "-m ", "--multirun "] and candidates(["train", "--h"]) == [
        "--help "
    ]
    for name in ("check", "export", "new", "remake"):
        assert candidates([name, "-"]) == ["--help "], "it writes no folder that could hold the jobs of a sweep"
        assert "    -m " not in manual(name)
    assert "    -m " in manual("train")
    assert candidates(["--v"]) == ["--version "] and candidates(["--completion", "z"]) == ["zsh "]


def test_a_mistake_in_a_file_is_told_with_the_file(call, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    text = (CONF / "machine" / "smooth.yaml").read_text()
    Path("mine.yaml").write_text(text.replace("stations: 8", "stations: 1"))
    code, _, err = call("simulate", "machine=mine.yaml", "out=x")
    assert code == 2 and err.startswith("error: mine.yaml: machine.stations must be a whole number >= 2")
    code, _, err = call("simulate", "machine=mine.yaml", "machine.stations=-1", "out=x")
    assert code == 2 and err.startswith("error: machine.stations must be a whole number >= 2")


def test_a_key_in_degrees_is_refused_in_degrees(call):
    code, _, err = call("simulate", "faults.backlash_deg=200", "out=x")
    assert (
        code == 2
        and "faults.backlash_deg must be a finite number >= 0 and <= 114.592 deg at the motor shaft, got 200" in err
    )
    code, _, err = call("simulate", "operating_point.motor_speed_rpm=-5", "out=x")
    assert code == 2 and "operating_point.motor_speed_rpm must be a finite number > 0 rpm, got -5." in err


def test_the_station_of_no_crack_is_told(call):
    code, _, err = call("simulate", "faults.cracked_station=3", "out=x")
    assert (
        code == 2
        and "faults.cracked_station must be left out where no roller is cracked, got 3; add faults.roller=" in err
    )


@pytest.mark.skipif(not Path("/bin/bash").exists(), reason="needs bash")
def test_the_shell_completes(tmp_path):
    """Bash itself, with the line of the documentation."""
    (tmp_path / "indexer").write_text(f'#!/bin/sh\nexec "{sys.executable}" -m indexer_cli "$@"\n')
    (tmp_path / "indexer").chmod(0o755)
    script = """
    eval "$(indexer --completion bash)"
    COMP_WORDS=(indexer generate machine=sm); COMP_CWORD=2; _indexer; echo "${COMPREPLY[@]}"
    """
    root = Path(__file__).parents[2]
    env = os.environ | {"PATH": f"{tmp_path}:{os.environ['PATH']}", "PYTHONPATH": str(root)}
    done = subprocess.run(["/bin/bash", "-c", script], capture_output=True, text=True, check=True, env=env)
    assert done.stdout.strip() == "machine=smooth"


@pytest.mark.skipif(not Path("/bin/bash").exists(), reason="needs bash")
def test_the_sign_of_equality_breaks_no_word_from_the_first_completion_on():
    script = f"COMP_WORDBREAKS=' =:'\n{SHELLS['bash']}\nprintf %s \"$COMP_WORDBREAKS\""
    done = subprocess.run(["/bin/bash", "-c", script], capture_output=True, text=True, check=True)
    assert done.stdout == " :"


def test_the_list_and_a_page_are_texts():
    assert overview("1.2").startswith("indexer 1.2: ")
    assert "indexer train data=... out=... [KEY=VALUE ...]" in manual("train")


def test_flags_and_a_lone_word_may_stand_anywhere(call, tmp_path, monkeypatch):
    assert flags_first(["seed=1", "-m", "a=1,2"]) == ["-m", "seed=1", "a=1,2"]
    assert with_key("data", ["-m", "remake=0", "a b"]) == ["-m", "remake=0", "data='a b'"]
    monkeypatch.chdir(tmp_path)
    assert call("new", "out=mine.yaml", "machine")[0] == 0 and (tmp_path / "mine.yaml").is_file()
    code, _, err = call("simulate", "record")
    assert code == 2 and err.endswith("KEY=VALUE pairs, got 'record'; write the key in front of it, KEY=record.\n")
    code, _, err = call("simulate", "faults.backlash_deg", "10", "out=x")
    assert code == 2 and err.endswith("got 'faults.backlash_deg'; write faults.backlash_deg=10.\n")
    for spaced in (("out", "=", "x"), ("out", "=x")):
        code, _, err = call("simulate", *spaced)
        assert code == 2 and err.endswith("KEY=VALUE pairs, got 'out'; leave out the spaces beside =.\n")


def test_a_mapping_that_the_shell_took_apart_is_told_how_to_be_quoted(call):
    code, _, err = call("twin", "healthy=a", "out=b", "matters={reducer_play:", "2}")
    assert code == 2 and "put the whole pair into single quotes, 'KEY={NAME: VALUE}'" in err
    code, _, err = call("twin", "healthy=a", "out=b", "matters={reducer_play: 2}")
    assert code == 2 and "single quotes" not in err


def test_each_file_of_a_sweep_is_a_choice(tmp_path):
    file = tmp_path / "mine.yaml"
    file.write_text((CONF / "machine" / "smooth.yaml").read_text())
    flag, swept, search = with_files(["-m", f"machine=reference,{file}"], tmp_path)
    assert (flag, swept) == ("-m", "machine=reference,file_mine_1_1") and search.startswith("hydra.searchpath=")
    assert (tmp_path / "machine" / "file_mine_1_1.yaml").is_file()


@pytest.mark.parametrize(
    ("arguments", "said"),
    [
        (("train", "features=[1]", "data=x", "out=y"), "features must be one of auto, fft, psd, got '[1]'"),
        (("simulate", "run=null"), "run must be a mapping of keys to values, got None"),
        (("simulate", "out=s3://a/b"), "out must be a path on this machine, got 's3://a/b'"),
        (
            ("new", "machine", "-m", "machine.stations=4,6", "out=new"),
            "new must be run without -m, as it writes no folder",
        ),
        (("export", "-m", "model=a,b", "out=a.onnx"), "export must be run without -m, as it writes no folder"),
        (("remake", "-m", "data=a", "item=1,2", "out=a.parquet"), "remake must be run without -m, as it writes no"),
        (("simulate", "-m", "seed=1,2", "out=full"), "out must be a folder of its own in a sweep, got 'full'"),
        (("simulate", "machine=./mine"), "machine must be one of reference, smooth or a file that ends in .yaml, got"),
        (
            ("simulate", "machine=mine.yam"),
            "machine must be one of reference, smooth or a file that ends in .yaml, got",
        ),
        (
            ("check", "-m", "data=a,b"),
            "check must be run without -m, as it writes no folder that could hold the jobs",
        ),
        (
            ("generate", "campaign=random", "campaign.draws.machine.table_inertia={uniform:[1,2]}", "out=x"),
            "to replace it, give ~campaign.draws.machine.table_inertia and '+campaign.draws.machine.table_inertia={uni",
        ),
    ],
)
def test_what_was_silent_or_a_traceback_is_a_sentence(call, tmp_path, monkeypatch, arguments, said):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "record.csv").write_text("mine")
    code, _, err = call(*arguments)
    assert code == 2 and said in err and "Traceback" not in err
    assert [path.name for path in tmp_path.iterdir()] == ["full"]


@pytest.mark.parametrize("typed", ["drawing.yam", "drawing", "sub/drawing.txt"])
def test_a_wrong_ending_of_a_file_is_told_with_the_file_that_is_there(call, tmp_path, monkeypatch, typed):
    monkeypatch.chdir(tmp_path)
    right = (tmp_path / typed).with_suffix(".yaml")
    right.parent.mkdir(exist_ok=True)
    right.write_text("stations: 6\n")
    code, _, err = call("simulate", f"machine={typed}")
    assert code == 2 and f"got '{typed}'; did you mean '{right.relative_to(tmp_path).as_posix()}'." in err


def test_what_stops_the_loading_is_told_as_what_stops_the_work(call, monkeypatch):
    def stop(name):
        raise KeyboardInterrupt

    monkeypatch.setattr("indexer_cli.__main__.importlib.import_module", stop)
    code, out, err = call("train")
    assert (code, out, err) == (130, "", "stopped from the keyboard\n")


@pytest.mark.parametrize(("answer", "value"), [("8e3", 8000.0), ("8", 8), ("modified_sine", "modified_sine")])
def test_an_answer_is_a_number_where_it_reads_as_one(answer, value):
    assert number_or_text(answer) == value


def test_a_reader_may_leave_early():
    command = f"{sys.executable} -m indexer_cli generate --help | head -1"
    done = subprocess.run(["/bin/sh", "-c", command], capture_output=True, text=True, cwd=Path(__file__).parents[2])
    assert (done.stdout, done.stderr) == ("NAME\n", "")
