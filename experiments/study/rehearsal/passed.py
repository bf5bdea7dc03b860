"""Nobody is paid before a rehearsal of the study file has passed."""

from pathlib import Path

from experiments.errors import ConfigError
from experiments.record.files import read_json
from experiments.study.data.collect import check_people
from experiments.study.file import Study
from experiments.study.rehearsal.report import REPORT
from experiments.visit.store import Store

PASSED, WITHOUT = "rehearsal passed", "pays without a rehearsal"


async def require_rehearsal(store: Store, study: Study, folder: Path | None, *, without: bool) -> None:
    """Check that a rehearsal of the study file has passed; the audit log remembers that, or that none was wanted.

    Args:
        store: Of real people.
        study: The study.
        folder: Of a rehearsal; None if its success is in the audit log already.
        without: Whether people may be paid all the same.

    Raises:
        ConfigError: No rehearsal of this very file has passed.
        RecordError: The people are those of a rehearsal.
    """
    check_people(study, await store.people())
    log = await store.audit_log()
    if any(row.action == PASSED and row.details.get("study") == study.sha256 for row in log):
        return
    if folder is not None:
        found = read_json(folder / REPORT)
        if found.get("settings", {}).get("study") != study.sha256:
            raise ConfigError(
                f"{folder / REPORT} is that of another study file; rehearse {study.path} as it is now"
            )
        if found.get("passed") is not True:
            raise ConfigError(f"{folder / REPORT} lists what went wrong; correct it and rehearse again")
        await store.audit("mjsim", PASSED, {"study": study.sha256, "people": found["settings"]["people"]})
    elif without:
        await store.audit("mjsim", WITHOUT, {"study": study.sha256})
    else:
        raise ConfigError(
            f"no rehearsal of {study.path} has passed: run `mjsim study rehearse` and name its folder by --rehearsal, "
            "or pay all the same by --without-rehearsal"
        )
