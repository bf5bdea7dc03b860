"""`mjsim study analyze` and `power`: reports of one file, and one-line answers to unusual tables."""

import json
import re
from html.parser import HTMLParser

import numpy as np
import pyarrow.csv
import pyarrow.parquet as pq
import pytest
from study_people import made_up_people, of_measures, table_of

from experiments.analysis.page import p_text, shown
from experiments.analysis.planning.power import MIN_POOL, StudyCost, Wanted, _eta_squared, plan_power
from experiments.analysis.report.report import _houses
from experiments.analysis.report.summary import summary
from experiments.analysis.statistics.effects import people_per_cell
from experiments.analysis.study import analysis as study_analysis
from experiments.analysis.study.analysis import analyse
from experiments.analysis.study.measures import read_measures
from experiments.cli import compare, run
from experiments.cli.main import main
from experiments.errors import ConfigError, RecordError, StatisticsError
from experiments.house import read_words
from experiments.record.phases import RECORDED, SIMULATED
from experiments.trials.table import read_rows, write_tables
from experiments.web.client_files import CLIENT

SMALL = {(name, objects): 6 for name in ("none", "highlight", "optimal") for objects in (6, 12)}
LARGER = dict.fromkeys(SMALL, 40)


def test_a_table_whose_values_are_damaged_is_refused(tmp_path):
    path, _ = write_tables(tmp_path, made_up_people({("none", 6): 3, ("optimal", 6): 3}))
    good, data = read_rows(path), path.read_bytes()
    footer, refused = int.from_bytes(data[-8:-4], "little"), 0  # which has no checksum
    for at in range(0, len(data) - 8 - footer, 19):
        path.write_bytes(data[:at] + bytes([data[at] ^ 1 << at % 8]) + data[at + 1 :])
        try:
            assert read_rows(path) == good
        except RecordError:
            refused += 1
    assert refused > 20


def test_columns_that_nothing_analyses_are_named():
    rows = made_up_people({("none", 6): 3, ("optimal", 6): 3})
    rows[-1] |= {"excluded": True, "mood\n": 3}
    *_, note = table_of(rows).notes
    assert note == "These columns of the table are not analysed: 'excluded', 'mood\\n'."


def quick_analysis(monkeypatch, rows):
    """All tests except mixed models, which take long."""

    def left_out(*_):
        raise StatisticsError("left out")

    monkeypatch.setattr(study_analysis, "mixed_model", left_out)
    return analyse(table_of(rows), read_measures())


def test_acceptance_is_of_conditions_that_show_a_plan(monkeypatch):
    names = ("none", "highlight-minimap", "none-pointer", "optimal", "own:shown")
    rows = [row | {"assistance": name} for name in names for row in made_up_people({("none", 6): 6})]
    found = quick_analysis(
        monkeypatch, [row | {"person_seed": k, "order_seed": k} for k, row in enumerate(rows)]
    )
    kinds = {r.kind for r in found.results if r.kind.startswith("acceptance")}
    assert kinds == {f"acceptance, {name}" for name in ("none-pointer", "optimal", "own:shown")}


def test_the_summary_says_what_was_asked_and_found(monkeypatch):
    analysis = quick_analysis(monkeypatch, made_up_people(dict.fromkeys(SMALL, 12)))
    question, deviations, *others = summary(analysis, {"deviations": "Deviations", "time": "Time (s)"})
    asked = "Question: do people with none, highlight and optimal as assistance differ in Deviations and Time (s)?"
    assert question == f"{asked} The table has 72 trials with 6 and 12 objects."
    f_test = r"F\(2, 66\) = [\d.]+, p < \.001, partial η² = 0\.\d+"
    means = r"none 0\.\d+, highlight 0\.\d+, optimal 0\.\d+"
    assert re.fullmatch(rf"Deviations: the conditions differ, {f_test}. Means: {means}\.", deviations)
    assert [p_text(p) for p in (0.0004, 0.4661, 1.0)] == ["p < .001", "p = .466", "p = 1.000"]
    assert (
        len(others) == 1 and "Time (s): no difference between the conditions was found, F(2, 66)" in others[0]
    )


@pytest.mark.parametrize("homes", [1, 2])
def test_one_house_has_no_table_of_houses(monkeypatch, homes):
    rows = made_up_people({(name, 6): 6 for name in ("none", "optimal")})
    for k, row in enumerate(rows):
        row |= {"house": f"home {k % homes}", "rooms": 3 + k % homes, "area_m2": 40.0}
    by_rooms, _ = _houses(quick_analysis(monkeypatch, rows))
    assert [row[0] for row in by_rooms.rows] == ([3, 4] if homes > 1 else [])


