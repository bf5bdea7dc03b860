"""Who is left out of a study, what that changes, and what departs from a preregistration."""

import json
import zipfile

import msgspec
import numpy as np
import pytest
from study_people import made_up_people, of_measures, table_of

from experiments.analysis.planning.preregistration import (
    departures,
    read_preregistration,
    write_preregistration,
)
from experiments.analysis.study.analysis import analyse, one_way_tests
from experiments.analysis.study.measures import FILE, read_measures
from experiments.analysis.study.robustness import leave_one_out
from experiments.analysis.study.table import study_table
from experiments.cli.main import main
from experiments.errors import ConfigError, RecordError
from experiments.trials.design import read_design, read_exclusions
from experiments.trials.exclusions import BY_NAME, UNFINISHED, ExcludedPerson, Exclusions, Rule, left_out
from experiments.trials.table import write_tables

SMALL = {(name, objects): 6 for name in ("none", "highlight", "optimal") for objects in (6, 12)}
SLOW = Rule("completion_time_s", ">", "longer than ten minutes", 600)
RULES = """
[[exclusions.rules]]
column = "completion_time_s"
comparison = ">"
value = 600
reason = "longer than ten minutes"
"""
PLANNED = {(name, 6): 6 for name in ("none", "optimal")}
STUDY = "[all_cells]\npeople = 6\n" + "".join(
    f'[[cells]]\nassistance = "{assistance}"\nobjects = {objects}\n' for assistance, objects in PLANNED
)


def changed(changes):
    """Made-up people, some with other values, by number of the row."""
    rows = made_up_people(SMALL)
    for k, values in changes.items():
        rows[k] |= values
    return rows


def with_unfinished(rows):
    return study_table(rows, read_measures(), "here", Exclusions(unfinished="keep"))


@pytest.mark.parametrize(
    ("comparison", "value", "those"),
    [
        (">", 600, [0]),
        (">=", 600, [0, 1]),
        ("<", 600.0, [4]),
        ("<=", 600, [1, 4]),
        ("==", 600, [1]),
        ("!=", 600, [0, 4]),
        ("missing", None, [2, 3]),
        ("infinite", None, [0]),
    ],
)
def test_a_rule_leaves_out_whose_value_compares_so(comparison, value, those):
    rule = Rule("seconds", comparison, "why", value)
    times = [float("inf"), 600.0, None, float("nan"), 10]
    assert [k for k, seconds in enumerate(times) if rule.holds({"seconds": seconds})] == those


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("column = 'a'\ncomparison = '>'\nreason = 'b'", "'>' takes a `value`"),
        ("column = 'a'\ncomparison = 'missing'\nvalue = 1\nreason = 'b'", "'missing' takes no `value`"),
        ("column = 'a'\ncomparison = '>'\nvalue = nan\nreason = 'b'", "comparison = 'infinite' or 'missing'"),
        ("column = 'a'\ncomparison = '>'\nvalue = 'x'\nreason = 'b'", "'x' has no order"),
        (
            "column = 'a'\ncomparison = 'above'\nvalue = 1\nreason = 'b'",
            "comparison is 'above'; choose one of !=, <, <=",
        ),
        ("column = 'a'\ncomparison = '>'\nvalue = 1\nreason = ' '", "line 5: rules[0].reason is ' '"),
        ("column = 'a'\ncomparison = '>'\nvalue = 1", "missing required field `reason`"),
        ("colum = 'a'", "unknown field `colum`"),
        (
            "column = 'a'\ncomparison = 'missing'\nreason = 'b'\n[[people]]\nid = 1.5\nreason = 'b'",
            "line 6: people[0].id is 1.5",
        ),
        ("column =", "is not TOML"),
    ],
)
def test_an_unusable_file_of_rules_is_refused_by_name(tmp_path, text, message):
    path = tmp_path / "rules.toml"
    path.write_text("[[rules]]\n" + text)
    with pytest.raises(ConfigError) as error:
        read_exclusions(path)
    assert message in str(error.value) and str(path) in str(error.value)


def test_the_unfinished_are_left_out_although_others_have_no_ending(tmp_path):
    cell = {"assistance": "none", "objects": 6}
    rows = [{"participant": "a", **cell}, {"participant": "b", "ended": "time limit", **cell}]
    assert [person.person for person in left_out(Exclusions(), rows, tmp_path).values()] == ["b"]
    assert left_out(Exclusions(), rows[:1], tmp_path) == {}, "a table without endings has none to leave out"


