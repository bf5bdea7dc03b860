"""The table of a study: a row for each person who has played, with answers, and without ids or formulas."""

import asyncio
import json
import os
import shutil
import signal
from collections.abc import Mapping

import pytest
from study_people import made_up_people, of_measures

from experiments.cli.main import main
from experiments.study.data.analyses import analysis_faults
from experiments.study.data.collect import TEXTS, Collected, collect, harmless, survey_of, write_collected
from experiments.study.data.copies import copies
from experiments.study.file import read_people_study
from experiments.trials.designs import FOLDER
from experiments.trials.table import read_rows
from experiments.trials.trial import run_trial
from experiments.trials.trial_config import TrialConfig
from experiments.visit.store import Store
from mjsim.support.files import write_text_atomically

BRIEF = TrialConfig(objects=1, assistance="optimal", seed=0, fidelity="event", regret=False)
TEXT = "=HYPERLINK(1)"


@pytest.fixture(scope="module")
def run(tmp_path_factory, house):
    out = tmp_path_factory.mktemp("runs") / "task"
    run_trial(BRIEF, out, topdown=False, house=house)
    return out


@pytest.fixture(scope="module")
def study():
    return read_people_study(FOLDER / "paper.toml")


async def _fill(store, folder, run):
    """Somebody who finished, one who left during the task, and one who finished and wants it deleted."""
    answers: Mapping[str, object] = {"useful": 4, "games": "Every day", "age": 30, "comments": TEXT}
    for name, deletes in (("first", False), ("leaves", False), ("deletes", True)):
        person = await store.arrive(
            "prolific", name, {"PROLIFIC_PID": f"secret-{name}"}, name[0] * 64, "consent"
        )
        await store.finish_phase(person.id, "consent", "comprehension", {"agreed": True})
        await store.finish_phase(person.id, "comprehension", "task", {"attempts": 2, "hands": "Two"})
        if name == "leaves":
            await store.withdraw(person.id, delete=False)
            continue
        shutil.copytree(run, folder / "visits" / (name[0] * 64) / "task")
        await store.finish_trial(person.id, "task", f"visits/{name[0] * 64}/task", "all delivered")
        await store.finish_phase(person.id, "task", "survey", {}, "all delivered")
        await store.finish_phase(person.id, "survey", "completion", answers, status="finished")
        if deletes:
            await store.withdraw(person.id, delete=True)


async def _collected(study, folder, run):
    store = await Store.open(f"sqlite:///{folder / 'study.db'}", "study", study.sha256)
    try:
        await _fill(store, folder, run)
        return await collect(study, store, folder)
    finally:
        await store.close()


def test_the_table_has_a_row_for_each_person_who_played(tmp_path, study, run):
    found = asyncio.run(_collected(study, tmp_path, run))
    (row,) = found.rows
    assert (row["likert_useful"], row["likert_faster"], row["answer_games"], row["answer_age"]) == (
        4, None, "Every day", 30,
    )  # fmt: skip
    assert row["comprehension_attempts"] == 2 and row["consent_agreed"] is True
    assert (row["delivered"], row["assistance"]) == (1, "optimal")
    assert found.unfinished == {"withdrawn": 1} and found.unusable == {}
    table, _, texts = write_collected(found, tmp_path / "out")
    assert read_rows(table)[0]["likert_useful"] == 4
    assert texts.name == TEXTS and f"'{TEXT}" in texts.read_text()
    private(tmp_path / "out")
    for path in (tmp_path / "out").iterdir():
        assert b"secret-" not in path.read_bytes()


def private(folder):
    """Only the owner may read a folder and what is in it."""
    assert not [path for path in (folder, *folder.rglob("*")) if path.stat().st_mode & 0o077]