def test_a_model_that_memory_does_not_suffice_for_says_what_to_do(monkeypatch):
    def exhausted(*_):
        raise MemoryError

    monkeypatch.setattr(study_analysis, "mixed_model", exhausted)
    found = analyse(table_of(made_up_people(SMALL)), read_measures()).find("distance", "mixed model")
    assert found.reason.startswith("not enough memory; analyse fewer trials")


def test_a_measure_has_one_column_wherever_it_is_named():
    """Normalized deviations and inverse path length: study, score, table of a run, comparison, result page."""
    columns = {m.label.lower(): m.column for m in read_measures().objective.values()}
    told = {label.partition(" (")[0]: (column, label) for column, label, _ in run.SHOWN_METRICS}
    page = (CLIENT / "templates" / "result.html").read_text()
    for name in ("normalized deviations", "inverse path length"):
        assert told[name] == (columns[name], f"{name} ({columns[name]})")
        assert columns[name] in compare.METRICS
    column = columns["inverse path length"]
    assert re.search(
        rf'section\["path_length"\] }}}}</dt><dd>{{{{ \("%.2f" \| format\(metrics.{column}\)\)', page
    )
    assert read_words()["result"]["path_length"] == "Inverse path length"


class Elements(HTMLParser):
    """Tags and attributes of a page."""

    def __init__(self, text):
        super().__init__()
        self.found = []
        self.feed(text)

    def handle_starttag(self, tag, attrs):
        self.found.append((tag, dict(attrs)))


def study(folder, rows):
    write_tables(folder, rows)
    return folder


def two_measures_of_people():
    return of_measures(made_up_people(LARGER), "nd_feasible", "nd_strict_2n", "ipl_locations")


@pytest.fixture(scope="module")
def analysed(tmp_path_factory):
    folder = study(tmp_path_factory.mktemp("study"), two_measures_of_people())
    assert main(["study", "analyze", str(folder)]) == 0
    return folder / "analysis"


def test_the_report_is_one_file(analysed):
    text = (analysed / "report.html").read_text()
    page = Elements(text).found
    tags = {tag for tag, _ in page}
    assert "svg" in tags
    assert not tags & {"script", "link", "iframe", "object", "img"}
    assert not re.search(r"https?:|//\w+\.\w|@import|url\((?!#)", text)
    links = [v for _, a in page for n, v in a.items() if n in ("src", "href", "xlink:href")]
    assert all(link.startswith("#") for link in links)


def test_the_report_begins_with_every_hypothesis(analysed):
    first = (analysed / "report.html").read_text().split("<section>")[1]
    assert first.startswith("<h2>Summary</h2>")
    tests = pyarrow.csv.read_csv(analysed / "tests.csv").to_pylist()
    scored = {"deviations", "ipl"}
    for test in tests:
        if test["measure"] in scored and test["test"] in ("one-way", "two-way, Type II"):
            assert f"F({test['df1']}, {test['df2']:.4g}) = {shown(test['statistic'])}" in first
    assert first.count("optimal - none") == 2 * 2


@pytest.mark.slow
def test_every_figure_has_a_caption_and_one_shows_all_readings_of_a_measure(tmp_path):
    people = of_measures(made_up_people(SMALL), "nd_feasible", "ipl_locations")
    folder = study(tmp_path, [row | {"nd_bin_tied": row["nd_feasible"] ** 2} for row in people])
    assert main(["study", "analyze", str(folder)]) == 0
    page = (folder / "analysis" / "report.html").read_text()
    assert page.count("<svg") == page.count("<figcaption>Figure ") == 6  # two of them specification curves
    tests = pyarrow.csv.read_csv(folder / "analysis" / "tests.csv").to_pylist()
    assert {t["test"] for t in tests if t["measure"] == "nd_bin_tied"} > {"HC3", "two-way, Welch-James"}
    assert "nd_bin_tied" not in re.sub("<svg.*?</svg>", "", page, flags=re.DOTALL)


def test_diagnostics_and_tests_without_equal_variances_stand_beside_the_others(analysed):
    found = json.loads((analysed / "stats.json").read_text())["results"]
    diagnostics = next(r for r in found if r["kind"] == "diagnostics" and r["measure"] == "deviations")
    assert diagnostics["value"]["largest_deviation"][0].startswith("optimal")
    assert diagnostics["value"]["equal_variances"]["p"] < 0.001
    assert diagnostics["value"]["kurtosis"] > 0.5  # the mixture of two spreads has long tails
    page = (analysed / "report.html").read_text().split("<h2>Assumptions</h2>")[1].split("</section>")[0]
    rows = re.findall(r"<td>(assistance|objects|interaction)</td>.*?(the same|differ)</td>", page)
    assert len(rows) == 2 * (2 + 3)