def test_rules_that_do_not_fit_the_table_are_refused_by_name():
    rows = made_up_people(SMALL)
    for exclusions, message in (
        (Exclusions((Rule("completion_time", ">", "a", 600),)), "rule 1 .*did you mean completion_time_s"),
        (Exclusions((Rule("user", "==", "a", 600),)), "'follower' cannot be compared with 600"),
        (Exclusions(people=(ExcludedPerson("nobody", "a"),)), "no person 'nobody' to leave out"),
        (Exclusions((Rule("objects", ">", "a", 0),)), r"all 36 rows are left out: 36 by objects > 0"),
    ):
        with pytest.raises(RecordError, match=message):
            leave_one_out(rows, read_measures(), "here", exclusions)


def test_a_study_file_holds_rules_and_a_rules_file_needs_no_study(tmp_path):
    study, rules = tmp_path / "study.toml", tmp_path / "rules.toml"
    study.write_text(STUDY + RULES)
    rules.write_text(RULES.replace("exclusions.", ""))
    assert read_exclusions(study) == read_exclusions(rules) == Exclusions((SLOW,))
    study.write_text(STUDY)
    with pytest.raises(ConfigError, match=r"no table \[exclusions\]"):
        read_exclusions(study)
    study.write_text(STUDY + RULES.replace("value = 600", "value = inf"))
    with pytest.raises(ConfigError, match="line 13: `value` is inf"):
        read_design(study)


def test_an_infinite_or_missing_value_leaves_a_person_out_of_that_measure_alone():
    table = table_of(changed({2: {"ipl_locations": float("inf")}, 3: {"ipl_locations": None}}))
    assert [(gap.measure, gap.value, gap.people) for gap in table.gaps] == [
        ("ipl", "infinite", ("2",)),
        ("ipl", "missing", ("3",)),
    ]
    people = [one_way_tests(table, name, 6)[0].value.people for name in ("ipl", "deviations")]
    assert people == [16, 18]


def test_an_impossible_value_is_refused_by_its_row_unless_its_person_is_left_out():
    rows = changed({0: {"ended": "time limit"}, 1: {"nd_feasible": 7.3}})
    with pytest.raises(RecordError, match=r"row 1 \(person seed 1\) has the nd_feasible 7.3"):
        table_of(rows)
    found = leave_one_out(
        rows, read_measures(), "here", Exclusions(people=(ExcludedPerson(1, "a typing error"),))
    )
    assert "nd_feasible 7.3" in found[1].refused


def test_who_did_not_finish_is_named_and_left_out_unless_kept():
    rows = changed({0: {"ended": "time limit", "visits": 0, "nd_strict_2n": None}})
    [person] = table_of(rows).left_out
    assert (person.person, person.rules) == ("0", {str(UNFINISHED): UNFINISHED.reason})
    rows[0].pop("ipl_locations")  # a visit that is not over has no measures
    kept = with_unfinished(rows)
    assert "ipl" in kept.columns
    assert not kept.left_out
    assert "1 trial ended before" in " ".join(kept.notes)


def test_acceptance_counts_the_visits_that_were_made(monkeypatch):
    """Idle people accept nothing; 3 of the 4 visits of one who gave up were as suggested."""
    idle = {"ended": "time limit", "visits": 0, "nd_strict_2n": 0.0}
    gave_up = {"ended": "time limit", "visits": 4, "nd_strict_2n": 1 / 12}
    rows = made_up_people({("optimal", 6): 6})
    rows[0] |= idle
    rows[1] |= gave_up
    seen = {}
    monkeypatch.setattr(
        "experiments.analysis.study.analysis.fit_mixtures",
        lambda accepted, visits: seen.setdefault(len(seen), (accepted, visits)),
    )
    analyse(with_unfinished(rows), read_measures())
    accepted, visits = seen[0]
    assert (accepted[0], visits[0], len(visits)) == (3, 4, 5)


def test_results_without_a_rule_are_those_of_a_study_without_it():
    rows = changed(
        {0: {"ended": "time limit"}, 1: {"completion_time_s": 900.0}, 2: {"completion_time_s": 900.0}}
    )
    exclusions = Exclusions((SLOW,), (ExcludedPerson(2, "a friend"), ExcludedPerson(3, "a friend")))
    found = {one.rule: one for one in leave_one_out(rows, read_measures(), "here", exclusions)}
    assert {rule: (one.leaves_out, one.alone) for rule, one in found.items()} == {
        str(SLOW): (2, 1),
        str(UNFINISHED): (1, 1),
        BY_NAME: (2, 1),
    }
    changes = {(c.measure, c.test, c.objects): c for c in found[str(SLOW)].changes}
    change = changes["time", "one-way", 6]
    by_hand = [np.delete(rows, left) for left in ([0, 1, 2, 3], [0, 2, 3])]
    expected = [one_way_tests(table_of(list(kept)), "time", 6)[0].value for kept in by_hand]
    assert [change.all_rules["statistic"], change.without["statistic"]] == [t.statistic for t in expected]
    assert ("time", "mixed model", None) in changes and ("time", "HC3", 6) in changes
    assert change.decision_changes == ((expected[0].p < 0.05) != (expected[1].p < 0.05))


