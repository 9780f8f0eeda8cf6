"""Files find their class, and every doubt about which is which is refused before a file is opened."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from datagen.ingest.settings import Split
from datagen.ingest.sources import Source, sources_of
from datagen.ingest.split import labels_of
from indexer_env.errors import IndexerError, ParameterError, SignalError
from indexer_records.file_table import files_found


@pytest.fixture
def bench(tmp_path) -> Path:
    for name in ("worn/a.csv", "worn/b.tdms", "healthy/a.csv", "healthy/.hidden.csv", "healthy/notes.docx"):
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text("x")
    return tmp_path


def table(bench: Path, text: str) -> Path:
    path = bench / "labels.csv"
    path.write_text(text)
    return path


def refusal(bench: Path, text: str) -> str:
    with pytest.raises(IndexerError) as caught:
        sources_of(str(bench), table(bench, text))
    assert "\n" not in str(caught.value) and str(caught.value).endswith(".")
    return str(caught.value)


def test_folders_name_the_classes(bench):
    found = sources_of(str(bench), None)
    assert [(source.name, source.class_name) for source in found] == [
        ("healthy/a.csv", "healthy"),
        ("worn/a.csv", "worn"),
        ("worn/b.tdms", "worn"),
    ]


def test_a_file_beside_the_folders_is_no_class_of_its_own(bench):
    (bench / "readme.txt").write_text("x")
    with pytest.raises(ParameterError, match=r"got 'readme\.txt beside them'"):
        sources_of(str(bench), None)


def test_a_pattern_names_files_below_the_folder_they_share(bench):
    assert [source.name for source in sources_of(f"{bench}/**/a.csv", None)] == ["healthy/a.csv", "worn/a.csv"]
    with pytest.raises(ParameterError, match="measured must be a folder or pattern with measured files"):
        sources_of(f"{bench}/*.mat", None)


def test_a_labels_table_gives_classes_groups_and_conditions(bench):
    labels = table(
        bench,
        "file;class;machine;motor_speed_rpm;subset\n"
        "worn/a.csv;cracked roller;M1;1500;control\n"
        "b.tdms;cracked roller;M2;;control\n\n"
        "healthy\\a.csv;intact;M1;1480;validation\n",
    )
    found = {source.name: source for source in sources_of(str(bench), labels)}
    assert list(found) == ["healthy/a.csv", "worn/a.csv", "worn/b.tdms"]
    assert found["worn/a.csv"] == Source(
        bench / "worn/a.csv",
        "worn/a.csv",
        "cracked roller",
        "control",
        {"machine": "M1"},
        {},
        {"motor_speed_rpm": 1500.0},
    )
    assert found["worn/b.tdms"].known == {}


def test_a_labels_table_gives_severities_in_the_units_of_the_data_set(bench):
    labels = table(
        bench,
        "file,class,faults.backlash_deg,faults.roller_crack,faults.cracked_station\n"
        "worn/a.csv,worn,90,0.4,3\nworn/b.tdms,worn,45,,\nhealthy/a.csv,intact,0,0,\n",
    )
    found = {source.name: source for source in sources_of(str(bench), labels)}
    assert all(source.groups == {} for source in found.values())
    assert found["worn/a.csv"].faults == {
        "fault_backlash": pytest.approx(np.pi / 2), "fault_roller_crack": 0.4, "fault_cracked_station": 3
    }  # fmt: skip
    assert found["worn/b.tdms"].faults == {"fault_backlash": pytest.approx(np.pi / 4)}
    assert found["healthy/a.csv"].faults == {"fault_backlash": 0.0, "fault_roller_crack": 0.0}


@pytest.mark.parametrize(
    ("column", "cell", "words"),
    [
        ("faults.backlsh_deg", "3", "faults has no parameter 'backlsh_deg'; did you mean"),
        ("faults.backlash_deg", "-3", "faults.backlash_deg must be"),
        ("faults.screw_looseness", "loose", "faults.screw_looseness must be a number, got 'loose'"),
    ],
)
def test_a_severity_that_is_none_is_refused(bench, column, cell, words):
    said = refusal(bench, f"file,class,{column}\nworn/a.csv,x,{cell}\nworn/b.tdms,x,\nhealthy/a.csv,y,\n")
    assert words in said and "labels.csv, " in said


def test_a_table_that_leaves_a_doubt_is_refused(bench):
    good = "worn/a.csv,x\nworn/b.tdms,x\nhealthy/a.csv,y\n"
    assert "one column 'class'" in refusal(bench, "file,label\n" + good)
    assert "none for healthy/a.csv and 1 more" in refusal(bench, "file,class\nworn/a.csv,x\n")
    assert "line 2" in refusal(bench, "file,class\na.csv,x\n") and "2 files of that name" in refusal(
        bench, "file,class\na.csv,x\n"
    )
    assert "none of that name" in refusal(bench, "file,class\n" + good + "c.csv,x\n")
    assert "got a second for worn/a.csv" in refusal(bench, "file,class\n" + good + "worn/a.csv,y\n")
    assert "got none; fill the cell" in refusal(bench, "file,class\nworn/a.csv,\n")
    assert "3 cells where the header has 2" in refusal(bench, "file,class\nworn/a.csv,x,y\n")
    assert "a name of its own" in refusal(bench, "file,class,day,day\n")
    assert "one of calibration" in refusal(
        bench, "file,class,subset\nworn/a.csv,x,test\nworn/b.tdms,x,\nhealthy/a.csv,y,"
    )
    assert "must be a number, got 'fast'" in refusal(
        bench, "file,class,motor_speed\nworn/a.csv,x,fast\nworn/b.tdms,x,\nhealthy/a.csv,y,"
    )
    assert "sensor_radius must be" in refusal(
        bench, "file,class,sensor_radius\nworn/a.csv,x,-1\nworn/b.tdms,x,\nhealthy/a.csv,y,"
    )


def test_a_table_that_is_no_text(bench):
    (bench / "labels.csv").write_bytes(b"\xff\xfe\x00\xd8")
    with pytest.raises(SignalError, match="no UTF-8 text"):
        sources_of(str(bench), bench / "labels.csv")


LABELS = b"file,class,machine,motor_speed\nworn/a.csv,x,M1,150\nworn/b.tdms,x,M2,\nhealthy/a.csv,y,M1,150\n"


@given(
    st.lists(st.tuples(st.integers(0, len(LABELS)), st.integers(0, 9), st.binary(max_size=4)), min_size=1, max_size=4)
)
@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_a_broken_table_is_sources_or_a_sentence(bench, edits):
    content = LABELS
    for place, removed, added in edits:
        content = content[:place] + added + content[place + removed :]
    (bench / "labels.csv").write_bytes(content)
    try:
        found = sources_of(str(bench), bench / "labels.csv")
    except IndexerError as error:
        assert "\n" not in str(error)
    else:
        assert [source.name for source in found] == ["healthy/a.csv", "worn/a.csv", "worn/b.tdms"]
        assert all(source.class_name for source in found)


# ------------------------------------------------------------------------------------------------ split


def source(name: str, class_name: str, subset: str | None = None, **groups: str) -> Source:
    return Source(Path(name), name, class_name, subset, groups)


MANY = [source(f"{kind}/{index}.csv", kind, machine=f"M{index % 4}") for kind in ("b", "a") for index in range(10)]


def test_classes_are_numbered_by_their_sorted_names():
    labels = labels_of(MANY, Split(), 0)
    assert {(label.number, label.name, label.code) for label in labels} == {(1, "a", "10"), (2, "b", "01")}


def test_every_class_is_shared_as_asked_file_by_file():
    labels = labels_of(MANY, Split(), 5)
    for name in ("a", "b"):
        subsets = [label.subset for label in labels if label.name == name]
        assert [subsets.count(place) for place in ("calibration", "control", "validation")] == [6, 2, 2]
    assert len({label.machine_draw for label in labels}) == 20
    assert labels == labels_of(MANY, Split(), 5)
    assert labels != labels_of(MANY, Split(), 6)


def test_a_machine_stays_in_one_subset():
    labels = labels_of(MANY, Split(by="machine"), 1)
    of_machine: dict[str, set[tuple[str, int]]] = {}
    for entry, label in zip(MANY, labels, strict=True):
        of_machine.setdefault(entry.groups["machine"], set()).add((label.subset, label.machine_draw))
    assert all(len(places) == 1 for places in of_machine.values())
    assert {label.subset for label in labels} == {"calibration", "control", "validation"}


@pytest.mark.parametrize(("files", "subsets"), [(1, 1), (2, 2), (3, 3), (5, 3)])
def test_each_subset_gets_one_where_there_are_enough(files, subsets):
    labels = labels_of([source(f"{index}", "a") for index in range(files)], Split(), 0)
    assert len({label.subset for label in labels}) == subsets


def test_subsets_of_the_table_are_kept_and_checked():
    given = [source("1", "a", "control", machine="M1"), source("2", "a", "validation", machine="M2")]
    assert [label.subset for label in labels_of(given, Split(by="machine"), 0)] == ["control", "validation"]
    with pytest.raises(ParameterError, match="all files of machine 'M1' must be in one subset"):
        labels_of([given[0], source("2", "a", "validation", machine="M1")], Split(by="machine"), 0)
    with pytest.raises(ParameterError, match="to all files or to none"):
        labels_of([given[0], source("2", "a")], Split(), 0)
    with pytest.raises(ParameterError, match=r"split\.by must be one of file, machine"):
        labels_of(given, Split(by="day"), 0)


def test_machines_of_classes_that_come_together_but_once_reach_every_subset():
    classes = ["abc", "ab", "ac", "a", "ad", "abd", "b", "acd", "bc"]
    files = [
        source(f"{number}{name}.csv", name, machine=f"M{number}") for number, own in enumerate(classes) for name in own
    ]
    labels = labels_of(files, Split(by="machine"), 0)
    assert {label.subset for label in labels} == {"calibration", "control", "validation"}
    placed = {entry.groups["machine"]: label.subset for entry, label in zip(files, labels, strict=True)}
    assert sorted(list(placed.values()).count(name) for name in set(placed.values())) == [1, 2, 6]


def test_a_file_whose_name_is_a_pattern_is_found(bench):
    (bench / "worn" / "run [1].csv").write_text("x")
    root, (path,) = files_found("ingest", "measured", str(bench / "worn" / "run [1].csv"))
    assert (root, path.name) == (bench / "worn", "run [1].csv")


def test_files_that_a_folder_leaves_out_by_their_ending_are_told(tmp_path, capsys):
    """Nothing is told of what says something about the files, and of hidden ones."""
    for name in ("a.csv", "records.yaml", ".hidden.lvm"):
        (tmp_path / name).write_text("0,1\n")
    files_found("ingest", "measured", str(tmp_path))
    assert not capsys.readouterr().err
    (tmp_path / "b.lvm").write_text("0,1\n")
    files_found("ingest", "measured", str(tmp_path))
    assert "one file of another ending is left out, b.lvm; what a pattern names is read" in capsys.readouterr().err
    (tmp_path / "c").write_text("0,1\n")
    assert [path.name for path in files_found("ingest", "measured", str(tmp_path))[1]] == ["a.csv"]
    assert "2 files of other endings are left out, b.lvm;" in capsys.readouterr().err
    assert len(files_found("ingest", "measured", f"{tmp_path}/*")[1]) == 4