def test_simulated_stands_on_every_output(analysed):
    text = (analysed / "report.html").read_text()
    assert text.count('<p class="origin">Simulated</p>') == text.count("<h2>") + 1
    assert "<title>Simulated:" in text
    for tag, attributes in Elements(text).found:
        if tag == "svg":
            assert attributes["aria-label"].endswith(f"{SIMULATED}.")
    assert json.loads((analysed / "stats.json").read_text())["origin"] == SIMULATED
    for table in (pq.read_table(analysed / "people.parquet"), pyarrow.csv.read_csv(analysed / "tests.csv")):
        assert set(table["origin"].to_pylist()) == {SIMULATED}


def test_tables_hold_everybody_and_every_test(analysed):
    people = pq.read_table(analysed / "people.parquet")
    assert people.num_rows == sum(LARGER.values())
    assert people["deviations"].to_pylist() == [r["nd_feasible"] for r in made_up_people(LARGER)]
    tests = pyarrow.csv.read_csv(analysed / "tests.csv").to_pylist()
    two_way = [t for t in tests if t["measure"] == "deviations" and t["test"] == "two-way, Type II"]
    assert [(t["effect"], t["df1"], t["df2"]) for t in two_way] == [
        ("assistance", 2, 234.0),
        ("objects", 1, 234.0),
        ("interaction", 2, 234.0),
    ]


@pytest.mark.slow
def test_equal_people_give_equal_bytes(analysed, tmp_path):
    again = study(tmp_path, two_measures_of_people())
    assert main(["study", "analyze", str(again)]) == 0
    for name in ("stats.json", "people.csv", "tests.csv"):
        assert (again / "analysis" / name).read_bytes() == (analysed / name).read_bytes()
    mine, other = (f / "report.html" for f in (again / "analysis", analysed))
    assert mine.read_text() == other.read_text().replace(str(analysed.parent), str(again))


def test_an_earlier_analysis_is_kept(analysed, capsys):
    before = (analysed / "report.html").stat().st_mtime_ns
    assert main(["study", "analyze", str(analysed.parent)]) == 2
    assert "--force" in capsys.readouterr().err
    assert (analysed / "report.html").stat().st_mtime_ns == before


@pytest.mark.slow
def test_answers_of_people_are_analysed():
    rng, people = np.random.default_rng(1), made_up_people(dict.fromkeys(SMALL, 30), user="human")
    table = table_of([{**row, "likert_useful": int(rng.integers(1, 6))} for row in people])
    assert table.origin == RECORDED
    analysis = analyse(table, read_measures())
    assert analysis.find("likert_useful", "ordinal", 6).value.people == 90
    assert analysis.find("likert_useful", "one-way", 12).value.df2 == 87


def test_answers_of_simulated_people_are_refused():
    with pytest.raises(RecordError, match="answers are never simulated"):
        table_of(made_up_people(SMALL, likert_useful=4))


def test_time_over_familiarisation_comes_first():
    watched = table_of(made_up_people(SMALL, completion_over_familiarisation=2.0))
    assert watched.sources["time"] == "completion_over_familiarisation"
    assert table_of(made_up_people(SMALL)).sources["time"] == "completion_time_s"


def test_a_missing_cell_and_one_of_a_single_person_leave_the_other_tests():
    table = table_of(made_up_people({**SMALL, ("none", 12): 1, ("optimal", 12): 0}))
    found = {(r.measure, r.kind): r.reason for r in analyse(table, read_measures()).results}
    assert found["deviations", "two-way, Type II"].startswith("no people in the cell optimal, 12")
    assert found["deviations", "welch"] == "none has 1 known values, 2 are needed"
    assert found["deviations", "one-way"] is None