def test_ordinal_models_are_computed_again_without_a_rule():
    rows = [row | {"user": "human", "likert_useful": 1 + k % 5} for k, row in enumerate(changed({}))]
    rows[0]["completion_time_s"] = 900.0
    [slow, _] = leave_one_out(rows, read_measures(), "here", Exclusions((SLOW,)))
    change = next(c for c in slow.changes if c.test == "ordinal" and c.objects == 6)
    expected = analyse(table_of(rows), read_measures()).find("likert_useful", "ordinal", 6).value.test
    assert change.without == {"statistic": expected.statistic, "df": 2, "p": expected.p}
    assert change.all_rules != change.without


@pytest.fixture
def study(tmp_path):
    (tmp_path / "study.toml").write_text(STUDY + RULES)
    return tmp_path / "study.toml"


def test_equal_studies_give_equal_bytes_wherever_they_are(study, tmp_path):
    elsewhere = tmp_path / "elsewhere" / "study.toml"
    elsewhere.parent.mkdir()
    elsewhere.write_text(study.read_text())
    first, second = tmp_path / "first.zip", tmp_path / "second.zip"
    assert write_preregistration(study, first) == write_preregistration(elsewhere, second)
    assert first.read_bytes() == second.read_bytes()


def test_the_study_file_is_never_replaced_by_its_preregistration(study, capsys):
    assert main(["study", "preregister", str(study), "--out", str(study), "--force"]) == 2
    assert "is the study file" in capsys.readouterr().err
    assert study.read_text() == STUDY + RULES


@pytest.mark.parametrize(
    ("old", "new", "said"),
    [
        ('"optimal"', '"optimale"', "no assistance condition 'optimale'"),
        ("people = 6", "people = 6\nuser = 'gest'", "no participant 'gest'"),
        ("people = 6", "people = 6\nuser = 'guest'\nbehaviour = { compliance = { folows = 1 } }", "folows"),
    ],
)
def test_what_there_is_not_is_not_frozen(old, new, said, tmp_path, capsys):
    (tmp_path / "study.toml").write_text(STUDY.replace(old, new))
    assert main(["study", "preregister", str(tmp_path / "study.toml"), "--out", str(tmp_path / "x.zip")]) == 2
    assert said in capsys.readouterr().err and not (tmp_path / "x.zip").exists()


def test_any_damage_to_a_preregistration_is_a_refusal_in_one_line(study, tmp_path):
    """Each of 100 bytes is changed in turn; what is still read is what was written."""
    path = tmp_path / "p.zip"
    write_preregistration(study, path)
    written, whole = read_preregistration(path), path.read_bytes()
    rng = np.random.default_rng(0)
    for place in [*rng.integers(0, len(whole), 50), *rng.integers(len(whole) - 3000, len(whole), 50)]:
        damaged = bytearray(whole)
        damaged[place] ^= 1 << rng.integers(8)
        path.write_bytes(damaged)
        try:
            assert read_preregistration(path).files == written.files
        except ConfigError as error:
            assert "\n" not in str(error)


def people_as_planned():
    """A row for each trial of the study, with its settings."""
    rows = made_up_people(PLANNED)
    for k, row in enumerate(rows):
        row |= {"house": "apartment", **dict.fromkeys(("house_seed", "person_seed", "order_seed"), k % 6)}
    return rows


def test_nothing_departs_from_a_study_that_was_run_as_planned_and_each_change_is_named(study, tmp_path):
    write_preregistration(study, tmp_path / "p.zip")
    frozen = read_preregistration(tmp_path / "p.zip")
    unknown = ["Run directories are missing, so only settings that are columns of the table are compared."]
    rows = people_as_planned()
    assert departures(frozen, frozen.exclusions, rows, tmp_path, frozen.measures) == unknown
    other = Exclusions(people=(ExcludedPerson(3, "a friend"),), unfinished="keep")
    rows[0] = {**rows[0], "house_seed": 99}
    fewer = msgspec.structs.replace(frozen.measures, likert={})
    found = "\n".join(departures(frozen, other, rows[:-1], tmp_path, fewer))
    for part in (
        "rule completion_time_s > 600 was preregistered but is not applied",
        "rule ended != 'all delivered' was preregistered but is not applied",
        "person 3 was not preregistered (a friend)",
        "The measures differ",
        "optimal, 6 objects has 5 trials, preregistered 6",
        "house_seed is not as preregistered in 1 trial, such as none, 6 objects: 99",
    ):
        assert part in found


