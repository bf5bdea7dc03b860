"""Analyse the table of a study, and write the report."""

from pathlib import Path

import msgspec

from experiments.analysis.planning.preregistration import Preregistration, departures
from experiments.analysis.report.report import report
from experiments.analysis.study.analysis import Analysis, analyse
from experiments.analysis.study.files import write_analysis
from experiments.analysis.study.measures import Measures, read_measures, with_survey
from experiments.analysis.study.robustness import Selection, leave_one_out
from experiments.analysis.study.table import people_path, read_people, study_table
from experiments.errors import ExperimentError
from experiments.study.data.copies import note_derived
from experiments.study.file import Study
from experiments.trials.exclusions import Exclusions, left_out


def write_report(
    folder: Path, out: Path, exclusions: Exclusions, measures: Measures, frozen: Preregistration | None = None
) -> tuple[Analysis, Selection]:
    """Analyse the people in a folder, and write the files of the analysis to `out`.

    Args:
        frozen: Preregistration with which the study is compared, or None.

    Raises:
        RecordError: The table does not fit the exclusions or the measures.
    """
    path, people = people_path(folder), read_people(folder)
    analysis = analyse(study_table(people, measures, path, exclusions), measures)
    selection = Selection(leave_one_out(people, measures, path, exclusions))
    if frozen is not None:
        departing = departures(frozen, exclusions, people, folder, measures)
        selection = Selection(selection.rules, frozen.sha256, departing)
    note_derived(folder, "analysis", out)
    write_analysis(out, analysis, report(analysis, folder, selection), selection.as_json())
    return analysis, selection


def analysis_faults(study: Study, table: Path, out: Path, *, shortened: bool = False) -> list[str]:
    """Analyse the table of simulated participants as if they were real. Return an error message if this fails.

    Excluded people are ignored, because they are real ones.

    Args:
        shortened: True if trials were too short for the rules of exclusion, of which only the columns are checked.
    """
    rules = Exclusions() if study.exclusions is None else msgspec.structs.replace(study.exclusions, people=())
    try:
        if shortened:
            left_out(rules, read_people(table), study.path)
            rules = Exclusions(unfinished="keep")
        write_report(table, out, rules, with_survey(read_measures(), table))
    except ExperimentError as error:
        return [f"the analysis cannot be computed: {error}"]
    return []