def test_notes_name_what_confounds():
    rows = made_up_people(SMALL)
    for row in rows:
        row["user"] = "searcher" if row["assistance"] == "none" else "follower"
        row["person_seed"] = row["order_seed"] = 1
    text = " ".join(table_of(rows).notes)
    assert "several cells" in text
    assert "confounded with user" in text


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"assistance": None}, "the assistance None, not a name"),
        ({"objects": 0}, "0 objects, not a whole number"),
        ({"nd_feasible": "much"}, "'much', which is not a number"),
        ({"nd_feasible": 7.3}, "nd_feasible 7.3, not a number from 0 to 1; correct"),
        ({"nd_strict_2n": -2}, r"row 0 \(person seed 0\) has the nd_strict_2n -2"),
        ({"ipl_locations": -0.1}, "ipl_locations -0.1"),
        ({"completion_time_s": 1e308}, "completion_time_s 1e\\+308"),
        ({"task_distance_m": -1.0}, "task_distance_m -1"),
        ({"user": "human", "likert_ease": 4}, r"likert_ease.*nearest is likert_easy.*to \[likert\]"),
        ({"user": "human", "Likert_easy": 4}, "Likert_easy"),
        ({"user": "human", "likert_useful": 6}, "the answer 6; answers are whole numbers"),
    ],
)
def test_values_that_cannot_be_are_named(change, message):
    with pytest.raises(RecordError, match=message):
        table_of(made_up_people(SMALL, **change))


@pytest.mark.parametrize("key", ["fingerprint", "person_seed"])
def test_rows_that_are_there_twice_are_named(key, tmp_path, capsys):
    rows = [row | {"fingerprint": f"f{k}"} for k, row in enumerate(made_up_people(SMALL))]
    if key == "person_seed":
        rows = [{name: v for name, v in row.items() if name != "fingerprint"} for row in rows]
    study(tmp_path, [*rows, rows[3] | {"ended": "time limit"}])
    for command in ("study analyze", "study score", "compare"):
        assert main([*command.split(), str(tmp_path)]) == 2
        assert "rows 3 and 36 are the same trial" in capsys.readouterr().err
    # People may play the same trial.
    people = [row | {"user": "human", "person_seed": 0} for row in rows]
    assert len(read_rows(write_tables(tmp_path, people)[0])) == 36
    with pytest.raises(RecordError, match="rows 0 and 36"):
        read_rows(write_tables(tmp_path, people + people[:1])[0])


def test_unusual_folders_get_one_line(tmp_path, capsys):
    (tmp_path / "torn").mkdir()
    (tmp_path / "torn" / "trials.parquet").write_bytes(b"PAR1")
    study(tmp_path, [{"a": 1}])
    for folder in (tmp_path / "nowhere", tmp_path / "torn", tmp_path):
        for command in ("study analyze", "study score", "compare"):
            assert main([*command.split(), str(folder)]) == 2
            assert len(capsys.readouterr().err.splitlines()) == 1


def test_power_of_a_difference_follows_from_the_variance():
    cells = [(name, 6) for name in ("none", "highlight", "optimal")]
    table = table_of(made_up_people(dict.fromkeys(cells, 100)))
    plan = plan_power(cells, table, Wanted("ipl", difference=0.1), StudyCost(fee=0.2, dropout=0.5))
    variance = np.mean([v.var(ddof=1) for v in table.groups("ipl", 6).values()])
    ratio = 0.1**2 / (2 * 3 * variance)  # Cohen's f squared: one mean low, one high, one between
    assert plan.eta_squared == pytest.approx(ratio / (1 + ratio), rel=1e-12)
    assert plan.per_cell == people_per_cell(plan.eta_squared, 2, 3)
    assert plan.interval[0] < plan.per_cell < plan.interval[1]
    assert plan.power == pytest.approx(0.8, abs=0.08)
    assert plan.people == 3 * plan.per_cell
    assert plan.to_recruit == 2 * plan.people
    assert plan.cost == pytest.approx(plan.people * 7.5 * 1.2)
    assert plan.hours == pytest.approx(plan.to_recruit * 25 / 60)


@pytest.mark.slow
def test_power_of_the_pools_own_effect():
    cells = list(SMALL)
    table = table_of(made_up_people(dict.fromkeys(cells, 60)))
    plan = plan_power(cells, table, Wanted("distance", "assistance"), StudyCost())
    assert plan.power > 0.7
    assert plan == plan_power(cells, table, Wanted("distance", "assistance"), StudyCost())


def test_people_drawn_from_a_pool_have_the_effect_of_the_pool_on_average():
    """Their means differ by the chance of the pool and by their own: both are taken off."""
    rng, wanted = np.random.default_rng(0), Wanted("ipl")
    pool = {(name, 6): rng.normal(mean, 1, 30) for name, mean in zip("abc", (0.0, 0.3, 0.6), strict=True)}

    def ratio(eta_squared):
        return eta_squared / (1 - eta_squared)

    drawn = [{cell: rng.choice(v, 30) for cell, v in pool.items()} for _ in range(2000)]
    found = []
    for one in drawn:
        try:
            found.append(ratio(_eta_squared(one, wanted, draws=2)))
        except StatisticsError:
            found.append(0.0)
    assert np.median(found) == pytest.approx(ratio(_eta_squared(pool, wanted)), rel=0.15)