def test_settings_that_are_no_columns_are_read_from_the_logs(study, tmp_path):
    write_preregistration(study, tmp_path / "p.zip")
    frozen = read_preregistration(tmp_path / "p.zip")
    for k, trial in enumerate(read_design(study).trials):
        run = tmp_path / "trials" / str(k)
        run.mkdir(parents=True)
        behaviour = {"decision": {"temperature": 9.0}} if k == 0 else {}
        (run / "events.jsonl").write_text(json.dumps({**trial.settings(), "behaviour": behaviour}) + "\n")
    [found] = departures(frozen, frozen.exclusions, people_as_planned(), tmp_path, frozen.measures)
    assert found.startswith("behaviour is not as preregistered in 1 trial, such as none, 6 objects: ")


def rewritten(path, change):
    """The ZIP with other files."""
    with zipfile.ZipFile(path) as archive:
        files = {name: archive.read(name) for name in archive.namelist()}
    change(files)
    with zipfile.ZipFile(path, "w") as archive:
        for name, content in files.items():
            archive.writestr(name, content)


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (
            lambda files: files.update({"exclusions.json": b"{}"}),
            "exclusions.json differs from the manifest",
        ),
        (lambda files: files.update({"more.txt": b""}), "more.txt differs"),
        (lambda files: files.pop("study.toml"), "study.toml differs"),
        (lambda files: files.pop("manifest.json"), "it has no 'manifest.json'"),
        (lambda files: files.update({"manifest.json": b"[]"}), "is not a"),
        (
            lambda files: (files.clear(), files.update({"manifest.json": b"{}"})),
            "it has no 'exclusions.json'",
        ),
    ],
)
def test_a_changed_preregistration_is_refused(study, tmp_path, change, message):
    path = tmp_path / "p.zip"
    write_preregistration(study, path)
    rewritten(path, change)
    with pytest.raises(ConfigError, match=message):
        read_preregistration(path)


@pytest.mark.usefixtures("undrawn")
def test_a_survey_of_ones_own_is_frozen_and_named_in_the_report(study, tmp_path, capsys):
    own = tmp_path / "own.toml"
    own.write_text(FILE.read_text().replace("[likert]", '[likert]\nease = "Felt at ease"'))
    people = of_measures(people_as_planned(), "nd_feasible", "completion_time_s")
    write_tables(
        tmp_path, [row | {"user": "human", "likert_ease": 4 - k % 3} for k, row in enumerate(people)]
    )
    assert main(["study", "analyze", str(tmp_path)]) == 2
    assert "--measures" in capsys.readouterr().err
    frozen = str(tmp_path / "p.zip")
    assert main(["study", "preregister", str(study), "--measures", str(own), "--out", frozen]) == 0
    for words in (["--measures", str(own)], ["--preregistration", frozen, "--force"]):
        assert main(["study", "analyze", str(tmp_path), *words]) == 0
        assert "Felt at ease" in (tmp_path / "analysis" / "report.html").read_text()
    own.write_text("[likert]\nease = 3")
    assert main(["study", "analyze", str(tmp_path), "--measures", str(own), "--force"]) == 2
    assert "own.toml" in capsys.readouterr().err


@pytest.mark.usefixtures("undrawn")
def test_the_commands_say_who_is_left_out_and_what_departs(study, tmp_path, capsys):
    rows = of_measures(people_as_planned(), "nd_feasible", "ipl_locations", "completion_time_s")
    rows[1]["completion_time_s"], rows[2]["ipl_locations"] = 900.0, float("inf")
    write_tables(tmp_path, rows)
    frozen = tmp_path / "p.zip"
    assert main(["study", "preregister", str(study), "--out", str(frozen)]) == 0
    sha256 = capsys.readouterr().out.split()[0]
    words = ["study", "analyze", str(tmp_path), "--preregistration", str(frozen)]
    assert main(words) == 0
    assert "11 people, 1 left out" in capsys.readouterr().out
    told = json.loads((tmp_path / "analysis" / "stats.json").read_text())
    assert told["preregistration"]["sha256"] == sha256
    assert len(told["preregistration"]["departures"]) == 1
    assert [person["rules"] for person in told["left_out"]] == [{str(SLOW): SLOW.reason}]
    assert told["gaps"] == [{"measure": "ipl", "value": "infinite", "people": ["2"]}]
    assert told["exclusions"][0]["changes"]
    report = (tmp_path / "analysis" / "report.html").read_text()
    for part in (
        sha256,
        SLOW.reason,
        "People who are left out",
        "infinite",
        "Without completion_time_s &gt; 600",
    ):
        assert part in report