def test_tables_are_private_in_a_folder_that_is_not(tmp_path, study, run):
    found, out = asyncio.run(_collected(study, tmp_path, run)), tmp_path / "out"
    out.mkdir()
    out.chmod(0o755)
    for path in write_collected(found, out):
        assert path.stat().st_mode & 0o777 == 0o600
        write_text_atomically(path, "")
        assert path.stat().st_mode & 0o777 == 0o600, "a private file stays private when it is replaced"
    write_text_atomically(out / "other", "")
    assert (out / "other").stat().st_mode & 0o777 == 0o644


def test_a_run_that_was_changed_is_named(tmp_path, study, run):
    broken = tmp_path / "run"
    shutil.copytree(run, broken)
    with (broken / "events.jsonl").open("a") as events:
        events.write("{}\n")
    found = asyncio.run(_collected(study, tmp_path, broken))
    assert found.rows == [] and "not as written" in found.unusable["p00001"]


def test_folders_of_play_are_collected_without_their_links(tmp_path, run, capsys):
    for name, over in (("a" * 64, True), ("b" * 64, False)):
        visit = tmp_path / "play" / name
        visit.mkdir(parents=True)
        (visit / "visit.json").write_text("{}")
        if over:
            shutil.copytree(run, visit / "task")
    out = tmp_path / "table"
    assert main(["study", "collect", "paper", str(tmp_path / "play"), "--out", str(out)]) == 0
    assert "1 row; participants without a row: 1 under way" in capsys.readouterr().out
    (row,) = read_rows(out / "trials.parquet")
    assert row["delivered"] == 1 and len(row["participant"]) == 9
    assert not [path for path in out.iterdir() if b"a" * 64 in path.read_bytes()]
    assert not (tmp_path / "play" / "copies.jsonl").exists()


def test_texts_are_no_formulas():
    for text in ("=1+1", "+1", "-1", "@SUM(A1)", "\t=1", "\r=1"):
        assert harmless(text) == f"'{text}"
    assert harmless("a = b") == "a = b"


@pytest.mark.parametrize("hidden", ["\0", "\x1b", "\x85", "\u202e", "\u2066", "\u200f"])
def test_texts_have_no_invisible_characters(hidden):
    assert harmless(f"a{hidden}[31mb\tc\r\nd") == "a\ufffd[31mb\tc\r\nd"
    assert harmless(f"={hidden}1") == "'=\ufffd1"


def test_a_person_is_erased_from_database_and_files_and_backups_move_the_rest(tmp_path, run, capsys):
    study_file = tmp_path / "study.toml"
    assert main(["study", "init", str(study_file)]) == 0
    folder = tmp_path / "served"
    folder.mkdir()
    asyncio.run(_filled(study_file, folder, run))
    names = [str(study_file), str(folder)]
    assert main(["study", "erase", *names, "p00001", "--who", "me"]) == 0
    assert main(["study", "erase", *names, "p00001", "--who", "me"]) == 2, "there is nobody any more"
    assert main(["study", "backup", *names, "--out", str(study_file)]) == 2, "it is there already"
    assert main(["study", "backup", *names, "--out", str(tmp_path / "b.db"), "--database", "../.."]) == 2
    assert main(["study", "backup", *names, "--out", str(study_file / "b.db")]) == 1, "no folder"
    assert not copies(folder), "nothing was written"
    assert main(["study", "backup", *names, "--out", str(tmp_path / "backup.db")]) == 0
    moved = tmp_path / "moved"
    moved.mkdir()
    assert main(["study", "restore", str(tmp_path / "backup.db"), str(moved / "study.db")]) == 0
    assert main(["study", "collect", str(study_file), str(moved), "--out", str(tmp_path / "table")]) == 2
    assert "no participant in" in capsys.readouterr().err
    for path in (*folder.rglob("*"), tmp_path / "backup.db"):
        assert not path.is_file() or b"secret-first" not in path.read_bytes()
    assert not (folder / "visits" / ("f" * 64)).exists()


