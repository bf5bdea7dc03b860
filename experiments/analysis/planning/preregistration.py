"""Write and read preregistrations, which are ZIP files with the design and the analysis code of a study.

The same study always gives the same file, so the SHA-256 of the file identifies the study.
"""

import hashlib
import io
import json
import platform
import zipfile
from collections import Counter
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import msgspec

from experiments.analysis.study.measures import (
    FILE,
    SURVEY,
    Measures,
    SurveyScale,
    decoded_measures,
    read_measures,
)
from experiments.errors import ConfigError, RecordError
from experiments.record import records
from experiments.record.archive import read_file, run_paths
from experiments.record.run_directory import TRIALS
from experiments.trials.design import counted, read_design
from experiments.trials.exclusions import Exclusions
from experiments.trials.trial_config import PATHS, SETTINGS
from mjsim.support.environment import version_of
from mjsim.support.files import ROOT, read_bytes, replacing, source_digest

STUDY, DESIGN, MEASURES, EXCLUSIONS = "study.toml", "design.json", "measures.toml", "exclusions.json"
VERSIONS, MANIFEST, CODE = "versions.json", "manifest.json", "code/"
LIBRARIES = ("mjsim", "numpy", "scipy", "statsmodels")
# Source files that affect the results of an analysis
ANALYSIS = (
    "experiments/study",
    "experiments/analysis",
    "experiments/record/metrics.py",
    "experiments/trials/exclusions.py",
)
CELL = ("assistance", "objects")
_DATE = (1980, 1, 1, 0, 0, 0)  # fixed date of all ZIP entries, so that the same study gives the same file

Files = dict[str, bytes]


@dataclass(frozen=True)
class Preregistration:
    """The contents of a preregistration. `sha256` is the hash of its file, and `design` lists the trials."""

    files: Mapping[str, bytes]
    sha256: str
    exclusions: Exclusions
    measures: Measures
    versions: Mapping[str, str]
    design: Sequence[Mapping[str, Any]]


def write_preregistration(
    study: Path, out: Path, measures: Path = FILE, survey: SurveyScale | None = None
) -> str:
    """Preregister a study by writing its files to a ZIP file. Return the SHA-256 of that file.

    The file contains the survey only if it has other items or another scale than the measures.
    """
    design = read_design(study)
    known = read_measures(measures)
    if out.exists() and out.samefile(study):
        raise ConfigError(f"{out} is the study file; name another file to write")
    files = _frozen(design.exclusions or Exclusions(), measures.read_bytes())
    files[STUDY] = study.read_bytes()
    if survey is not None and known.of(survey) != known:
        files[SURVEY] = _json(msgspec.to_builtins(survey))
    files[DESIGN] = _json([_comparable(trial.settings()) for trial in design.trials])
    files[MANIFEST] = _json(
        {name: hashlib.sha256(content).hexdigest() for name, content in sorted(files.items())}
    )
    with io.BytesIO() as buffer:
        with zipfile.ZipFile(buffer, "w") as archive:
            for name, content in sorted(files.items()):
                entry = zipfile.ZipInfo(name, _DATE)
                entry.create_system, entry.external_attr = 3, 0o644 << 16
                archive.writestr(entry, content)
        data = buffer.getvalue()
    with replacing(out) as temporary:
        temporary.write_bytes(data)
    return hashlib.sha256(data).hexdigest()


def _frozen(exclusions: Exclusions, measures: bytes) -> Files:
    paths = [ROOT / path for path in ANALYSIS]
    sources = [file for path in paths for file in ([path] if path.is_file() else path.rglob("*.py"))]
    return {
        MEASURES: measures,
        EXCLUSIONS: _json(msgspec.to_builtins(exclusions)),
        VERSIONS: _json(
            {
                "python": platform.python_version(),
                **{name: version_of(name) or "not installed" for name in LIBRARIES},
                "code of mjsim": source_digest(),
            }
        ),
        **{CODE + file.relative_to(ROOT).as_posix(): file.read_bytes() for file in sources},
    }


def _json(value: Any) -> bytes:
    return (json.dumps(value, indent=1, sort_keys=True) + "\n").encode()


def read_preregistration(path: Path) -> Preregistration:
    """Read a preregistration. Raises `ConfigError` if the file is invalid or has been modified."""
    try:
        data = read_bytes(path)
        files = _unpacked(data)
        listed = msgspec.json.decode(files.pop(MANIFEST), type=dict[str, str])
        sums = {name: hashlib.sha256(content).hexdigest() for name, content in files.items()}
        if changed := sorted(name for name in {**listed, **sums} if listed.get(name) != sums.get(name)):
            raise ConfigError(f"it was changed: {changed[0]} differs from the manifest")
        exclusions = msgspec.json.decode(files[EXCLUSIONS], type=Exclusions)
        measures = decoded_measures(files[MEASURES])
        if SURVEY in files:
            measures = measures.of(msgspec.json.decode(files[SURVEY], type=SurveyScale))
        versions = msgspec.json.decode(files[VERSIONS], type=dict[str, str])
        design = msgspec.json.decode(files[DESIGN], type=list[dict[str, Any]])
        for trial in design:
            if set(trial) != set(SETTINGS) or not isinstance(trial["assistance"], str):
                raise ConfigError(f"{DESIGN} lacks settings of trials; another version wrote it")
    except OSError as error:
        raise ConfigError(f"cannot read {path}: {error.strerror}") from error
    except KeyError as error:
        raise ConfigError(f"{path} is not a preregistration: it has no {error}") from error
    except Exception as error:  # zipfile raises many different exceptions for damaged files
        raise ConfigError(f"{path} is not a valid preregistration: {error}") from error
    return Preregistration(files, hashlib.sha256(data).hexdigest(), exclusions, measures, versions, design)


