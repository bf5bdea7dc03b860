"""Files that were made from a study: which of them are rewritten, deleted or left alone when a person is removed."""

import os
import time
from pathlib import Path

import pytest

from experiments.analysis.study.table import FILES
from experiments.study.data.copies import copies, forget_copies, note_copy, note_derived
from experiments.study.data.erase import LEFTOVER_S, remove_from_files
from experiments.trials.table import NAME, read_rows, write_tables
from mjsim.support.files import WORK

TOKEN, OTHER = "b" * 64, "a" * 64
NAMES = ("p00002", TOKEN, "b-visit")


@pytest.fixture
def folder(tmp_path):
    found = tmp_path / "served"
    found.mkdir()
    return found


def people_in(table):
    return [row["participant"] for row in read_rows(table / f"{NAME}.parquet")]


def listed(folder):
    return {Path(copy.path).name for copy in copies(folder)}


@pytest.mark.parametrize("name", ["p00002", TOKEN, "b-visit"])
@pytest.mark.parametrize("kind", ["table", "export"])
def test_a_table_keeps_the_rows_of_the_others(folder, tmp_path, kind, name):
    table = tmp_path / "out"
    (table / "data").mkdir(parents=True)
    note_copy(folder, kind, table)
    write_tables(table, [{"participant": one, "time": 1.0} for one in (name, "p00001", name, "p00003")])
    (table / "data" / "answers.csv").write_text(f"item,participant\nuseful,p00001\nclear,{name}\n")
    (table / "texts.csv").write_text(f"participant,text\np00001,hello {name}\n")
    (table / "codebook.csv").write_text(f"column,meaning\n{name},a column\n")
    (said,) = remove_from_files(folder, NAMES)
    assert said.startswith(f"{kind} {table} of 2") and said.endswith("was rewritten without p00002")
    assert people_in(table) == ["p00001", "p00003"]
    assert (table / f"{NAME}.csv").read_text().count("p0000") == 2
    assert (table / "data" / "answers.csv").read_text() == "item,participant\nuseful,p00001\n"
    assert "p00001" in (table / "texts.csv").read_text() and name in (table / "codebook.csv").read_text()
    before = {path: path.stat().st_mtime_ns for path in table.rglob("*")}
    assert remove_from_files(folder, NAMES) == [], "nothing is left to remove"
    assert {path: path.stat().st_mtime_ns for path in table.rglob("*")} == before
    assert listed(folder) == {"out"}


def test_a_table_of_one_person_is_removed_and_so_are_the_runs_of_an_export(folder, tmp_path):
    table, export = tmp_path / "table", tmp_path / "export"
    for run in ("p00001", "p00002"):
        (export / "runs" / run / "task").mkdir(parents=True)
    table.mkdir()
    write_tables(table, [{"participant": "p00002", "time": 1.0}])
    note_copy(folder, "table", table)
    note_copy(folder, "export", export)
    assert len(remove_from_files(folder, NAMES)) == 2
    assert not (table / f"{NAME}.parquet").exists()
    assert "p00002" not in (table / f"{NAME}.csv").read_text()
    assert [path.name for path in (export / "runs").iterdir()] == ["p00001"]


@pytest.mark.parametrize("kind", ["film", "page", "metrics"])
def test_a_file_is_deleted_if_it_was_made_from_the_person_or_names_the_person(folder, tmp_path, kind):
    made = {
        "from_runs": (f"visits/{TOKEN}/task", "a picture"),
        "from_others": (f"visits/{OTHER}/task", "a picture"),
        "names_person": ("visits", "rows of p00001 and p00002"),
        "names_folder": ("visits", f"a row of {TOKEN}"),
        "names_others": ("visits", f"rows of p00001, p00003 and {OTHER}"),
    }
    for name, (source, text) in made.items():
        note_copy(folder, kind, tmp_path / name, source)
        (tmp_path / name).write_text(text)
    said = remove_from_files(folder, NAMES)
    gone = {name for name in made if not (tmp_path / name).exists()}
    assert gone == {"from_runs", "names_person", "names_folder"}
    assert {line.split()[1] for line in said} == {str(tmp_path / name) for name in gone}
    assert all("was deleted because it contained p00002; make it again" in line for line in said)
    assert listed(folder) == made.keys() - gone
    assert remove_from_files(folder, NAMES) == []


