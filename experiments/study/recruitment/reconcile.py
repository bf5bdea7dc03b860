"""Compare participants with the submissions that the recruitment platform lists."""

import re
from collections.abc import Mapping
from pathlib import Path

from experiments.errors import ConfigError, RecordError
from experiments.study.data.collect import person_name
from experiments.study.file import Study
from experiments.study.recruitment import recruiter
from experiments.visit.store import Store
from mjsim.support.files import read_text

_ID = re.compile("[0-9A-Za-z-]+")


async def reconcile(study: Study, store: Store, file: Path, who: str) -> Mapping[str, bool]:
    """Record for each participant if the platform lists their submission, and return this by participant.

    Participants without platform ids are omitted, for example if the ids have been deleted.

    Args:
        file: List of submissions that the researcher has downloaded from the platform, with one line each.
        who: Name of the researcher, for the audit log.

    Raises:
        ConfigError: The platform has no submissions.
        RecordError: The file lists no participant of the study.
    """
    platform = recruiter(study.settings.recruitment)
    if not platform.submission:
        raise ConfigError(
            f"study.recruitment.platform is {platform.platform!r}; it has no list of submissions"
        )
    person_id, submission_id = platform.submission
    lines = [set(_ID.findall(line)) for line in read_text(file).splitlines()]
    lines_of = {one: line for line in lines for one in line}  # the id of a submission is in one line only
    known: dict[int, bool] = {}
    names: dict[str, bool] = {}
    for person in await store.people():
        if ids := {} if person.delete_wanted else await store.identity(person.id):
            listed = ids.get(person_id) in lines_of.get(ids.get(submission_id, ""), ())
            known[person.id] = names[person_name(person)] = listed
    if known and not any(known.values()):
        raise RecordError(
            f"{file} lists none of the {len(known)} participants; download the submissions of this study"
        )
    await store.set_known(known, who)
    return names