def test_a_signal_ends_restoring_in_order(tmp_path, monkeypatch, capsys):
    ended = []

    async def slow(*_):
        os.kill(os.getpid(), signal.SIGTERM)
        try:
            await asyncio.sleep(60)
        except asyncio.CancelledError:
            ended.append("in order")
            raise

    monkeypatch.setattr("experiments.visit.store.restore", slow)
    assert main(["study", "restore", "backup.db", str(tmp_path / "study.db")]) == 128 + signal.SIGTERM
    assert ended == ["in order"]
    assert capsys.readouterr().err == "mjsim: stopped by SIGTERM. Finished work is kept\n"


async def _filled(study_file, folder, run):
    study = read_people_study(study_file)
    store = await Store.open(f"sqlite:///{folder / 'study.db'}", study.settings.name, study.sha256)
    await _fill(store, folder, run)
    await store.close()


OWN_SURVEY = """
[survey]
scale = ["1", "2", "3", "4", "5", "6", "7"]
[[survey.item]]
name = "calm"
kind = "scale"
text = "I felt calm."
[[survey.item]]
name = "useful"
kind = "scale"
text = "It helped."
"""
PEOPLE = {("none", 6): 8, ("optimal", 6): 8}


@pytest.fixture
def own_study(tmp_path):
    """A study with items and a scale of its own."""
    path = tmp_path / "study.toml"
    assert main(["study", "init", str(path)]) == 0
    path.write_text(path.read_text().replace('# texts = "texts.toml"', 'texts = "texts.toml"'))
    (tmp_path / "texts.toml").write_text(OWN_SURVEY)
    return read_people_study(path)


@pytest.mark.usefixtures("undrawn")
def test_items_and_scale_of_ones_own_are_analysed_and_preregistered(tmp_path, own_study, capsys):
    assert survey_of(own_study).items == {"calm": "I felt calm.", "useful": "It helped."}
    frozen, table = str(tmp_path / "frozen.zip"), tmp_path / "table"
    assert main(["study", "preregister", str(own_study.path), "--out", frozen]) == 0
    rows = [
        row
        | {"user": "human", "participant": f"p{k}", "display_frames_per_s": 60.0}
        | {"likert_calm": 1 + k % 7, "likert_useful": 1 + k % 5}
        for k, row in enumerate(of_measures(made_up_people(PEOPLE), "nd_feasible"))
    ]
    write_collected(Collected(rows, [], {}, {}, survey_of(own_study)), table)
    assert main(["study", "analyze", str(table), "--preregistration", frozen]) == 0, capsys.readouterr().err
    page = (table / "analysis" / "report.html").read_text()
    assert "I felt calm." in page and "Help useful" in page and "to 7 (violet, agree)" in page
    assert "The measures differ" not in page
    write_collected(
        Collected([rows[0] | {"likert_calm": 8}, *rows[1:]], [], {}, {}, survey_of(own_study)), table
    )
    assert main(["study", "analyze", str(table), "--force"]) == 2
    assert "likert_calm has the answer 8; answers are whole numbers from 1 to 7" in capsys.readouterr().err


@pytest.mark.usefixtures("undrawn")
@pytest.mark.parametrize(
    ("column", "fault"),
    [
        ("display_frames_per_s", None),
        ("recruitment_known", None),
        ("display_frames", "no column 'display_frames'"),
    ],
)
def test_rules_about_displays_spare_simulated_people_and_unknown_columns_are_a_fault(
    tmp_path, own_study, column, fault
):
    path = own_study.path
    path.write_text(path.read_text().replace('"display_frames_per_s"', f'"{column}"'))
    rows = [row | {"user": "rehearsal"} for row in of_measures(made_up_people(PEOPLE), "nd_feasible")]
    write_collected(Collected(rows, [], {}, {}, survey_of(own_study)), tmp_path / "table")
    faults = analysis_faults(read_people_study(path), tmp_path / "table", tmp_path / "analysis")
    if fault is not None:
        assert [fault in one for one in faults] == [True]
        return
    assert faults == []
    notes = json.loads((tmp_path / "analysis" / "stats.json").read_text())["notes"]
    assert [note for note in notes if f"{column} < 15.0 is not applied" in note]