def test_only_the_files_of_an_analysis_are_deleted_also_where_it_was_not_listed(folder, tmp_path):
    usual, elsewhere, others = folder / "analysis", tmp_path / "elsewhere", tmp_path / "others"
    for place, person in ((usual, "p00002"), (elsewhere, "p00002"), (others, "p00001")):
        place.mkdir()
        for name in (*FILES, "notes.txt"):
            (place / name).write_text(f"the results of {person}")
        if place != usual:
            note_copy(folder, "analysis", place)
    said = remove_from_files(folder, NAMES)
    assert [line.partition(" of ")[0] for line in said if str(elsewhere) in line] == [f"analysis {elsewhere}"]
    assert any(f"analysis {usual} was deleted" in line for line in said) and len(said) == 2
    for place in (usual, elsewhere):
        assert [path.name for path in place.iterdir()] == ["notes.txt"]
    assert len(list(others.iterdir())) == len(FILES) + 1
    assert listed(folder) == {"others"}


def test_a_missing_file_is_named_and_stays_listed_but_databases_are_left_to_others(folder, tmp_path):
    for kind in ("table", "film", "backup", "database"):
        note_copy(folder, kind, tmp_path / kind)
    said = remove_from_files(folder, NAMES)
    assert {line.split()[0] for line in said} == {"table", "film"}
    assert all("is missing; if it was moved, delete p00002 there" in line for line in said)
    assert listed(folder) == {"table", "film", "backup", "database"}


def test_files_made_from_a_copy_are_found_in_its_own_list(folder, tmp_path):
    export = tmp_path / "export"
    (export / "runs" / "p00002").mkdir(parents=True)
    note_copy(folder, "export", export)
    note_copy(export, "export", export)
    film = tmp_path / "film.mp4"
    note_derived(export / "runs" / "p00002", "film", film)
    film.write_text("a picture")
    assert [copy.source for copy in copies(export) if copy.kind == "film"] == ["runs/p00002"]
    said = remove_from_files(folder, NAMES)
    assert not film.exists() and any(line.startswith(f"film {film}") for line in said)
    assert listed(export) == {"export"}


def test_old_temporary_files_of_processes_that_ended_are_deleted(folder, tmp_path):
    note_copy(folder, "page", tmp_path / "page.html")
    kept, gone = [], []
    for place in (folder, tmp_path):
        for process, age, stays in ((os.getpid(), 2.0, True), (2**30, 2.0, False), (2**30 + 1, 0.5, True)):
            path = place / f"{WORK}{process}-x"
            path.write_text("a row of p00002")
            changed = time.time() - age * LEFTOVER_S
            os.utime(path, (changed, changed))
            (kept if stays else gone).append(path)
    remove_from_files(folder, NAMES)
    assert all(path.exists() for path in kept) and not any(path.exists() for path in gone)


def test_the_last_entry_of_a_path_counts_and_an_entry_that_was_cut_off_does_not(folder):
    note_copy(folder, "film", folder / "x", "visits/one")
    note_copy(folder, "page", folder / "y")
    note_copy(folder, "film", folder / "x", "visits/two")
    with (folder / "copies.jsonl").open("a") as file:
        file.write('{"kind": "film", "path"')
    assert {Path(copy.path).name: copy.source for copy in copies(folder)} == {"x": "visits/two", "y": ""}
    forget_copies(folder, [])
    assert (folder / "copies.jsonl").read_text().endswith('"path"'), "nothing was written"
    forget_copies(folder, [str(folder / "x")])
    assert listed(folder) == {"y"}
    assert copies(folder / "nowhere") == []