def test_power_says_what_it_cannot_know():
    cells = [(name, 6) for name in ("none", "highlight", "optimal")]
    table = table_of(made_up_people(dict.fromkeys(cells, 20)))
    with pytest.raises(StatisticsError, match="0 people with highlight and 12 objects"):
        plan_power([*cells, *((n, 12) for n, _ in cells)], table, Wanted("ipl"), StudyCost())
    with pytest.raises(ConfigError, match="only one level"):
        plan_power(cells, table, Wanted("ipl", "objects"), StudyCost())
    with pytest.raises(ConfigError, match="no measure 'speed'"):
        plan_power(cells, table, Wanted("speed"), StudyCost())
    for wrong in ({"difference": -1.0}, {"eta_squared": 1.5}, {"power": 0.0}, {"effect": "gravity"}):
        with pytest.raises(ConfigError):
            Wanted("ipl", **wrong)


def test_the_power_commands_help_names_the_smallest_pool(capsys):
    with pytest.raises(SystemExit):
        main(["study", "power", "--help"])
    assert f"at least {MIN_POOL} per cell" in " ".join(capsys.readouterr().out.split())


def test_the_power_command(tmp_path, capsys):
    people = made_up_people(dict.fromkeys(SMALL, 30))
    people[4]["ended"] = "time limit"
    study(tmp_path, people)
    cells = "".join(f'[[cells]]\nassistance = "{a}"\nobjects = {n}\npeople = 5\n' for a, n in SMALL)
    (tmp_path / "study.toml").write_text(cells)
    out = tmp_path / "power.json"
    words = ["study", "power", str(tmp_path / "study.toml"), "--pool", str(tmp_path), "--difference", "0.1"]
    assert main([*words, "--out", str(out)]) == 0
    found = json.loads(out.read_text())
    assert found["origin"] == SIMULATED
    assert [person["person"] for person in found["left_out"]] == ["4"]
    told = capsys.readouterr().out
    assert f"{found['per_cell']} [90 % interval" in told
    assert "left out, as not everything was delivered: 4" in told


@pytest.mark.usefixtures("undrawn")
def test_people_with_several_trials_in_several_homes(tmp_path):
    """Crossed factors, their shares, homes by rooms, and a note on the tests that know nothing of it."""
    rows = of_measures(made_up_people({(name, 6): 24 for name in ("none", "optimal")}), "nd_feasible")
    for k, row in enumerate(rows):
        person, trial = divmod(k, 3)
        home = (person % 8 + 3 * trial) % 8
        row |= {"house": f"home {home}", "house_seed": 0, "person_seed": person, "order_seed": person}
        row |= {
            "trial_number": trial + 1,
            "rooms": 1 + home // 2,
            "area_m2": 40.0 + home,
            "fingerprint": f"{k}",
        }
    write_tables(tmp_path, rows)
    assert main(["study", "analyze", str(tmp_path)]) == 0
    results = json.loads((tmp_path / "analysis/stats.json").read_text())["results"]
    (model,) = (r["value"] for r in results if (r["measure"], r["kind"]) == ("deviations", "mixed model"))
    assert list(model["random"]) == ["person", "trial_number", "house", "house x assistance"]
    for factor in model["random"].values():
        assert 0 <= factor["interval"][0] <= factor["share"] <= factor["interval"][1] <= 1
    (rooms,) = (
        r["value"] for r in results if (r["measure"], r["kind"]) == ("deviations", "mixed model, rooms")
    )
    assert list(rooms["tests"]) == ["assistance", "rooms", "rooms x assistance"]
    people = pyarrow.csv.read_csv(tmp_path / "analysis/people.csv").to_pylist()
    assert people[3]["objects_per_m2"] == pytest.approx(6 / people[3]["area_m2"])
    report = (tmp_path / "analysis/report.html").read_text()
    assert "People have several trials in a cell" in report and "houses drawn again" in report


@pytest.mark.slow
def test_a_report_of_many_trials_stays_small_and_has_no_link(tmp_path):
    people = of_measures(made_up_people({("none", 6): 1050, ("optimal", 6): 1050}), "nd_feasible")
    write_tables(tmp_path, people)
    assert main(["study", "analyze", str(tmp_path)]) == 0
    page = (tmp_path / "analysis" / "report.html").read_text()
    assert len(page) < 500_000 and "data:image/png" in page
    assert not re.search(r'(?:href|src)="(?!#|data:image/png)', page)