def _unpacked(data: bytes) -> Files:
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        entries = archive.infolist()
        files = {}
        for entry in entries:
            if entry.compress_type != zipfile.ZIP_STORED or entry.filename in files:
                raise ConfigError(
                    "`mjsim study preregister` did not write it: files are compressed or duplicated"
                )
            files[entry.filename] = archive.read(entry)
    return files


def departures(
    frozen: Preregistration,
    exclusions: Exclusions,
    people: Sequence[Mapping[str, Any]],
    folder: Path,
    measures: Measures,
) -> list[str]:
    """Return a list of sentences that describe how a study differs from its preregistration."""
    now = _frozen(exclusions, b"")
    found = [*_of_exclusions(frozen.exclusions, exclusions)]
    if frozen.measures != measures:
        found.append("The measures differ.")
    found += _of_versions(frozen.versions, json.loads(now[VERSIONS]))
    names = {name for name in (*frozen.files, *now) if name.startswith(CODE)}
    if changed := sorted(
        name.removeprefix(CODE) for name in names if frozen.files.get(name) != now.get(name)
    ):
        found.append(f"The code of the analysis differs: {', '.join(changed)}.")
    return [*found, *_of_design(frozen.design, people, folder)]


def _of_exclusions(before: Exclusions, now: Exclusions) -> Iterator[str]:
    def reasons(exclusions: Exclusions) -> dict[str, str]:
        people = {f"the person {person.id}": person.reason for person in exclusions.people}
        return {f"the rule {rule}": rule.reason for rule in exclusions.all_rules()} | people

    old, new = reasons(before), reasons(now)
    for name in {**old, **new}:
        if name not in new:
            yield f"Exclusions: {name} was preregistered but is not applied."
        elif name not in old:
            yield f"Exclusions: {name} was not preregistered ({new[name]})."
        elif old[name] != new[name]:
            yield f"Exclusions: {name} has another reason: {old[name]!r}, now {new[name]!r}."


def _of_versions(before: Mapping[str, str], now: Mapping[str, str]) -> Iterator[str]:
    for name in {**before, **now}:
        old, new = (found.get(name, "unknown") for found in (before, now))
        if old != new:
            yield f"Version of {name}: {new}, preregistered {old}."


def _of_design(
    planned: Sequence[Mapping[str, Any]], people: Sequence[Mapping[str, Any]], folder: Path
) -> Iterator[str]:
    sizes = [Counter((row["assistance"], row["objects"]) for row in rows) for rows in (planned, people)]
    for cell in {**sizes[0], **sizes[1]}:
        there, meant = sizes[1][cell], sizes[0][cell]
        if there != meant:
            name = f"{cell[0]}, {counted(cell[1], 'object')}"
            yield f"The cell {name} has {counted(there, 'trial')}, preregistered {meant}."
    ran = _settings_of_runs(folder)
    if len(ran) != len(people):
        yield "Run directories are missing, so only settings that are columns of the table are compared."
        ran = [_comparable(row) for row in people]
    for name in (n for n in SETTINGS if n not in CELL and all(n in row for row in ran)):
        if other := _by_cell(ran, name) - _by_cell(planned, name):
            yield f"{name} is not as preregistered in {counted(other.total(), 'trial')}, such as {next(iter(other))}."


def _by_cell(rows: Sequence[Mapping[str, Any]], name: str) -> Counter[str]:
    return Counter(
        f"{row['assistance']}, {counted(row['objects'], 'object')}: {json.dumps(row[name], sort_keys=True)}"
        for row in rows
    )


def _settings_of_runs(folder: Path) -> list[dict[str, Any]]:
    found = []
    for path in run_paths(folder / TRIALS):
        try:
            start = json.loads(read_file(path, records.EVENTS).partition(b"\n")[0])
            found.append(_comparable({name: start[name] for name in SETTINGS}))
        except (OSError, ValueError, KeyError, RecordError):
            continue
    return found


def _comparable(row: Mapping[str, Any]) -> dict[str, Any]:
    found = {name: row[name] for name in SETTINGS if name in row}
    for name in PATHS:
        path = found.get(name)
        if isinstance(path, str) and (name != "house" or path.endswith(".toml")):
            file = Path(path)
            found[name] = hashlib.sha256(file.read_bytes()).hexdigest() if file.is_file() else file.name
    return found
